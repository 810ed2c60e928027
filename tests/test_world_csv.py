"""Scenarios from UXsim's three CSV files, in all their dresses, with all their faults at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from uxsim_geo import InputError, World

NODES = ["name,x,y", "橋,1.5,-2", "10276762426,0,0"]
LINKS = ["name,start,end,length,u,kappa,merge_priority", "通り,橋,10276762426,500,15,0.1,0.5"]
DEMAND = ["orig,dest,start_t,end_t,q", "橋,10276762426,100,300,0.25"]


def write(
    folder: Path,
    nodes: list[str] = NODES,
    links: list[str] = LINKS,
    demand: list[str] = DEMAND,
    *,
    encoding: str = "utf-8",
    tail: str = "",
) -> tuple[Path, Path, Path]:
    paths = tuple(folder / f"{name}.csv" for name in ("nodes", "links", "demand"))
    for path, lines in zip(paths, (nodes, links, demand), strict=True):
        path.write_bytes("".join(f"{line}{tail}\n" for line in lines).encode(encoding))
    return paths  # type: ignore[return-value]


def quiet(**told: object) -> World:
    return World(**{"print_mode": 0, "save_mode": 0, "random_seed": 1, **told})  # type: ignore[arg-type]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "shift_jis"])
@pytest.mark.parametrize("tail", ["", ",", ",,\r"])
@pytest.mark.parametrize("headed", [True, False])
def test_the_same_scenario_in_any_dress(
    tmp_path: Path, encoding: str, tail: str, headed: bool
) -> None:
    tables = [table if headed else table[1:] for table in (NODES, LINKS, DEMAND)]
    world = quiet()
    world.load_scenario_from_csv(*write(tmp_path, *tables, encoding=encoding, tail=tail), tmax=900)
    assert [(node.name, node.x, node.y) for node in world.NODES] == [
        ("橋", 1.5, -2.0),
        ("10276762426", 0.0, 0.0),
    ]
    link = world.get_link("通り")
    assert (link.start_node.name, link.end_node.name) == ("橋", "10276762426")
    assert (link.length, link.free_flow_speed, link.jam_density) == (500, 15, 0.1)
    assert (link.merge_priority, link.number_of_lanes) == (0.5, 1)
    assert world.TMAX == 900
    world.exec_simulation()
    trips = world.result.trips
    assert trips["vehicles"].sum() == 50
    assert trips["depart_s"].between(100, 300).all()
    assert set(trips["status"]) == {"completed"}


def test_columns_in_another_order_by_their_names_and_optional_ones(tmp_path: Path) -> None:
    nodes = ["y,x,name,remark", "0,0,a,gate", "0,1,b,"]
    links = [
        "length,name,end,start,number_of_lanes,capacity_out,note",
        "1000,ab,b,a,3,1.5,wide",
        "1000,ba,a,b,,,",
    ]
    demand = ["orig,dest,start_t,end_t,volume", "a,b,0,100,30"]
    world = quiet()
    world.load_scenario_from_csv(*write(tmp_path, nodes, links, demand))
    wide, narrow = world.LINKS
    assert (wide.start_node.name, wide.number_of_lanes, wide.capacity_out) == ("a", 3, 1.5)
    assert (narrow.number_of_lanes, narrow.capacity_out, narrow.free_flow_speed) == (1, None, 20)
    assert wide.capacity == pytest.approx(2.4)
    assert world.get_node("b").x == 1
    world.exec_simulation()
    assert world.result.trips["vehicles"].sum() == 30


def test_quoted_names_keep_their_commas(tmp_path: Path) -> None:
    nodes = ['"(0, 1)",0,1', '"(0, 2)",0,2']
    links = ['"l, 1","(0, 1)","(0, 2)",500,20,0.2,1']
    world = quiet()
    world.load_scenario_from_csv(*write(tmp_path, nodes, links, ['"(0, 1)","(0, 2)",0,10,1']))
    assert world.get_link("l, 1").start_node.name == "(0, 1)"


def test_all_faults_of_all_files_at_once_and_nothing_is_added(tmp_path: Path) -> None:
    nodes = ["name,x,y", "a,0,0", "b,1,east", "a,2,0"]
    links = [
        "name,start,end,length,u,kappa,merge_priority,number_of_lanes",
        "ab,a,b,-5,20,0.2,1,1",
        "ab,a,b,100,0,inf,1,1.5",
    ]
    demand = ["orig,dest,start_t,end_t,q", "a,a,0,100,1", "a,b,50,50,", "a,,0,10,1"]
    paths = write(tmp_path, nodes, links, demand)
    world = quiet()
    with pytest.raises(InputError) as caught:
        world.load_scenario_from_csv(*paths)
    found = {
        (Path(fault.source).stem, fault.line, fault.column, fault.value)
        for fault in caught.value.faults
    }
    assert found == {
        ("nodes", 3, "y", "east"),
        ("nodes", 4, "name", "a"),
        ("links", 2, "length", "-5"),
        ("links", 3, "name", "ab"),
        ("links", 3, "u", "0"),
        ("links", 3, "kappa", "inf"),
        ("links", 3, "number_of_lanes", "1.5"),
        ("demand", 2, "dest", "a"),
        ("demand", 3, "q", None),
        ("demand", 3, "end_t", "50"),
        ("demand", 4, "dest", None),
    }
    assert world.NODES == []
    assert world.LINKS == []


def test_unknown_nodes_are_named_where_they_stand(tmp_path: Path) -> None:
    links = ["l,橋,ghost,500,20,0.2,1"]
    demand = ["nobody,橋,0,10,1"]
    with pytest.raises(InputError) as caught:
        quiet().load_scenario_from_csv(*write(tmp_path, NODES, links, demand))
    assert [(fault.line, fault.column, fault.value) for fault in caught.value.faults] == [
        (1, "end", "ghost"),
        (1, "orig", "nobody"),
    ]


def test_a_second_file_must_not_repeat_what_the_world_has(tmp_path: Path) -> None:
    world = quiet()
    world.addNode("橋", 0, 0)
    with pytest.raises(InputError, match=r"nodes\.csv:2, column name: the name is taken"):
        world.load_scenario_from_csv(*write(tmp_path))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"\n,,\n", "is empty"),
        (b"name,x\na,1\n", "lacks the column y"),
        (b"name,x,y\n\x81 ,1,2\n", "neither in UTF-8 nor in Shift_JIS"),
        (None, "no such file"),
    ],
)
def test_files_that_cannot_be_read_say_why(
    tmp_path: Path, content: bytes | None, said: str
) -> None:
    nodes, links, demand = write(tmp_path)
    if content is None:
        nodes.unlink()
    else:
        nodes.write_bytes(content)
    with pytest.raises(InputError, match=said):
        quiet().load_scenario_from_csv(nodes, links, demand)


@pytest.mark.parametrize("name", ["siouxfalls", "uroboros"])
def test_published_scenarios_load(shared: Path, name: str) -> None:
    world = quiet(tmax=6000)
    files = [
        shared / "data" / "uxsim" / f"{name}_{part}.csv" for part in ("nodes", "links", "demand")
    ]
    world.load_scenario_from_csv(*files)
    assert len(world.LINKS) == {"siouxfalls": 76, "uroboros": 12}[name]


def test_a_published_network_in_shift_jis_loads(shared: Path, tmp_path: Path) -> None:
    folder = shared / "data" / "uxsim"
    demand = tmp_path / "demand.csv"
    demand.write_text("orig,dest,start_t,end_t,q\n31295413,31254272,0,100,0.1\n", encoding="utf-8")
    world = quiet()
    network = [folder / f"tokyo_arterial_{part}.csv" for part in ("nodes", "links")]
    world.load_scenario_from_csv(*network, demand)
    assert any("通り" in link.name for link in world.LINKS)

"""GMNS folders of three links: every rule of the reading by itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from gmns_files import EAST, LINKS, METRIC, NODES, NORTH, faults_of, folder_of, placed, read, told

from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.gmns_options import GmnsOptions
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, Network


def topics(network: Network) -> list[str]:
    return list(dict.fromkeys(network.notes["topic"]))


def with_column(name: str, *cells: str) -> list[str]:
    return [f"{row},{cell}" for row, cell in zip(LINKS, (name, *cells), strict=True)]


def line(*points: tuple[float, float]) -> str:
    return "LINESTRING (" + ", ".join(f"{x + EAST} {y + NORTH}" for x, y in points) + ")"


def test_a_folder_becomes_tables_in_si_units(tmp_path: Path) -> None:
    network = read(tmp_path)
    check_network(network)
    assert tuple(network.nodes.columns) == (*NODE_COLUMNS, "geometry")
    assert tuple(network.links.columns) == (*LINK_COLUMNS, "geometry")
    links = network.links
    assert links["link_id"].tolist() == ["a", "b", "c"]
    assert links["length"].tolist() == [1000, 500, 1120]
    assert links["free_speed"].tolist() == [10, 10, 20]
    assert links["lanes"].tolist() == [2, 1, 1]
    assert links["lanes"].dtype == np.int64
    # 1800 veh/h and lane: 1 veh/s on two lanes, half of it on one
    assert links["capacity"].tolist()[:2] == [1.0, 0.5]
    assert np.isnan(links["capacity"][2])
    assert links["merge_priority"].tolist() == [2, 1, 1]
    assert set(links["jam_density"]) == {0.2}
    assert set(links["lanes_source"]) == set(links["free_speed_source"]) == {"given"}
    assert network.nodes["zone_id"].isna().all()
    assert network.links.crs == network.nodes.crs == "EPSG:32632"
    assert topics(network) == ["no capacity", "straight lines"]


@pytest.mark.parametrize(
    ("config", "length", "speed"),
    [
        ("foot,feet,mph", 1000 * 0.3048, 36 * 0.44704),
        ("foot,Mile,MPH", 1609344.0, 36 * 0.44704),
        ("m,km,kph", 1_000_000.0, 10.0),
        ("m,meters,m/s", 1000.0, 36.0),
    ],
)
def test_units_and_system_from_config(
    tmp_path: Path, config: str, length: float, speed: float
) -> None:
    rows = ["short_length,long_length,speed,crs", f"{config},32632"]
    options = GmnsOptions(length_check="warn")
    network = read(tmp_path, options, config=rows)
    assert network.links["length"][0] == pytest.approx(length, rel=1e-15)
    assert network.links["free_speed"][0] == pytest.approx(speed, rel=1e-15)
    assert network.links.crs == "EPSG:32632"


def test_options_hold_against_config_and_it_is_noted(tmp_path: Path) -> None:
    rows = ["long_length,speed,crs", "mile,mph,4326"]
    network = read(tmp_path, config=rows)
    assert network.links["length"].tolist() == [1000, 500, 1120]
    notes = network.notes[network.notes["topic"] == "option against config.csv"]
    assert notes["value"].tolist() == ["EPSG:4326", "mi", "mph"]


def test_units_and_system_are_never_guessed(tmp_path: Path) -> None:
    faults = faults_of(tmp_path, GmnsOptions())
    assert told(faults) == {
        ("node", None, None, None),
        ("link", None, "length", None),
        ("link", None, "free_speed", None),
    }
    assert "EPSG:4326" in faults[0].what
    assert "length_unit" in faults[1].what
    assert "1000, 500, 1120 ... could be anything" in faults[1].what


@pytest.mark.parametrize(("unit", "rather"), [("ft", "m"), ("km", "m"), ("mi", "m")])
def test_lengths_that_fit_the_geometry_in_another_unit_are_refused(
    tmp_path: Path, unit: str, rather: str
) -> None:
    faults = faults_of(tmp_path, replace(METRIC, length_unit=unit))
    assert told(faults) == {("link", None, "length", None)}
    assert f"the unit is rather {rather}" in faults[0].what
    network = read(tmp_path, replace(METRIC, length_unit=unit, length_check="warn"))
    assert "lengths differ" in topics(network)


def test_lengths_measured_on_a_web_map_are_told_of(tmp_path: Path) -> None:
    # at 60° north Web Mercator shows twice the length
    degrees = ["node_id,x_coord,y_coord", "1,10,60", "2,10.01,60", "3,10.01,60.005"]
    metres = 111_320 * np.array([0.01 * 0.5, 0.005, 0.0071])
    links = LINKS[:1] + [
        ",".join([*row.split(",")[:4], f"{2 * metre:.1f}", *row.split(",")[5:]])
        for row, metre in zip(LINKS[1:], metres, strict=True)
    ]
    network = read(tmp_path, replace(METRIC, crs="EPSG:4326"), node=degrees, link=links)
    (ratio,) = network.notes.loc[network.notes["topic"] == "lengths differ", "value"]
    assert float(ratio) == pytest.approx(2, rel=0.01)
    options = replace(METRIC, crs="EPSG:4326", length_from="geometry")
    network = read(tmp_path, options, node=degrees, link=links)
    assert network.links["length"].to_numpy() == pytest.approx(metres, rel=0.02)


def test_column_names_cut_at_ten_letters_and_in_capitals(tmp_path: Path) -> None:
    header = "LINK_ID,from_node_,to_node_id,directed,length,free_speed,lanes,capacity,facility_t"
    rows = [header, *(f"{row},primary" for row in LINKS[1:])]
    network = read(tmp_path, link=rows)
    assert set(network.links["road_class"]) == {"primary"}
    assert "gmns_facility_t" not in network.links


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_text_in_its_dresses(tmp_path: Path, mark: str, end: str) -> None:
    rows = with_column("name", '"Main, St"', ' "Ä ""7"""'.strip(), " ")
    data = (mark + end.join(rows)).encode()
    network = read(tmp_path, link=data)
    names = network.links["name"]
    assert names.tolist()[:2] == ["Main, St", 'Ä "7"']
    assert names.isna().tolist() == [False, False, True]


def test_an_undirected_link_makes_two(tmp_path: Path) -> None:
    rows = [row.replace("a,1,2,1", "a,1,2,0") for row in with_column("geometry", "", "", "")]
    rows[1] += f'"{line((0, 0), (400, 30), (1000, 0))}"'
    network = read(tmp_path, link=rows)
    links = network.links
    assert links["link_id"].tolist() == ["a", "a-reverse", "b", "c"]
    assert links[["from_node_id", "to_node_id"]].iloc[:2].to_numpy().tolist() == [
        ["1", "2"],
        ["2", "1"],
    ]
    assert links["source_id"].tolist() == ["a", "a", "b", "c"]
    shapes = links.geometry
    assert shapely.equals_exact(shapes[0].reverse(), shapes[1])


def test_the_opposite_direction_must_not_have_the_id_of_another(tmp_path: Path) -> None:
    rows = [LINKS[0], LINKS[1].replace("1,1000", "0,1000"), LINKS[2].replace("b,", "a-reverse,")]
    (fault,) = faults_of(tmp_path, link=rows)
    assert (fault.column, fault.value) == ("link_id", "a-reverse")


@pytest.mark.parametrize(
    ("flag", "points", "turned"),
    [
        ("1", [(0, 0), (400, 30), (1000, 0)], False),
        ("-1", [(1000, 0), (400, 30), (0, 0)], False),
        ("0", [(1000, 0), (400, 30), (0, 0)], False),
        ("", [(0, 0), (400, 30), (1000, 0)], False),
        ("1", [(1000, 0), (400, 30), (0, 0)], True),
        ("-1", [(0, 0), (400, 30), (1000, 0)], True),
    ],
)
def test_lines_lead_from_node_to_node_whatever_way_they_are_drawn(
    tmp_path: Path, flag: str, points: list[tuple[float, float]], turned: bool
) -> None:
    rows = with_column("dir_flag", flag, "", "")
    rows = [
        f'{row},"{extra}"'
        for row, extra in zip(rows, ("geometry", line(*points), "", ""), strict=True)
    ]
    network = read(tmp_path, link=rows)
    places = shapely.get_coordinates(network.links.geometry[0]) - [EAST, NORTH]
    assert places.tolist() == [[0, 0], [400, 30], [1000, 0]]
    assert ("geometry turned" in topics(network)) == turned


def test_lines_from_geometry_csv_and_of_several_parts(tmp_path: Path) -> None:
    rows = with_column("geometry_id", "g1", "g2", "")
    parts = f"MULTI{line((1000, 0), (1000, 200))}".replace("(", "((", 1)[:-1]
    parts += f"), ({line((1000, 200), (1000, 500))[12:-1]}))"
    shapes = ["geometry_id,geometry", f'g1,"{line((0, 0), (5, 9), (1000, 0))}"', f'g2,"{parts}"']
    network = read(tmp_path, link=rows, geometry=shapes)
    sizes = shapely.get_num_coordinates(np.asarray(network.links.geometry))
    assert sizes.tolist() == [3, 3, 2]
    assert set(network.links.geometry.geom_type) == {"LineString"}


def test_lines_that_end_far_from_their_nodes_are_told_of(tmp_path: Path) -> None:
    rows = with_column("geometry", f'"{line((0, 200), (1000, 0))}"', "", "")
    network = read(tmp_path, link=rows)
    far = network.notes[network.notes["topic"] == "geometry off its node"]
    assert far["element_id"].tolist() == ["a"]
    assert float(far["value"].iloc[0]) == pytest.approx(200, rel=1e-3)


def test_a_missing_length_is_that_of_the_geometry(tmp_path: Path) -> None:
    rows = [row.replace("1,1000,", "1,,") for row in LINKS]
    network = read(tmp_path, link=rows)
    assert network.links["length"][0] == pytest.approx(1000, rel=1e-3)
    assert "length assumed" in topics(network)
    (fault,) = faults_of(tmp_path, replace(METRIC, crs="none"), link=rows)
    assert "no known reference system" in fault.what


def test_missing_lanes_and_speeds_are_faults_unless_stated(tmp_path: Path) -> None:
    rows = [row.replace("36,2", ",") for row in with_column("facility_type", "x", "y", "z")]
    faults = faults_of(tmp_path, link=rows)
    assert told(faults) == {("link", 2, "lanes", None), ("link", 2, "free_speed", None)}
    assert "link_id a; of x" in faults[0].what
    options = replace(METRIC, lanes_where_missing=3, speed_where_missing=12.5)
    network = read(tmp_path, options, link=rows)
    link = network.links.iloc[0]
    assert (link["lanes"], link["free_speed"], link["capacity"]) == (3, 12.5, 1.5)
    assert (link["lanes_source"], link["free_speed_source"]) == ("assumed", "assumed")
    assert set(network.links["lanes_source"][1:]) == {"given"}
    assumed = network.notes[network.notes["topic"].isin(["lanes assumed", "free speed assumed"])]
    assert assumed["element_id"].tolist() == ["a", "a"]


def test_lanes_are_counted_in_lane_csv(tmp_path: Path) -> None:
    rows = [row.replace("36,2,", "36,,") for row in LINKS]
    lanes = ["lane_id,link_id,lane_num,allowed_uses", "1,a,1,", "2,a,2,AUTO", "3,a,3,bike"]
    lanes += ["4,b,1,", "5,b,2,"]
    network = read(tmp_path, link=rows, lane=lanes)
    assert network.links["lanes"].tolist() == [2, 1, 1]
    (differ,) = network.notes.loc[network.notes["topic"] == "lanes differ", "value"]
    assert differ == "1"


@pytest.mark.parametrize(
    ("options", "uses", "kept"),
    [
        (METRIC, ("auto", "walk;bike", ""), ["a", "c"]),
        (METRIC, ('"WALK, BIKE"', "ALL", "bike"), ["b"]),
        (replace(METRIC, uses=("bus",)), ("auto", "bus;auto", "walk"), ["b"]),
    ],
)
def test_links_for_others_are_left_out_and_told_of(
    tmp_path: Path, options: GmnsOptions, uses: tuple[str, str, str], kept: list[str]
) -> None:
    network = read(tmp_path, options, link=with_column("allowed_uses", *uses))
    assert network.links["link_id"].tolist() == kept
    left = network.notes[network.notes["topic"] == "left out"]
    assert left["value"].astype(int).sum() == 3 - len(kept)


def test_types_and_laneless_links_are_left_out_with_their_nodes(tmp_path: Path) -> None:
    nodes = placed([*NODES, "4,0,70", "5,9,9"])
    links = [*with_column("facility_type", "road", "road", "road"), "s,4,1,1,70,,,,Sidewalk"]
    links += ["p,1,4,1,70,9,0,,path"]
    network = read(tmp_path, replace(METRIC, leave_out=("sidewalk",)), node=nodes, link=links)
    assert network.links["link_id"].tolist() == ["a", "b", "c"]
    # no link at all is at node 5: it stays, nothing says that it is for others
    assert network.nodes["node_id"].tolist() == ["1", "2", "3", "5"]
    assert topics(network)[:2] == ["left out", "no capacity"]


def test_no_link_for_motor_vehicles_is_a_fault(tmp_path: Path) -> None:
    (fault,) = faults_of(tmp_path, link=with_column("allowed_uses", "walk", "walk", "bike"))
    assert fault.what.endswith("state uses among bike, walk")


def test_turns_that_are_not_listed_are_banned_where_others_are(tmp_path: Path) -> None:
    links = [*LINKS, "d,2,1,1,1000,36,1,", "e,3,2,1,500,36,1,"]
    header = "mvmt_id,node_id,ib_link_id,ob_link_id,type,allowed_uses,penalty"
    movements = [header, "1,2,a,b,left,,", "2,2,e,d,right,auto,5", "3,2,a,d,uturn,bike,"]
    network = read(tmp_path, link=links, movement=movements)
    assert network.movements.to_numpy().tolist() == [["2", "a", "d"], ["2", "e", "b"]]
    notes = network.notes.set_index("topic")["value"]
    assert (notes["banned turns"], notes["movements"]) == ("2", "1")
    network = read(tmp_path, replace(METRIC, turns="all"), link=links, movement=movements)
    assert network.movements.empty
    assert "not read" in topics(network)


def test_a_listing_that_leaves_a_link_no_way_on_is_told_of(tmp_path: Path) -> None:
    links = [*LINKS, "e,3,2,1,500,36,1,"]
    movements = ["mvmt_id,node_id,ib_link_id,ob_link_id", "1,2,a,b"]
    network = read(tmp_path, link=links, movement=movements)
    assert network.movements.to_numpy().tolist() == [["2", "e", "b"]]
    dead = network.notes[network.notes["topic"] == "dead end"]
    assert dead["element_id"].tolist() == ["e"]


def test_turns_of_undirected_links_hold_for_the_direction_that_fits(tmp_path: Path) -> None:
    links = [LINKS[0], "a,1,2,0,1000,36,2,", "b,2,3,0,500,36,1,", "c,3,1,1,1120,72,1,"]
    movements = ["mvmt_id,node_id,ib_link_id,ob_link_id", "1,2,a,b", "2,2,b,a"]
    network = read(tmp_path, link=links, movement=movements)
    assert network.movements.to_numpy().tolist() == [
        ["2", "a", "a-reverse"],
        ["2", "b-reverse", "b"],
    ]


def test_nodes_know_their_zones_signals_and_centroids(tmp_path: Path) -> None:
    header = "node_id,x_coord,y_coord,zone_id,ctrl_type,node_type"
    nodes = placed(
        [header, "1,0,0,7,SIGNAL,", "2,1000,0,,stop,intersection", "3,1000,500,8,1.0,Centroid"]
    )
    network = read(tmp_path, node=nodes)
    assert network.nodes["zone_id"].tolist()[::2] == ["7", "8"]
    assert network.nodes["zone_id"].isna().tolist() == [False, True, False]
    assert network.nodes["control"].tolist() == ["signal", "none", "signal"]
    assert network.nodes["through_traffic"].tolist() == [True, True, False]
    assert network.nodes["gmns_node_type"].tolist()[1:] == ["intersection", "Centroid"]
    assert topics(network)[:2] == ["control", "centroids"]


def test_columns_that_mean_nothing_here_are_kept(tmp_path: Path) -> None:
    rows = with_column("grade", "1.5", "", "-2")
    rows = [f"{row},{cell}" for row, cell in zip(rows, ("osm_way_id", "7", "8", "9"), strict=True)]
    rows = [f"{row}," for row in rows]
    network = read(tmp_path, link=rows)
    assert network.links["gmns_grade"].to_numpy() == pytest.approx([1.5, np.nan, -2], nan_ok=True)
    assert network.links["gmns_osm_way_id"].tolist() == ["7", "8", "9"]
    assert list(network.links.columns)[-2:] == ["gmns_grade", "gmns_osm_way_id"]


def test_capacities_of_days_are_told_of_and_may_be_stated(tmp_path: Path) -> None:
    rows = [row.replace(",1800", ",36000") for row in LINKS]
    network = read(tmp_path, link=rows)
    (value,) = network.notes.loc[network.notes["topic"] == "large capacity", "value"]
    assert value == "2"
    network = read(tmp_path, replace(METRIC, capacity_unit="veh/day"), link=rows)
    assert network.links["capacity"].tolist()[:2] == pytest.approx([36000 / 86400] * 2)
    assert "large capacity" not in topics(network)


def test_tables_that_are_not_simulated_are_told_of(tmp_path: Path) -> None:
    network = read(tmp_path, segment=["segment_id", "1"], link_tod=["link_tod_id", "1"])
    notes = network.notes[network.notes["topic"] == "not read"]
    assert [note.split(":")[0] for note in notes["note"]] == ["segment.csv", "link_tod.csv"]


def test_files_in_capitals_are_found(tmp_path: Path) -> None:
    folder_of(tmp_path)
    (tmp_path / "link.csv").rename(tmp_path / "LINK.CSV")
    assert len(read_gmns_network(tmp_path, METRIC).links) == 3


def test_options_tell_all_that_is_wrong_with_them() -> None:
    with pytest.raises(InputError) as raised:
        GmnsOptions(
            length_unit="yard",
            speed_unit="m",
            length_from="map",  # type: ignore[arg-type]
            uses="auto",  # type: ignore[arg-type]
            lanes_where_missing=0,
            speed_where_missing=float("inf"),
            jam_density=-1,
        )
    assert [fault.column for fault in raised.value.faults] == [
        "length_from",
        "length_unit",
        "speed_unit",
        "lanes_where_missing",
        "speed_where_missing",
        "jam_density",
        "uses",
    ]

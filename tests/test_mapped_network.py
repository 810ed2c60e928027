"""Tables of lines with any columns: every rule of the mapping by itself, and every fault."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from uxsim_geo.errors import Fault, InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.mapped import network_from_tables
from uxsim_geo.network.mapped_options import ColumnMapping, Direction, Source
from uxsim_geo.network.measure import distances, line_lengths
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, Network

METRES = "EPSG:32632"
ORIGIN = np.array([500_000.0, 5_300_000.0])

Points = list[tuple[float, float]]

#: a ring of three lines
RING: list[Points] = [
    [(0, 0), (1000, 0)],
    [(1000, 0), (1000, 500)],
    [(1000, 500), (500, 300), (0, 0)],
]


def line(points: Points) -> Any:
    return shapely.linestrings(np.array(points) + ORIGIN)


def table(
    lines: list[Points] | None = None, *, crs: str | None = METRES, **columns: list[Any]
) -> gpd.GeoDataFrame:
    shapes = [line(points) for points in (RING if lines is None else lines)]
    own = {"vmax": [36, 36, 72], "n": [1, 2, 1]} if lines is None else {}
    return gpd.GeoDataFrame(own | columns, geometry=shapes, crs=crs)


def mapping(links: Mapping[str, Any] | None = None, **others: Any) -> ColumnMapping:
    given = {"free_speed": Source("vmax", unit="km/h"), "lanes": "n"} | dict(links or {})
    return ColumnMapping({name: one for name, one in given.items() if one is not None}, **others)


#: lanes and speed of tables that have neither
PLAIN = {"free_speed": 10.0, "lanes": 1}


def faults_of(
    links: gpd.GeoDataFrame, given: ColumnMapping, nodes: gpd.GeoDataFrame | None = None
) -> list[Fault]:
    with pytest.raises(InputError) as raised:
        network_from_tables(links, given, nodes)
    return raised.value.faults


def topics(network: Network) -> list[str]:
    return list(dict.fromkeys(network.notes["topic"]))


def test_lines_alone_make_a_network() -> None:
    network = network_from_tables(table(), mapping())
    check_network(network)
    assert tuple(network.nodes.columns) == (*NODE_COLUMNS, "geometry")
    assert tuple(network.links.columns) == (*LINK_COLUMNS, "geometry")
    assert network.links.crs == network.nodes.crs == METRES
    assert network.nodes["node_id"].tolist() == ["1", "2", "3"]
    ends = network.links[["from_node_id", "to_node_id"]].to_numpy().tolist()
    assert ends == [["1", "2"], ["2", "3"], ["3", "1"]]
    assert network.links["link_id"].tolist() == ["1", "2", "3"]
    assert network.links["free_speed"].tolist() == [10, 10, 20]
    assert network.links["lanes"].tolist() == [1, 2, 1]
    assert network.links["lanes"].dtype == np.int64
    assert network.links["merge_priority"].tolist() == [1, 2, 1]
    assert network.links["capacity"].isna().all()
    metres = [1000, 500, math.hypot(500, 200) + math.hypot(500, 300)]
    assert network.links["length"].to_numpy() == pytest.approx(metres, rel=1e-3)
    assert set(network.links["lanes_source"]) == {"given"}
    assert topics(network) == ["links numbered", "nodes from ends", "length of geometry"]


def test_units_of_columns_and_of_lanes() -> None:
    links = table(km=[1.0, 0.5, 1.12], cap=[1800, "900", None], kj=[200, 150, 100], id=[7.0, 8, 9])
    network = network_from_tables(
        links,
        mapping(
            {
                "link_id": "id",
                "length": Source("km", unit="km"),
                "capacity": Source("cap", unit="veh/h/lane"),
                "jam_density": Source("kj", unit="veh/km"),
                "merge_priority": Source("n"),
            }
        ),
    )
    assert network.links["link_id"].tolist() == ["7", "8", "9"]
    assert network.links["length"].tolist() == [1000, 500, 1120]
    assert network.links["capacity"].tolist()[:2] == [0.5, 0.5]
    assert np.isnan(network.links["capacity"][2])
    assert network.links["jam_density"].tolist() == [0.2, 0.15, 0.1]


def test_constants_values_and_what_stands_for_nothing() -> None:
    links = table(cls=["a", "b", "zz"], lanes=["2", None, " "], name=["x", "", None])
    network = network_from_tables(
        links,
        ColumnMapping(
            {
                "free_speed": Source("cls", unit="km/h", values={"a": 36, "b": 72}, missing=18),
                "lanes": Source("lanes", missing=3),
                "capacity": Source(constant=900, unit="veh/h"),
                "jam_density": 0.15,
                "road_class": Source("cls", values={"a": "primary"}, missing="other"),
                "name": "name",
            }
        ),
    )
    table_of = network.links
    assert table_of["free_speed"].tolist() == [10, 20, 5]
    assert set(table_of["free_speed_source"]) == {"assumed"}
    assert table_of["lanes"].tolist() == [2, 3, 3]
    assert table_of["lanes_source"].tolist() == ["given", "assumed", "assumed"]
    assert set(table_of["capacity"]) == {0.25}
    assert set(table_of["jam_density"]) == {0.15}
    assert table_of["road_class"].tolist() == ["primary", "other", "other"]
    assert table_of["name"].isna().tolist() == [False, True, True]
    notes = network.notes.set_index("topic")["value"]
    assert (notes["lanes assumed"], notes["free speed assumed"]) == ("2", "3")


WAYS = Direction("oneway", forward=("F",), backward=("T",), both=(None, "B"))


def test_rows_of_one_direction_the_other_and_both() -> None:
    links = table(oneway=["B", "F", "T"])
    network = network_from_tables(links, mapping(direction=WAYS))
    assert network.links["link_id"].tolist() == ["1", "1-reverse", "2", "3"]
    ends = network.links[["from_node_id", "to_node_id"]].to_numpy().tolist()
    assert ends == [["1", "2"], ["2", "1"], ["2", "3"], ["1", "3"]]
    assert network.links["source_id"].tolist() == ["1", "1", "2", "3"]
    starts = shapely.get_coordinates(shapely.get_point(np.asarray(network.links.geometry), 0))
    assert (starts - ORIGIN).tolist() == [[0, 0], [1000, 0], [1000, 0], [0, 0]]


def test_what_is_said_of_the_second_direction_holds_for_it() -> None:
    links = table(oneway=[None, "F", "T"], v2=[18, None, 90], n2=[3, None, 2], cap=[600, 600, 600])
    network = network_from_tables(
        links,
        mapping(
            {
                "free_speed_backward": Source("v2", unit="km/h"),
                "lanes_backward": "n2",
                "capacity": Source("cap", unit="veh/h/lane"),
            },
            direction=WAYS,
        ),
    )
    table_of = network.links.set_index("link_id")
    assert table_of["free_speed"].to_dict() == {"1": 10, "1-reverse": 5, "2": 10, "3": 25}
    assert table_of["lanes"].to_dict() == {"1": 1, "1-reverse": 3, "2": 2, "3": 2}
    assert table_of["capacity"].to_numpy() == pytest.approx([1 / 6, 1 / 2, 1 / 3, 1 / 3])
    assert table_of["merge_priority"].to_dict() == {"1": 1, "1-reverse": 3, "2": 2, "3": 2}


def test_the_second_direction_needs_values_only_where_there_is_one() -> None:
    links = table(oneway=["B", "F", "T"], n2=[None, None, 2])
    given = mapping({"lanes_backward": "n2"}, direction=WAYS)
    (fault,) = faults_of(links, given)
    assert fault.column == "n2 of feature 1"
    links = table(oneway=["F", "F", "T"], n2=[None, None, 2], n=[1, 1, None])
    assert len(network_from_tables(links, given).links) == 3


def test_lanes_of_the_road_are_shared_by_its_directions() -> None:
    links = table(oneway=["B", "B", "F"], n=[2, 3, 3])
    network = network_from_tables(links, mapping(direction=WAYS, lanes_of="road"))
    assert network.links["lanes"].tolist() == [1, 1, 2, 2, 3]
    assert "lanes halved" in topics(network)


def test_ends_within_the_tolerance_meet() -> None:
    ring = [
        [(0, 0), (1000, 0)],
        [(1000.4, 0.3), (1000, 500)],
        [(1000, 499.5), (0, 0)],
        [(1002, 0), (2000, 0)],
    ]
    links = table(ring)
    network = network_from_tables(links, ColumnMapping(PLAIN, tolerance=0.6))
    ends = network.links[["from_node_id", "to_node_id"]].to_numpy().tolist()
    assert ends == [["1", "2"], ["2", "3"], ["3", "1"], ["4", "5"]]
    places = dict(zip(network.nodes["node_id"], network.nodes.geometry, strict=True))
    for link in network.links.itertuples():
        first, last = (shapely.get_point(link.geometry, end) for end in (0, -1))
        assert (first, last) == (places[link.from_node_id], places[link.to_node_id])
    (moved,) = network.notes.loc[network.notes["topic"] == "snapped", "value"]
    assert moved == "2"
    strict = network_from_tables(links, ColumnMapping(PLAIN, tolerance=0))
    assert len(strict.nodes) == 7


def test_the_tolerance_is_in_metres_where_coordinates_are_degrees() -> None:
    # 0.00001 degrees are 1.1 m to the north, but 0.56 m to the east at 60 degrees
    lines = [[(10, 60), (10.01, 60)], [(10.01001, 60), (10.02, 60)], [(10, 60.00001), (10, 60.01)]]
    links = gpd.GeoDataFrame(geometry=[shapely.linestrings(one) for one in lines], crs="EPSG:4326")
    network = network_from_tables(links, ColumnMapping(PLAIN, tolerance=0.7))
    ends = network.links[["from_node_id", "to_node_id"]].to_numpy().tolist()
    assert ends == [["1", "2"], ["2", "3"], ["4", "5"]]
    assert network.links["length"][0] == pytest.approx(111_320 * 0.5 * 0.01, rel=5e-3)


def test_a_chain_of_near_ends_is_told_of() -> None:
    lines = [[(0.8 * place, 0.0), (1000.0, 100.0 * place + 100)] for place in range(4)]
    network = network_from_tables(table(lines), ColumnMapping(PLAIN))
    assert len(network.nodes) == 5
    warned = network.notes[network.notes["severity"] == "warning"]
    assert float(warned["value"].iloc[0]) == pytest.approx(2.4, rel=1e-2)


def test_lines_within_the_tolerance_and_real_loops() -> None:
    lines = [[(0, 0), (0.5, 0)], [(0, 0), (50, 50), (0, 50), (0, 0)]]
    (fault,) = faults_of(table(lines), ColumnMapping(PLAIN))
    assert fault.column == "geometry of feature 1"
    assert "tolerance of 1 m is too large" in fault.what
    network = network_from_tables(table(lines[1:]), ColumnMapping(PLAIN))
    assert "self-loop" in topics(network)


def nodes_table(**columns: list[Any]) -> gpd.GeoDataFrame:
    places = shapely.points(np.array([(0, 0), (1000, 0), (1000, 500)]) + ORIGIN)
    return gpd.GeoDataFrame({"no": [10, 20, 30]} | columns, geometry=places, crs=METRES)


def test_nodes_from_a_table_by_id_with_their_attributes() -> None:
    links = table(a=[10, 20, 30], b=["20", "30", "10"])
    points = nodes_table(taz=["x", None, "z"], light=[1, 0, None], thru=["no", "yes", None])
    network = network_from_tables(
        links,
        mapping(
            {"from_node_id": "a", "to_node_id": "b"},
            nodes={
                "node_id": "no",
                "zone_id": "taz",
                "control": "light",
                "through_traffic": "thru",
            },
        ),
        points,
    )
    check_network(network)
    ends = network.links[["from_node_id", "to_node_id"]].to_numpy().tolist()
    assert ends == [["10", "20"], ["20", "30"], ["30", "10"]]
    assert network.nodes["zone_id"].tolist()[::2] == ["x", "z"]
    assert network.nodes["control"].tolist() == ["signal", "none", "none"]
    assert network.nodes["through_traffic"].tolist() == [False, True, True]


def test_nodes_from_a_table_by_place_in_another_system() -> None:
    points = nodes_table().to_crs("EPSG:4326")
    given = mapping(nodes={"node_id": "no"})
    network = network_from_tables(table(), given, points)
    ends = network.links[["from_node_id", "to_node_id"]].to_numpy().tolist()
    assert ends == [["10", "20"], ["20", "30"], ["30", "10"]]
    assert "reprojected" in topics(network)
    shifted = points.set_geometry(points.geometry.translate(0.001, 0))
    faults = faults_of(table(), given, shifted)
    assert len(faults) == 6
    assert faults[0].column == "geometry of feature 1"
    assert (
        "no node is within 1 m of the first point of the line: the nearest is 7" in faults[0].what
    )


def test_nodes_by_ids_alone_lie_where_they_are_met_first() -> None:
    ring = [RING[0], [(1000, 30), (1000, 500)], RING[2]]
    links = table(ring, a=["p", "q", "r"], b=["q", "r", "p"])
    given = ColumnMapping({**PLAIN, "from_node_id": "a", "to_node_id": "b"})
    network = network_from_tables(links, given)
    assert network.nodes["node_id"].tolist() == ["p", "q", "r"]
    far = network.notes[network.notes["topic"] == "node at several places"]
    assert far["element_id"].tolist() == ["q"]


def test_parts_that_join_are_one_line_and_others_are_not() -> None:
    whole = shapely.multilinestrings([line([(0, 0), (9, 9)]), line([(9, 9), (1000, 0)])])
    links = table()
    shapes = [whole, *links.geometry[1:]]
    network = network_from_tables(links.set_geometry(shapes), mapping())
    assert shapely.get_num_coordinates(network.links.geometry[0]) == 3
    apart = shapely.multilinestrings([line([(0, 0), (9, 9)]), line([(90, 9), (1000, 0)])])
    shapes = [apart, None, shapely.Point(1, 2)]
    faults = faults_of(links.set_geometry(shapes), mapping())
    assert [(fault.column, fault.what) for fault in faults] == [
        ("geometry of feature 2", "needs a line"),
        ("geometry of feature 1", "has parts that do not join into one line"),
        ("geometry of feature 3", "is not a line"),
    ]


@pytest.mark.parametrize(("unit", "rather"), [("m", "km"), ("mi", "km"), ("ft", "km")])
def test_lengths_in_another_unit_than_stated_are_refused(unit: str, rather: str) -> None:
    links = table(km=[1.0, 0.5, 1.12])
    (fault,) = faults_of(links, mapping({"length": Source("km", unit=unit)}))
    assert fault.column == "km"
    assert f"the unit is rather {rather}" in fault.what


def test_missing_lengths_are_those_of_the_lines() -> None:
    links = table(km=[1.0, None, 1.12])
    network = network_from_tables(links, mapping({"length": Source("km", unit="km")}))
    assert network.links["length"].to_numpy() == pytest.approx([1000, 500, 1120], rel=1e-3)
    assumed = network.notes[network.notes["topic"] == "length assumed"]
    assert assumed["element_id"].tolist() == ["2"]


def test_the_reference_system_is_the_tables_or_stated() -> None:
    bare = table(crs=None)
    (fault,) = faults_of(bare, mapping())
    assert "state crs" in fault.what
    assert network_from_tables(bare, mapping(crs=METRES)).links.crs == METRES
    (fault,) = faults_of(bare, mapping(crs="none"))
    assert "lengths must be mapped" in fault.what
    links = table(crs=None, m=[1000, 500, 1120])
    network = network_from_tables(links, mapping({"length": Source("m", unit="m")}, crs="none"))
    assert network.links.crs is None
    (fault,) = faults_of(table(), mapping(crs="EPSG:4326"))
    assert "leave crs out" in fault.what


def test_all_faults_of_both_tables_at_once() -> None:
    links = table(
        vmax=["fast", -1, math.inf],
        n=[1.5, None, 0],
        a=[10, 99, None],
        b=[20, 30, 10],
        oneway=["F", "X", "B"],
        id=["k", "k", ""],
    )
    points = nodes_table(no=[10, 20, 20], light=["red", 0, 1])
    given = mapping(
        {"link_id": "id", "from_node_id": "a", "to_node_id": "b"},
        nodes={"node_id": "no", "control": "light"},
        direction=WAYS,
    )
    found = {(fault.source, fault.column, fault.value) for fault in faults_of(links, given, points)}
    assert found == {
        ("links", "vmax of feature 1", "fast"),
        ("links", "vmax of feature 2", "-1"),
        ("links", "vmax of feature 3", "inf"),
        ("links", "n of feature 1", "1.5"),
        ("links", "n of feature 2", None),
        ("links", "n of feature 3", "0"),
        ("links", "oneway of feature 2", "X"),
        ("links", "id of feature 2", "k"),
        ("links", "id of feature 3", None),
        ("nodes", "no of feature 3", "20"),
        ("nodes", "light of feature 1", "red"),
    }


def test_unknown_nodes_are_named_where_they_stand() -> None:
    links = table(a=[10, 99, None], b=[20, 30, 10])
    given = mapping({"from_node_id": "a", "to_node_id": "b"}, nodes={"node_id": "no"})
    faults = faults_of(links, given, nodes_table())
    assert [(fault.column, fault.value) for fault in faults] == [
        ("a of feature 3", None),
        ("a of feature 2", "99"),
    ]


def test_columns_that_are_not_there_or_twice() -> None:
    twice = table(x=[1, 1, 1])
    twice.columns = ["vmax", "n", "n", "geometry"]
    given = mapping({"capacity": Source("ghost", unit="veh/h")}, keep=("other",), direction=WAYS)
    told = [str(fault) for fault in faults_of(twice, given)]
    assert told == [
        "links, column n: the column stands there more than once",
        "links: lacks the column ghost (columns here: vmax, n, n, geometry)",
        "links: lacks the column oneway (columns here: vmax, n, n, geometry)",
        "links: lacks the column other (columns here: vmax, n, n, geometry)",
    ]
    (fault,) = faults_of(table()[:0], mapping())
    assert fault.what == "there is no row"
    plain = table().drop(columns="geometry")
    (fault,) = faults_of(plain, mapping())
    assert fault.what == "has no geometry"


def test_sources_may_be_written_as_their_fields() -> None:
    written = {"free_speed": {"column": "vmax", "unit": "km/h"}, "lanes": {"constant": 2}}
    network = network_from_tables(table(), ColumnMapping(written))
    assert network.links["free_speed"].tolist() == [10, 10, 20]
    assert network.links["lanes"].tolist() == [2, 2, 2]
    with pytest.raises(InputError) as raised:
        ColumnMapping({"free_speed": {"colum": "vmax"}, "lanes": True, "name": {"units": "m"}})
    assert [(fault.column, fault.what) for fault in raised.value.faults] == [
        ("free_speed", "colum says nothing of a source; did you mean column?"),
        ("lanes", "must be a column, a number or a source"),
        ("name", "units says nothing of a source; did you mean unit?"),
    ]


def test_tables_of_nodes_and_their_mapping_go_together() -> None:
    (fault,) = faults_of(table(), mapping(), nodes_table())
    assert "must name the column of node_id" in fault.what
    (fault,) = faults_of(table(), mapping(nodes={"node_id": "no"}))
    assert "there is no table of points" in fault.what


def test_columns_are_kept_if_asked_for() -> None:
    network = network_from_tables(table(when=["a", None, "c"]), mapping(keep=("when", "n")))
    assert list(network.links.columns)[-2:] == ["file_when", "file_n"]
    assert network.links["file_n"].tolist() == [1, 2, 1]


def test_a_mapping_tells_all_that_is_wrong_with_it() -> None:
    with pytest.raises(InputError) as raised:
        ColumnMapping(
            {
                "lane": "n",
                "free_speed": "vmax",
                "length": Source("l", unit="yard"),
                "capacity": Source(),
                "jam_density": Source("k", unit="veh/h"),
                "lanes": Source("n", unit="m"),
                "merge_priority": -1,
                "from_node_id": "a",
            },
            nodes={"zone_id": "z"},
            direction=Direction("d", forward=("x",), both=("x",)),
            lanes_of="street",  # type: ignore[arg-type]
            tolerance=math.nan,
        )
    found = [
        (fault.column, fault.what.split(":")[0].split(";")[0]) for fault in raised.value.faults
    ]
    assert found == [
        ("lane", "is no column that can be mapped"),
        ("from_node_id", "give both from_node_id and to_node_id, or neither"),
        ("node_id", "is needed"),
        ("free_speed", "the unit of the column vmax must be stated, as m/s"),
        ("length", "is not a unit of length"),
        ("capacity", "must have a column or a constant"),
        ("jam_density", "is not a unit of jam density of one lane"),
        ("lanes", "has no unit"),
        ("merge_priority", "must be a finite number above 0"),
        ("lanes_of", "must be direction or road"),
        ("tolerance", "must be finite, 0 or more"),
        ("direction", "means two directions"),
    ]


POINTS = st.tuples(st.integers(0, 6), st.integers(0, 6))


@settings(deadline=None, max_examples=60)
@given(ends=st.lists(st.tuples(POINTS, POINTS).filter(lambda two: two[0] != two[1]), min_size=1))
def test_lines_on_a_grid_meet_where_their_points_are_equal(
    ends: list[tuple[tuple[int, int], tuple[int, int]]],
) -> None:
    lines = [[(100.0 * x, 100.0 * y) for x, y in pair] for pair in ends]
    network = network_from_tables(table(lines), ColumnMapping(PLAIN))
    numbers: dict[tuple[int, int], str] = {}
    for pair in ends:
        for point in pair:
            numbers.setdefault(point, str(len(numbers) + 1))
    twin = [[numbers[first], numbers[last]] for first, last in ends]
    assert network.links[["from_node_id", "to_node_id"]].to_numpy().tolist() == twin
    assert network.nodes["node_id"].tolist() == list(numbers.values())


def test_metres_are_those_of_the_ground_in_every_system() -> None:
    places = gpd.GeoSeries([shapely.linestrings([(10, 60), (10.01, 60.01)])], crs="EPSG:4326")
    lengths = [
        line_lengths(np.asarray(own), own.crs)[0]
        for own in (places, places.to_crs("EPSG:3857"), places.to_crs(METRES))
    ]
    assert lengths == pytest.approx([lengths[0]] * 3, rel=1e-9)
    # Web Mercator stretches it to twice that
    assert places.to_crs("EPSG:3857").length[0] == pytest.approx(2 * lengths[0], rel=1e-2)
    plane = np.array([[0.0, 0.0], [3.0, 4.0]])
    assert distances(plane[:1], plane[1:], None).tolist() == [5.0]

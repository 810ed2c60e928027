"""Which links are meant by ids, conditions and areas, and what is said where none can be."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from small_networks import link, network

from uxsim_geo.control.site import Target
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.network.selection import select_links

PLAIN = network(
    [
        link("a1", "1", "2", lanes=2, name="High Street", toll_road=True, width=7.0),
        link("a2", "2", "3", lanes=3, name=None, toll_road=False, width=np.nan),
        link("b1", "3", "4", lanes=1, name="Mill Lane", toll_road=False, width=3.5),
        link("b2", "4", "5", lanes=2, name="High Street", toll_road=None, width=10.5),
    ]
)

# a square of 100 m with its corner at x, y = 1000, 2000, and links round and in it
SQUARE = box(1000, 2000, 1100, 2100)
LINES = {
    "within": [(1010, 2010), (1090, 2090)],
    "into": [(900, 2050), (1050, 2050)],
    "out": [(1050, 2050), (900, 2050)],
    "across": [(900, 2050), (1200, 2050)],
    "away": [(0, 0), (500, 0)],
    "loop": [(1050, 2050), (1200, 2050), (1050, 2090)],
    "to_border": [(900, 2000), (1000, 2000)],
}


def mapped(crs: str | None = "EPSG:25832") -> Network:
    plain = network([link(name, f"{name}0", f"{name}1") for name in LINES])
    lines = gpd.GeoDataFrame(
        plain.links, geometry=[LineString(line) for line in LINES.values()], crs=crs
    )
    return Network(plain.nodes, lines)


def ids(network: Network, target: Target) -> list[str]:
    return network.links["link_id"].iloc[select_links(network, target)].tolist()


def test_a_street_is_all_links_of_its_name_joined_ones_too() -> None:
    assert ids(PLAIN, Target(street="High Street")) == ["a1", "b2"]
    assert ids(PLAIN, Target(street="High Street", where="lanes == 2 and width < 8")) == ["a1"]
    joined = PLAIN.links.assign(name=["High Street; Mill Lane", None, "Mill Lane", "Mill Lane 2"])
    held = Network(PLAIN.nodes, joined.set_index(pd.Index([7, 3, 5, 1])))
    assert ids(held, Target(street="Mill Lane")) == ["a1", "b1"]
    assert "did you mean Mill Lane or Mill Lane 2?" in refusal(held, Target(street="Mil Lane"))
    nameless = Network(PLAIN.nodes, PLAIN.links.drop(columns="name"))
    assert "have no names" in refusal(nameless, Target(street="Mill Lane"))


def refusal(network: Network, target: Target) -> str:
    with pytest.raises(InputError) as error:
        select_links(network, target)
    return str(error.value)


@pytest.mark.parametrize(
    ("where", "text", "near"),
    [
        ("name == 'Hihg Street'", "Hihg Street", "; did you mean High Street?"),
        ("lanes >= 2 and name in ['mill lane', 'High Street']", "mill lane", None),
        ("'MILL LANE' == name", "MILL LANE", "; did you mean Mill Lane?"),
        ("name in ['mill lane', 'nowhere']", "mill lane", "; did you mean Mill Lane?"),
        ("name == 'Zzz'", "Zzz", ""),
    ],
)
def test_a_street_that_is_not_there_is_told_with_those_near(
    where: str, text: str, near: str | None
) -> None:
    if near is None:  # some link is meant
        assert ids(PLAIN, Target(where=where)) == ["a1", "b2"]
    else:
        assert f"no link has this name{near} (found '{text}')" in refusal(
            PLAIN, Target(where=where)
        )


def test_ids_give_rows_in_the_order_of_the_table() -> None:
    rows = select_links(PLAIN, Target(links=("b2", "a1", "b2")))
    assert rows.tolist() == [0, 3]
    assert rows.dtype == np.int64


def test_unknown_ids_are_named_with_those_nearest_to_them() -> None:
    text = refusal(mapped(), Target(links=("into", "acros", "42"), where="lames > 1"))
    assert "did you mean across? (found 'acros')" in text
    assert "no such link_id (found '42')" in text
    assert "did you mean lanes" in text


@pytest.mark.parametrize(
    ("where", "meant"),
    [
        ("lanes == 2", "a1 b2"),
        ("lanes >= 2 and name == 'High Street'", "a1 b2"),
        ("1 < lanes <= 2", "a1 b2"),
        ("1 < lanes < width / 2", "a1 b2"),
        ("lanes != 2 or link_id == 'a1'", "a1 a2 b1"),
        ("not (lanes == 2)", "a2 b1"),
        ("link_id in ['a1', 'b1']", "a1 b1"),
        ("link_id not in ('a1', 'b1')", "a2 b2"),
        ("lanes in [1, 3]", "a2 b1"),
        ("toll_road", "a1"),
        ("not toll_road", "a2 b1 b2"),
        ("toll_road == False", "a2 b1"),
        ("length * lanes / 1000 - 1 == 2", "a2"),
        ("-lanes < -2", "a2"),
        ("free_speed == 20.0 and True", "a1 a2 b1 b2"),
    ],
)
def test_conditions_hold_where_they_should(where: str, meant: str) -> None:
    assert ids(PLAIN, Target(where=where)) == meant.split()


@pytest.mark.parametrize(
    ("where", "meant"),
    [
        ("name == 'High Street'", "a1 b2"),
        ("name != 'High Street'", "b1"),
        ("name not in ['High Street']", "b1"),
        ("name == None", "a2"),
        ("name is not None", "a1 b1 b2"),
        ("width > 0", "a1 b1 b2"),
        ("width + 1 != 8", "b1 b2"),
        ("1 / (lanes - 1) < 1e9", "a1 a2 b2"),
        ("capacity > 0", ""),
        ("capacity == None", "a1 a2 b1 b2"),
    ],
)
def test_no_comparison_holds_with_a_missing_value(where: str, meant: str) -> None:
    assert ids(PLAIN, Target(where=where)) == meant.split()


def test_kinds_of_columns_do_not_hang_on_how_pandas_holds_them() -> None:
    links = PLAIN.links.assign(
        name=PLAIN.links["name"].astype("category"),
        lanes=PLAIN.links["lanes"].astype("Int64"),
        toll_road=PLAIN.links["toll_road"].astype("boolean"),
        width=PLAIN.links["width"].astype("float32"),
    )
    held = Network(PLAIN.nodes, links)
    for where in ("name != 'High Street'", "lanes == 2", "not toll_road", "width <= 7"):
        assert ids(held, Target(where=where)) == ids(PLAIN, Target(where=where))


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("laness > 1", "no such column: did you mean lanes"),
        ("lanes == '2'", "lanes is a number, '2' is a text"),
        ("link_id == 7", "link_id is a text, 7 is a number"),
        ("link_id in ['a1', 7]", "link_id is a text, 7 is a number"),
        ("toll_road == 1", "toll_road is a truth, 1 is a number"),
        ("name < 'b'", "only numbers have an order"),
        ("name + 'b' == 'ab'", "is a text, no number to reckon with (found 'name')"),
        ("lanes", "must be a condition"),
        ("lanes and toll_road", "is a number, no condition: compare it (found 'lanes')"),
        ("lanes = 2", "cannot be read at character 7"),
        ("", "cannot be read"),
        ("name in 'High Street'", "in wants a list"),
        ("[1, 2] == lanes", "a list is understood after in only"),
        ("__import__('os').remove('x')", "is not understood"),
        ("name.size > 0", "is not understood"),
        ("lanes[0] == 1", "is not understood"),
        ("(lambda: 1) == 1", "is not understood"),
        ("lanes ** 9 > 1", "is not understood"),
        ("f'{lanes}' == 'a'", "is not understood"),
        ("lanes == 1j", "is no text, number, True, False or None"),
        (f"lanes == {'9' * 400}", "is no text, number, True, False or None"),
        ("lanes == 1" + " or lanes == 1" * 200, "longer than"),
        ("-" * 500 + "1 == lanes", "nested too deeply"),
        ("(" * 300 + "lanes" + ")" * 300 + " == 1", "cannot be read"),
        ("lanes == 1\0", "cannot be read"),
    ],
)
def test_what_is_no_condition_on_the_columns_is_refused(where: str, message: str) -> None:
    assert message in refusal(PLAIN, Target(where=where))


def test_all_faults_of_a_condition_are_told_at_once() -> None:
    text = refusal(PLAIN, Target(where="lames == 1 or wide > 3 and f(lanes)"))
    for part in ("'lames'", "'wide'", "f(lanes)"):
        assert part in text


@pytest.mark.parametrize(
    ("part", "meant"),
    [
        ("touching", "within into out across loop to_border"),
        ("inside", "within"),
        ("entering", "into to_border"),
        ("leaving", "out"),
    ],
)
@pytest.mark.parametrize("suffix", ["wkt", "geojson", "gpkg"])
def test_areas_in_text_and_files_mean_the_same_links(
    part: str, meant: str, suffix: str, tmp_path: Path
) -> None:
    polygon = SQUARE.wkt
    if suffix != "wkt":
        path = tmp_path / f"area.{suffix}"
        gpd.GeoDataFrame(geometry=[SQUARE], crs="EPSG:25832").to_file(path)
        polygon = str(path)
    target = Target(polygon=polygon, part=part)
    assert ids(mapped(), target) == meant.split()


def test_an_area_in_another_reference_system_is_converted(tmp_path: Path) -> None:
    path = tmp_path / "area.geojson"
    wide = gpd.GeoSeries([SQUARE.buffer(1, join_style="mitre")], crs="EPSG:25832")
    wide.to_crs("EPSG:4326").to_file(path)
    assert ids(mapped(), Target(polygon=str(path), part="inside")) == ["within"]


def test_all_polygons_of_a_file_count_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "areas.gpkg"
    shapes: list[BaseGeometry] = [MultiPolygon([SQUARE]), Point(1, 1)]
    gpd.GeoDataFrame(geometry=shapes, crs="EPSG:25832").to_file(path, layer="first")
    more = gpd.GeoDataFrame(geometry=[box(-10, -10, 600, 10)], crs="EPSG:25832")
    more.to_file(path, layer="second")
    assert ids(mapped(), Target(polygon=str(path), part="inside")) == ["within", "away"]


def test_what_a_target_gives_holds_together() -> None:
    target = Target(("into", "away", "out"), "link_id != 'out'", SQUARE.wkt)
    assert ids(mapped(), target) == ["into"]
    assert ids(mapped(), Target(("away",), polygon=SQUARE.wkt)) == []


def test_text_needs_no_reference_system() -> None:
    assert ids(mapped(None), Target(polygon=SQUARE.wkt, part="inside")) == ["within"]


def test_links_without_a_line_lie_in_no_area() -> None:
    whole = mapped()
    lines = whole.links.copy()
    lines.loc[lines["link_id"].isin(["into", "within"]), "geometry"] = None
    bare = Network(whole.nodes, lines)
    assert ids(bare, Target(polygon=SQUARE.wkt, part="entering")) == ["to_border"]
    assert ids(bare, Target(polygon=SQUARE.wkt, part="inside")) == []


def test_areas_that_are_none_are_refused(tmp_path: Path) -> None:
    knot = Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]).wkt
    points = tmp_path / "points.geojson"
    gpd.GeoDataFrame(geometry=[Point(0, 0)], crs="EPSG:4326").to_file(points)
    broken = tmp_path / "broken.geojson"
    broken.write_text("{", encoding="utf-8")
    for polygon, message in (
        ("LINESTRING (0 0, 1 1)", "must be a POLYGON or MULTIPOLYGON"),
        ("POLYGON EMPTY", "must be a POLYGON or MULTIPOLYGON"),
        ("POLYGON ((0 0, 1 1", "is no WKT"),
        (knot, "is no valid polygon (Self-intersection"),
        ("nowhere.gpkg", "is neither WKT nor a file that is there"),
        (str(points), "holds no polygon"),
        (str(broken), "cannot be read as a table"),
    ):
        assert message in refusal(mapped(), Target(polygon=polygon)), polygon


def test_reference_systems_that_are_not_known_are_refused(tmp_path: Path) -> None:
    path, bare = tmp_path / "area.gpkg", tmp_path / "bare.gpkg"
    area = gpd.GeoDataFrame(geometry=[SQUARE], crs="EPSG:25832")
    area.to_file(path)
    with pytest.warns(UserWarning, match="crs"):
        area.set_crs(None, allow_override=True).to_file(bare)
    assert "WKT in the network's" in refusal(mapped(None), Target(polygon=str(path)))
    assert "does not say its reference system" in refusal(mapped(), Target(polygon=str(bare)))
    assert "has no coordinates" in refusal(PLAIN, Target(polygon=SQUARE.wkt))


def test_targets_that_say_nothing_or_half_are_refused() -> None:
    assert "give links, where, polygon or street" in refusal(PLAIN, Target())
    assert "is part of a polygon" in refusal(PLAIN, Target(("a1",), part="inside"))
    odd = Target(polygon=SQUARE.wkt, part="near")  # type: ignore[arg-type]
    assert "must be one of touching" in refusal(mapped(), odd)


def test_ids_that_are_numbers_in_the_table_are_found_as_texts() -> None:
    links = pd.DataFrame(PLAIN.links).assign(link_id=[10, 11, 12, 13])
    assert select_links(Network(PLAIN.nodes, links), Target(("12",))).tolist() == [2]

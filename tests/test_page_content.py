"""The numbers and texts in the page are those of the run; a plain reader finds them again."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from page_parts import codes, document, lines, part, states
from small_networks import across, demand, grid, link, network

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.od_table import no_notes
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.export.findings import Findings
from uxsim_geo.export.layers import LinkTimes
from uxsim_geo.export.od_layer import od_lines_layer
from uxsim_geo.export.page import libraries
from uxsim_geo.export.page.levels import first_of_merged, levels
from uxsim_geo.export.page.page import Run, page, write_page
from uxsim_geo.export.page.quantities import quantities
from uxsim_geo.export.page.rows import fact_rows
from uxsim_geo.export.page.zones import zones
from uxsim_geo.export.run_description import Change, RunDescription
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.space_time.scene import space_time_scene
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

ABOUT = RunDescription(datetime(2026, 3, 4, 7, 30, tzinfo=UTC), no_notes(), {}, name="a test")
BIN = 300.0


def test_what_rounding_leaves_makes_no_classes() -> None:
    some = {"volume": np.array([300.0]), "density": np.array([9.0]), "queue": np.array([50.0])}
    delay = np.concatenate([np.full(900, 3e-15), np.linspace(0.1, 4.0, 100)])
    (told,) = (one for one in quantities(some | {"delay": delay}) if one.key == "delay")
    assert told.breaks[0] >= 1.0


def run_of(roads: Network, trips: Demand, duration: float = 3000.0) -> Run:
    result = simulate(roads, trips, Settings(duration, 5))
    return Run(roads, result, link_times(result, roads, bin_s=BIN))


@pytest.fixture(scope="module")
def busy() -> Run:
    """Streets crossed by more vehicles than they can take."""
    return run_of(network(grid(4)), across(4, 60.0, 1500.0))


def table_of(run: Run, name: str) -> np.ndarray:
    return run.states[name].to_numpy(float).reshape(len(run.network.links), -1)


def test_states_of_links_are_told_within_a_thousandth(busy: Run) -> None:
    text = page(busy, ABOUT)
    told = states(text)
    assert (table_of(busy, "queue") > 0).any()
    np.testing.assert_allclose(told["density"], table_of(busy, "density"), rtol=1e-3)
    np.testing.assert_allclose(told["speed"], table_of(busy, "speed"), atol=1e-3)
    np.testing.assert_allclose(told["queue"], table_of(busy, "queue_length"), atol=0.06)
    # what the scripts derive: flow, and delay as Edie's time times what is missing of free speed
    flow = told["density"] * np.nan_to_num(told["speed"])
    np.testing.assert_allclose(flow, table_of(busy, "flow"), rtol=2e-3, atol=1e-6)
    delay = told["density"] * 300.0 * BIN * (1 - np.nan_to_num(told["speed"]) / 20.0)
    np.testing.assert_allclose(delay, table_of(busy, "delay"), rtol=2e-3, atol=1.0)


def test_many_cells_take_a_byte_each(busy: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("uxsim_geo.export.page.levels.MOST_FINE_CELLS", 10)
    text = page(busy, ABOUT)
    assert len(part(text, "density")) == len(busy.states)
    np.testing.assert_allclose(states(text)["density"], table_of(busy, "density"), rtol=0.03)


def test_merged_bins_hold_the_same_time_and_distance(busy: Run) -> None:
    cells = StateGrid.of(busy.states)
    first = first_of_merged(cells, most_cells=3 * len(busy.states) // 10)
    assert len(first) == 3
    merged = levels(cells, busy.network, first)
    assert merged.edges.tolist() == [0.0, 1200.0, 2400.0, 3000.0]
    share = (merged.density.astype(float) - 1) / (merged.top - 1)
    density = merged.least * (merged.largest / merged.least) ** share
    time = np.where(merged.density > 0, density, 0.0) * 300.0 * np.diff(merged.edges)
    whole = table_of(busy, "time").sum()
    assert time.sum() == pytest.approx(whole, rel=1e-3)
    distance = (time * merged.speed / merged.top * 20.0).sum()
    assert distance == pytest.approx(table_of(busy, "distance").sum(), rel=1e-3)


def test_the_network_over_time_is_that_of_the_tables(busy: Run) -> None:
    told = document(page(busy, ABOUT))["network"]
    table = network_states(busy.states, busy.network)
    lanes = (busy.network.links["length"] * busy.network.links["lanes"]).sum()
    assert told["accumulation"] == pytest.approx((table["density"] * lanes).tolist(), abs=1e-3)
    production = table["flow"] * lanes * 3.6
    assert told["production"] == pytest.approx(production.tolist(), abs=1e-2)
    speed = [np.nan if value is None else value for value in told["speed"]]
    assert speed == pytest.approx((3.6 * table["speed"]).tolist(), abs=1e-2, nan_ok=True)
    arrived = sum(told["arrivals"]) * BIN / 3600
    done = busy.result.trips[busy.result.trips["status"] == "completed"]["vehicles"].sum()
    assert arrived == pytest.approx(done, abs=0.1)
    left = busy.result.trips["status"].isin(["running", "waiting"])
    assert told["running"][-1] + told["waiting"][-1] == busy.result.trips[left]["vehicles"].sum()


def test_lines_lie_where_the_network_has_them() -> None:
    bent = shapely.LineString([(8.6, 49.4), (8.61, 49.42), (8.65, 49.41)])
    back = shapely.LineString([(8.65, 49.41), (8.6, 49.4)])
    roads = network([link("a", "1", "2"), link("b", "2", "1")])
    points = shapely.points([(8.6, 49.4), (8.65, 49.41)])
    for crs in ("EPSG:4326", "EPSG:32632"):
        line = gpd.GeoSeries([bent, back], crs="EPSG:4326").to_crs(crs)
        node = gpd.GeoSeries(points, crs="EPSG:4326").to_crs(crs)
        mapped = Network(
            gpd.GeoDataFrame(roads.nodes, geometry=node),
            gpd.GeoDataFrame(roads.links, geometry=line),
        )
        text = page(run_of(mapped, demand(("1", "2", 0.0, 600.0, 50.0))), ABOUT)
        assert document(text)["map"]["on_earth"] is True
        for told, given in zip(lines(text), (bent, back), strict=True):
            np.testing.assert_allclose(told, shapely.get_coordinates(given), atol=6e-6)


def test_a_network_without_a_place_keeps_its_shape_and_claims_none() -> None:
    roads = network([link("a", "1", "2"), link("b", "2", "3")])
    path = [shapely.LineString([(0, 0), (300, 0)]), shapely.LineString([(300, 0), (300, 100)])]
    nodes = gpd.GeoDataFrame(roads.nodes, geometry=shapely.points([(0, 0), (300, 0), (300, 100)]))
    plane = Network(nodes, gpd.GeoDataFrame(roads.links, geometry=path))
    for mapped, ratio in ((plane, 1 / 3), (roads, 1.0)):
        text = page(run_of(mapped, demand(("1", "3", 0.0, 600.0, 50.0))), ABOUT)
        assert document(text)["map"]["on_earth"] is False
        lengths = [np.hypot(*(line[-1] - line[0])) for line in lines(text)]
        assert lengths[1] / lengths[0] == pytest.approx(ratio, rel=1e-2)


def test_the_worst_street_is_that_before_the_bottleneck() -> None:
    roads = network(
        [
            link("in", "1", "2", name="High Street"),
            link("on", "2", "3", name="High Street"),
            link("narrow", "3", "4", capacity=0.2, name="Lane"),
        ]
    )
    # 1 veh/s comes, 0.8 veh/s can, 0.2 veh/s passes the narrow link: the queue is before it
    run = run_of(roads, demand(("1", "4", 0.0, 900.0, 900.0)))
    text = page(run, ABOUT)
    content = document(text)
    worst = content["worst"][0]
    assert content["links"]["names"][content["links"]["name"][worst["link"]]] == "High Street"
    delay = table_of(run, "delay")
    assert worst["link"] == delay.sum(axis=1).argmax()
    assert worst["bin"] == delay[:2].sum(axis=0).argmax()
    share = 100 * delay[:2].sum() / delay.sum()
    assert f"most was lost on High Street ({share:.0f} %)" in text
    ends = [content["junctions"]["links"][row] for row in range(3)]
    assert ends[1] >= 0
    assert content["junctions"]["largest_min"] == pytest.approx(delay[1].max() / 60)


def test_nobody_on_the_road_makes_a_page_too() -> None:
    roads = network([link("a", "1", "2")])
    text = page(run_of(roads, demand(("1", "2", 4000.0, 4100.0, 50.0))), ABOUT)
    assert "Nobody lost time on the links." in text
    assert (codes(text, "density") == 0).all()


def test_means_and_ends_of_the_worst_bin_are_told_apart(busy: Run) -> None:
    told = html.unescape(page(busy, ABOUT))
    lost = table_of(busy, "delay").sum(axis=0)
    worst = int(lost.argmax())
    end = ABOUT.start + timedelta(seconds=BIN * (worst + 1))
    mean = table_of(busy, "time").sum(axis=0)[worst] / BIN
    queued = table_of(busy, "queue").sum(axis=0)[worst]
    assert f"on average {mean:,.0f} vehicles were on the road in that time" in told
    assert f"At {end:%H:%M}, {queued:,.0f} of the" in told


def test_what_was_closed_is_told_with_its_time_and_place(busy: Run) -> None:
    changes = [
        Change("closed", "Lane <b> (link 3)", 600.0, 900.0),
        Change("1 lane blocked", "link 5", 300.0, np.inf),
        Change("toll of 2", "links 1, 2", 0.0, np.inf),
        Change("toll of 3", "links 1, 2", 0.0, 9000.0),
    ]
    text = page(busy, replace(ABOUT, changes=changes))
    told = re.findall("<li>(.*?)</li>", text[text.index("What was closed") :])
    assert told == [
        "The whole time: toll of 2, links 1, 2.",
        "The whole time: toll of 3, links 1, 2.",
        "From 07:35 on: 1 lane blocked, link 5.",
        "07:40–07:45: closed, Lane &lt;b&gt; (link 3).",
    ]
    many = page(busy, replace(ABOUT, changes=changes * 5))
    assert "And 12 more; config.yaml of the run has them all." in many
    assert "What was closed" not in page(busy, ABOUT)


def test_sheet_page_and_picture_tell_of_the_same_streets(busy: Run) -> None:
    links = busy.network.links.assign(ref=[f"B {row % 7}" for row in range(48)])
    nodes = gpd.GeoDataFrame(
        busy.network.nodes,
        geometry=[shapely.Point(*map(float, i.split(","))) for i in busy.network.nodes["node_id"]],
    )
    at = dict(zip(nodes["node_id"], nodes.geometry, strict=True))
    ends = zip(links["from_node_id"], links["to_node_id"], strict=True)
    lines = [shapely.LineString([at[a], at[b]]) for a, b in ends]
    roads = Network(nodes, gpd.GeoDataFrame(links, geometry=lines))
    run = Run(roads, busy.result, busy.states)
    times = LinkTimes.of(roads, busy.states, ABOUT.origin)
    table = links[["link_id", "ref"]].assign(name=None, queue_m=0.0)
    lost = Findings.of({"links": table, "link_times": times}).lost
    text = html.unescape(page(run, ABOUT))
    names = re.findall(r'data-worst="\d+">(.*?)</button>', text)
    amounts = re.findall(r'<td class="number">([\d.,]+ veh·\w+)</td>', text)
    assert len(names) > 3
    assert set(names) <= {f"B {number}" for number in range(7)}
    streets = lost.streets(20)
    assert [street.name for street in streets] == names
    assert [lost.unit.text(street.lost) for street in streets] == amounts
    assert [street.bin for street in streets] == [one["bin"] for one in document(text)["worst"]]
    notes = space_time_scene(roads, busy.states, Look(start=ABOUT.start))["notes"][1:]
    whens = re.findall(r'<td class="when">(.*?)</td>', text)
    wanted = zip(names, amounts, whens, strict=True)
    for number, (note, (name, amount, when)) in enumerate(zip(notes, wanted, strict=False), 1):
        assert note.startswith(f"{number}  {name}: {amount}, {when} at ")


def test_traffic_on_the_left_is_drawn_there(busy: Run) -> None:
    assert document(page(busy, replace(ABOUT, driving_side="left")))["map"]["left"] is True
    assert document(page(busy, ABOUT))["map"]["left"] is False


def test_the_same_run_gives_the_same_page_in_one_piece(busy: Run, tmp_path) -> None:
    path = tmp_path / "report.html"
    write_page(path, busy, ABOUT)
    text = path.read_text(encoding="utf-8")
    assert text == page(busy, ABOUT)
    assert [entry.name for entry in tmp_path.iterdir()] == ["report.html"]
    own = text[text.index("</style>") :]
    assert not [tag for tag in ("<link", "<iframe", ' src="', "@import") if tag in own]


def test_states_of_some_links_are_refused(busy: Run) -> None:
    some = link_times(busy.result, busy.network, bin_s=BIN, links=["0,0-0,1"])
    with pytest.raises(InputError, match="all links"):
        page(Run(busy.network, busy.result, some), ABOUT)


def test_classes_ascend_and_are_round() -> None:
    values = {
        "volume": np.geomspace(1, 4000, 500),
        "density": np.full(50, 3.0),
        "delay": np.zeros(4),
        "queue": np.array([0.0, 7.3]),
    }
    for quantity in quantities(values):
        assert len(quantity.breaks) == 4
        assert list(quantity.breaks) == sorted(set(quantity.breaks))
        sizes = (quantity.labels, quantity.colours, quantity.colours_on_dark)
        assert [len(one) for one in sizes] == [5, 5, 5]
        assert all(float(f"{value:.2g}") == pytest.approx(value) for value in quantity.breaks)


def test_trips_of_many_nodes_are_put_together_in_squares() -> None:
    # a square of 13 × 13 nodes, 100 m apart: sides of 200 m leave 7 × 7 squares, of 100 m all
    names = [f"{i},{j}" for i in range(13) for j in range(13)]
    places = np.array([[i * 100.0 + 10, j * 100.0 + 10] for i in range(13) for j in range(13)])
    table = pd.DataFrame({"node_id": names})
    nodes = gpd.GeoDataFrame(table, geometry=shapely.points(places), crs="EPSG:25832")
    line = shapely.LineString([(0, 0), (1, 1)])
    roads = Network(nodes, gpd.GeoDataFrame({"a": [1]}, geometry=[line], crs="EPSG:25832"))
    od = pd.DataFrame(
        {
            "origin": names,
            "destination": names[::-1],
            "vehicles_demanded": 2.0,
            "vehicles_departed": 2.0,
            "vehicles_completed": 2.0,
            "vehicles_unfinished": 0.0,
            "vehicles_aborted": 0.0,
            "travel_time_so_far_s": 100.0,
            "total_delay_so_far_veh_s": 60.0,
        }
    )
    found = zones(roads, places, od)
    assert found.kind == "squares of 200 m, A1 in the south-west"
    assert len(found.names) == 49
    assert found.points[found.names.index("A1")].tolist() == pytest.approx([60.0, 60.0])
    assert found.points[found.names.index("G1")].tolist() == pytest.approx([1210.0, 60.0])
    assert found.vehicles.sum() == 2.0 * len(names)
    assert found.delay.tolist() == pytest.approx([30.0] * len(found.delay))
    # the layer has the same ends, names and sums
    layer = od_lines_layer(roads, od)
    assert set(layer["cell_m"]) == {200.0}
    told = {(found.names[a], found.names[b]) for a, b in zip(*found[3:5], strict=True)}
    assert told == set(zip(layer["origin"], layer["destination"], strict=True))
    few = zones(roads, places, od.head(20))
    assert few.kind == "nodes"
    zoned = replace(roads, nodes=nodes.assign(zone_id=[name[0] for name in names]))
    by_zone = zones(zoned, places, od)
    assert by_zone.kind == "zones of the network"
    assert set(od_lines_layer(zoned, od)["origin"]) == set(by_zone.names)


def test_a_fact_that_is_empty_says_so() -> None:
    facts = {"classes": "", "total_delay_veh_s": 1234.5, "gridlocked": False}
    told = {"classes": "none", "total delay veh s": "1,234", "gridlocked": "no"}
    assert fact_rows(facts) == told


def test_without_the_library_the_message_says_what_to_install(
    busy: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "maplibregl" in libraries.maplibre().script
    assert ".maplibregl-map" in libraries.maplibre().style
    monkeypatch.setattr(libraries, "PACKAGE", "no_such_package_at_all")
    with pytest.raises(RuntimeError, match="MapLibre GL JS was not found"):
        page(busy, ABOUT)


def test_the_library_has_nothing_that_ends_its_tag_or_asks_for_files() -> None:
    library = libraries.maplibre()
    assert "</script" not in library.script.lower()
    assert "</style" not in library.style.lower()
    assert "sourceMappingURL" not in library.script[-200:]

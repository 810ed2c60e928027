"""The page in a browser without a network: it draws, moves in time and answers mouse and keys."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from itertools import pairwise
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from chromium import Tab, opened
from small_networks import demand, link, network

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.page.inline import explore
from uxsim_geo.export.page.page import Run, write_page
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

#: what must come out as text, and does harm as anything else
EVIL = (
    "</script><script>window.harm = 1</script>",
    "<img src=x onerror='window.harm = 1'>",
    'O\'Neill "Straße" & Søn; DROP TABLE links; --',
    "日本 🚗\u2028\u2029{{ harm }}",
)

LINK = "document.querySelector('#details h3').textContent"
SHOWN = "document.documentElement.dataset.shown"


def roads() -> Network:
    """One-way streets in a row with a narrow end, somewhere on the earth."""
    rows = [link(f"id {name}", str(i), str(i + 1), name=name) for i, name in enumerate(EVIL)]
    rows[-1]["capacity"] = 0.3
    table = network(rows)
    places = [(8.68 + 0.005 * i, 49.4) for i in range(5)]
    lines = [shapely.LineString(places[i : i + 2]) for i in range(4)]
    nodes = gpd.GeoDataFrame(table.nodes, geometry=shapely.points(places), crs="EPSG:4326")
    links = gpd.GeoDataFrame(table.links, geometry=lines, crs="EPSG:4326")
    note = ("link", EVIL[1], EVIL[0], "warning", EVIL[2], EVIL[3])
    notes = pd.DataFrame([note], columns=table.notes.columns, dtype="str")
    return replace(table, nodes=nodes, links=links, notes=notes)


def write_report(path: Path) -> Path:
    """The page of a run on those streets."""
    streets = roads()
    result = simulate(streets, demand(("0", "4", 0.0, 1200.0, 600.0)), Settings(2400.0, 5))
    run = Run(streets, result, link_times(result, streets, bin_s=300.0))
    start = datetime(2026, 3, 4, 7, 30, tzinfo=timezone(timedelta(hours=1)))
    facts = {"seed": 7, "remark": EVIL[1]}
    about = RunDescription(start, streets.notes, facts, EVIL[0], attribution=EVIL[2])
    write_page(path, run, about)
    return path


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    folder = tmp_path_factory.mktemp("page")
    with opened(folder / "profile") as found:
        found.size(1280, 900)
        found.open(write_report(folder / "report.html"))
        yield found
    shutil.rmtree(folder / "profile", ignore_errors=True)


def move_to(tab: Tab, step: int) -> None:
    """Move the slider as a hand would, and wait for the map."""
    tab.run(
        f"slider.value = {step}; slider.dispatchEvent(new Event('input')); slider.blur(); "
        "scrollTo(0, 0)"
    )
    tab.wait_for(f"{SHOWN}.endsWith(' {step}')")


def place_of(tab: Tab, number: int) -> tuple[float, float]:
    """Where a link is drawn in the window: beside the middle of its line."""
    x, y = tab.run(
        "(() => { const { map, run } = trafficReport; const box = "
        "document.getElementById('map').getBoundingClientRect(); "
        f"const at = map.map.project(RoadMap.middle(run.lines[{number}])); "
        "return [box.left + at.x - 40, box.top + at.y + map.gap + map.wide / 2]; })()"
    )
    return float(x), float(y)


def test_it_opens_without_a_complaint_and_asks_nobody(tab: Tab) -> None:
    assert tab.run("trafficReport.map.map.loaded()") is True
    assert tab.run("document.querySelector('#trouble').hidden") is True
    assert tab.complaints == []
    schemes = {url.partition(":")[0] for url in tab.requests}
    assert schemes <= {"file", "data", "blob"}
    assert sum(url.startswith("file:") for url in tab.requests) == 1


def test_the_slider_shows_the_links_of_its_step(tab: Tab) -> None:
    for step in (0, 7, 3):
        move_to(tab, step)
        assert tab.run("document.querySelector('#clock').textContent") == (
            f"{7 + (30 + 5 * step) // 60:02}:{(30 + 5 * step) % 60:02}–"
            f"{7 + (35 + 5 * step) // 60:02}:{(35 + 5 * step) % 60:02}"
        )
        told = tab.run(
            "trafficReport.run.lines.map((_, link) => [trafficReport.run.isUsed(link, "
            f"{step}), trafficReport.map.map.getFeatureState({{source: 'links', id: link}})"
            ".width > 0])"
        )
        assert [used for used, _ in told] == [drawn for _, drawn in told]
    assert tab.run("slider.getAttribute('aria-valuetext')") == "07:45–07:50"


def test_keys_move_in_time_and_play(tab: Tab) -> None:
    move_to(tab, 0)
    tab.run("document.activeElement.blur()")
    tab.key("ArrowRight", code=39)
    tab.wait_for(f"{SHOWN} === 'speed 1'")
    tab.key("ArrowLeft", code=37)
    tab.wait_for(f"{SHOWN} === 'speed 0'")
    tab.key(" ", " ", 32)
    tab.wait_for(f"{SHOWN} === 'speed 2'")
    tab.key(" ", " ", 32)
    assert tab.run("play.getAttribute('aria-pressed')") == "false"
    # the slider's own keys move it once, not twice
    move_to(tab, 3)
    tab.run("slider.focus()")
    tab.key("ArrowRight", code=39)
    tab.wait_for(f"{SHOWN} === 'speed 4'")


def test_tab_reaches_all_that_can_be_used(tab: Tab) -> None:
    tab.run("document.activeElement.blur(); scrollTo(0, 0)")
    reached = set()
    for _ in range(30):
        tab.key("Tab", code=9)
        reached.add(tab.run("document.activeElement.id || document.activeElement.className"))
    wanted = {"maplibregl-canvas", "back", "play", "forth", "slider", "search", "zone", "direction"}
    assert wanted <= reached
    nameless = tab.run(
        "[...document.querySelectorAll('button, input, select')].filter((one) => "
        "!one.labels?.length && !one.getAttribute('aria-label') && !one.textContent.trim()).length"
    )
    assert nameless == 0


def test_hover_and_click_tell_of_the_link(tab: Tab) -> None:
    move_to(tab, 3)
    x, y = place_of(tab, 2)
    tab.mouse("move", x, y - 120)
    tab.mouse("move", x, y)
    tab.wait_for("!document.querySelector('#hover').hidden")
    text = tab.run("document.querySelector('#hover').textContent")
    assert EVIL[2] in text
    assert "veh/h" in text
    tab.mouse("click", x, y)
    tab.wait_for(f"document.querySelector('#details h3') && {LINK} !== ''")
    assert tab.run(LINK) == EVIL[2]
    assert tab.run("document.querySelectorAll('#details svg').length") == 4
    tab.mouse("move", x, y - 120)
    tab.wait_for("document.querySelector('#hover').hidden")


@pytest.mark.parametrize("name", EVIL)
def test_search_finds_a_street_by_any_name(tab: Tab, name: str) -> None:
    # fields of one line drop the separators of lines
    typed = name.replace("\u2028", "").replace("\u2029", "") if "🚗" not in name else "🚗"
    tab.run("search.value = ''; search.focus()")
    tab.call("Input.insertText", text=typed)
    tab.key("Enter", "\r", 13)
    tab.wait_for(f"document.querySelector('#details h3') && {LINK}.includes(search.value)")
    assert tab.run(LINK) == name
    tab.run("search.value = 'no such street'; search.dispatchEvent(new Event('change'))")
    assert "No street, link or zone" in tab.run("found.textContent")
    # what was found before is shown no longer
    assert "No link is chosen" in tab.run("document.querySelector('#details').textContent")
    assert tab.run("document.querySelectorAll('#details svg').length") == 0
    chosen = "trafficReport.map.map.getSource('chosen').serialize().data"
    assert tab.run(f"{chosen}.features.length") == 0


def test_search_finds_links_and_zones_by_their_ids(tab: Tab) -> None:
    def found(text: str) -> str:
        tab.run(f"search.value = {text!r}; search.dispatchEvent(new Event('change'))")
        return str(tab.run("found.textContent"))

    tab.run("trafficReport.choose(0, [0])")
    assert found("zone 4").startswith("Zone 4:")
    assert tab.run("zone.selectedOptions[0].textContent") == "4"
    assert tab.run("direction.value") == "to"  # nobody starts there
    assert tab.run("document.querySelectorAll('.zone-mark').length") == 2
    tab.run("document.getElementById('trips-on-map').click()")
    tab.run(
        "search.value = trafficReport.run.links.ids[2]; search.dispatchEvent(new Event('change'))"
    )
    assert tab.run("found.textContent") == f"link id {EVIL[2]}"
    assert tab.run(LINK) == EVIL[2]


def test_names_come_out_as_text(tab: Tab) -> None:
    assert tab.run("typeof window.harm") == "undefined"
    assert tab.run("document.title").startswith(EVIL[0])
    assert tab.run("document.querySelector('h1').textContent") == EVIL[0]
    assert tab.run("document.querySelector('.attribution').textContent").startswith(EVIL[2])
    body = tab.run("document.body.textContent")
    assert all(text in body for text in EVIL)
    assert tab.run("document.querySelectorAll('img[src=x]').length") == 0


def test_every_quantity_is_drawn_and_has_its_legend(tab: Tab) -> None:
    move_to(tab, 3)
    for key in ("volume", "density", "delay", "queue", "speed"):
        tab.run(f"document.querySelector('[value={key}]').click()")
        tab.wait_for(f"{SHOWN} === '{key} 3'")
        assert tab.run("document.querySelector('#legend').textContent").lower().startswith(key)
        colours = tab.run(
            "trafficReport.run.lines.map((_, link) => trafficReport.map.map.getFeatureState("
            "{source: 'links', id: link}).colour)"
        )
        assert max(colours) >= 0


def test_a_street_of_the_table_and_a_zone_are_shown_on_the_map(tab: Tab) -> None:
    tab.run("document.querySelector('[data-worst=\"0\"]').click()")
    name = tab.run("document.querySelector('[data-worst=\"0\"]').textContent")
    assert tab.run(LINK) == name
    tab.run("trafficReport.trips.choose(0)")
    tab.run("document.getElementById('trips-on-map').click()")
    assert tab.run("document.querySelectorAll('#trips-panel tbody tr').length") == 1
    # the zone and where its trips go
    assert tab.run("document.querySelectorAll('.zone-mark').length") == 2
    tab.run("document.getElementById('trips-on-map').click()")
    assert tab.run("document.querySelectorAll('.zone-mark').length") == 0


def test_dark_and_print_take_colours_of_their_own(tab: Tab, tmp_path: Path) -> None:
    ground = "trafficReport.map.map.getPaintProperty('ground', 'background-color')"
    light = tab.run(ground)
    tab.media("dark")
    tab.wait_for(f"{ground} !== '{light}'")
    assert tab.run("getComputedStyle(document.body).backgroundColor") == "rgb(20, 24, 29)"
    tab.printed(tmp_path / "report.pdf")
    assert (tmp_path / "report.pdf").stat().st_size > 10_000
    # the picture that stands for the map on paper has the light ground
    corner = tab.run(
        "(async () => { const picture = document.getElementById('map-print'); "
        "await picture.decode(); const canvas = document.createElement('canvas'); "
        "canvas.width = canvas.height = 4; const to = canvas.getContext('2d'); "
        "to.drawImage(picture, 0, 0); return [...to.getImageData(2, 2, 1, 1).data]; })()"
    )
    assert corner == [247, 248, 249, 255]
    tab.media("light")
    tab.wait_for(f"{ground} === '{light}'")


def test_nothing_went_wrong_on_the_way(tab: Tab) -> None:
    assert tab.complaints == []
    assert {url.partition(":")[0] for url in tab.requests} <= {"file", "data", "blob"}


def test_a_city_of_13_000_links_is_small_enough_and_moves(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    run = city(57, bins=96)
    write_page(
        tmp_path / "city.html",
        run,
        RunDescription(datetime(2026, 1, 1, tzinfo=UTC), run.network.notes, {}),
    )
    assert len(run.network.links) > 12_700
    assert (tmp_path / "city.html").stat().st_size < 6e6
    with opened(tmp_path / "profile") as city_tab:
        city_tab.size(1280, 900)
        city_tab.open(tmp_path / "city.html")
        steps = []
        for step in (26, 29, 32, 35, 38):  # through the morning peak
            move_to(city_tab, step)
            steps.append(int(city_tab.run("document.documentElement.dataset.stepMs")))
        assert city_tab.complaints == []
    # told, not judged: how long it takes hangs on what else the machine does
    record_property("milliseconds_a_step", steps)
    print(f"milliseconds a step: {steps}")  # noqa: T201


def city(size: int, bins: int) -> Run:
    """Two-way streets in a square with made-up states, as a day with two peaks has them."""
    rows = []
    for i in range(size):
        for j in range(size):
            for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if 0 <= a < size and 0 <= b < size:
                    rows.append(link(f"{i},{j}-{a},{b}", f"{i},{j}", f"{a},{b}", 100.0))
    streets = network(rows)
    at = {node: np.array(node.split(","), float) / 1000 for node in streets.nodes["node_id"]}
    ends = [(at[row["from_node_id"]], at[row["to_node_id"]]) for row in rows]
    nodes = gpd.GeoDataFrame(streets.nodes, geometry=shapely.points(list(at.values())), crs=4326)
    links = gpd.GeoDataFrame(streets.links, geometry=shapely.linestrings(ends), crs=4326)
    streets = replace(streets, nodes=nodes, links=links)
    trips = demand((rows[0]["from_node_id"], rows[0]["to_node_id"], 0.0, 600.0, 50.0))
    result = simulate(streets, trips, Settings(900.0 * bins, 5))
    states = link_times(result, streets, bin_s=900.0)
    random = np.random.default_rng(1)
    hours = np.arange(bins) * 0.25
    peaks = np.exp(-((hours - 8) ** 2) / 4) + np.exp(-((hours - 17) ** 2) / 6)
    noise = random.uniform(0.9, 1.1, (len(rows), bins))
    busy = random.exponential(0.2, (len(rows), 1)) * peaks * noise
    density = np.minimum(busy, 1.0) * 0.1
    speed = 20.0 * (1 - density / 0.12)
    states["time"] = (density * 100.0 * 900.0).ravel()
    states["distance"] = states["time"] * speed.ravel()
    states["delay"] = states["time"] - states["distance"] / 20.0
    states["queue_length"] = np.where(density > 0.05, density * 1000, 0.0).ravel()
    return Run(streets, result, states)


def test_a_notebook_shows_the_page_in_a_frame(tmp_path: Path) -> None:
    streets = roads()
    result = simulate(streets, demand(("0", "4", 0.0, 1200.0, 600.0)), Settings(2400.0, 5))
    shown = explore(streets, result)._repr_html_()
    (tmp_path / "notebook.html").write_text(f"<!DOCTYPE html><p>A cell</p>{shown}", "utf-8")
    inside = "document.querySelector('iframe')?.contentDocument?.documentElement?.dataset"
    with opened(tmp_path / "profile") as notebook:
        notebook.call("Page.navigate", url=(tmp_path / "notebook.html").as_uri())
        notebook.wait_for(f"{inside}?.ready === 'true'")
        assert notebook.run(f"{inside}.shown").startswith("speed ")
        assert notebook.complaints == []


def test_tiles_are_asked_for_only_by_those_who_tick_them(tmp_path: Path) -> None:
    with opened(tmp_path / "profile") as online:
        online.open(write_report(tmp_path / "report.html"))
        assert not [url for url in online.requests if url.startswith("http")]
        online.run("document.getElementById('tiles').click()")
        online.wait_for("!document.querySelector('#trouble').hidden")
        asked = {url[:31] for url in online.requests if url.startswith("http")}
        assert asked == {"https://tile.openstreetmap.org/"}
        assert "cannot be loaded" in online.run("document.querySelector('#trouble').textContent")
        assert online.run("document.querySelector('#tiles-attribution').hidden") is False
        online.run("document.getElementById('tiles').click()")
        assert online.run("document.querySelector('#trouble').hidden") is True


def test_the_page_shows_the_times_of_the_clock_over_midnight(tmp_path: Path) -> None:
    streets = roads()
    result = simulate(streets, demand(("0", "4", 0.0, 1200.0, 600.0)), Settings(2400.0, 5))
    states = link_times(result, streets, bin_s=90.0)
    start = datetime(2026, 3, 31, 23, 40, tzinfo=timezone(timedelta(hours=1)))
    write_page(
        tmp_path / "late.html",
        Run(streets, result, states),
        RunDescription(start, streets.notes, {}),
    )
    edges = [*states["begin_s"].unique(), 2400.0]
    clock = Clock.of(start, edges)
    with opened(tmp_path / "profile") as late:
        late.open(tmp_path / "late.html")
        shown = late.run(
            "(async () => { const texts = []; for (let bin = 0; bin < trafficReport.run.bins; "
            "bin++) { await trafficReport.goTo(bin); "
            "texts.push(document.querySelector('#clock').textContent); } return texts; })()"
        )
        assert shown == [clock.span(*span) for span in pairwise(edges)]
        assert shown[0] == "31 Mar 23:40:00–23:41:30"
        assert shown[-1] == "1 Apr 00:19:00–00:20:00"
        ticks = late.run(
            "[...document.querySelector('#network-charts svg')"
            ".querySelectorAll('text[text-anchor=middle]')].map((one) => one.textContent)"
        )
        assert ticks == [text for _, text in clock.ticks(5)]
        assert "1 Apr" in ticks


def test_of_marks_that_meet_the_worse_lies_on_top(tab: Tab) -> None:
    order = tab.run(
        "[...document.querySelectorAll('.place-mark')].map((mark) => "
        "[Number(mark.textContent), Number(getComputedStyle(mark).zIndex)])"
    )
    assert [number for number, _ in order] == [1, 2, 3, 4][: len(order)]
    assert len(order) > 1
    assert all(high > low for (_, high), (_, low) in pairwise(order))


def test_on_paper_the_map_has_its_numbers_and_no_bars(tab: Tab) -> None:
    black = tab.run(
        "(async () => { const { map } = trafficReport; "
        "const image = new Image(); image.src = map.picture(); await image.decode(); "
        "const canvas = document.createElement('canvas'); "
        "[canvas.width, canvas.height] = [image.width, image.height]; "
        "const pen = canvas.getContext('2d'); pen.drawImage(image, 0, 0); "
        "const { x, y } = map.map.project(map.marks[0].place); "
        "return [...pen.getImageData(x - 8, y, 1, 1).data]; })()"
    )
    assert black == [28, 33, 38, 255]
    tab.media("light", "print")
    frame, ground = (
        tab.run(f"getComputedStyle(document.querySelector('.map-frame')).{what}")
        for what in ("backgroundColor", "printColorAdjust")
    )
    tab.media("light")
    assert (frame, ground) == ("rgb(247, 248, 249)", "exact")


def test_without_webgl_curves_and_tables_are_there(tmp_path: Path) -> None:
    with opened(tmp_path / "profile", "--disable-3d-apis") as plain:
        plain.open(write_report(tmp_path / "report.html"))
        assert "WebGL" in plain.run("document.querySelector('#trouble').textContent")
        assert plain.run("document.querySelectorAll('#network-charts svg').length") == 5
        plain.run("slider.value = 4; slider.dispatchEvent(new Event('input'))")
        assert plain.run("document.querySelector('#clock').textContent") == "07:50–07:55"
        plain.run("document.querySelector('[data-worst=\"0\"]').click()")
        assert plain.run("document.querySelectorAll('#details svg').length") == 4
        assert plain.run("document.querySelectorAll('#trips-panel tbody tr').length") == 1

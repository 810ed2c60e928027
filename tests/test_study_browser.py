"""The page of a study in a browser without a network: chooser, slider, search, keys and print."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import Tab, opened
from shown_study import EVIL, study

from uxsim_geo.export.comparison.page import write_comparison_page
from uxsim_geo.export.comparison.words import number

SHOWN = "document.documentElement.dataset.shown"
DETAILS = "document.getElementById('details').textContent"
#: what the map was told of a link: colour class, and opacity
STATE = (
    "trafficComparison.map.map.getFeatureState({{source: 'links', "
    "id: trafficComparison.run.links.ids.indexOf('{}')}})"
)


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    folder = tmp_path_factory.mktemp("comparison")
    write_comparison_page(folder / "comparison.html", study())
    with opened(folder / "profile") as found:
        found.size(1280, 900)
        found.open(folder / "comparison.html")
        yield found
    shutil.rmtree(folder / "profile", ignore_errors=True)


def choose(tab: Tab, scenario: int) -> None:
    tab.run(
        "(() => { const box = document.getElementById('scenario'); "
        f"box.value = {scenario}; box.dispatchEvent(new Event('change')); }})()"
    )
    tab.wait_for(f"{SHOWN}.startsWith('{scenario} ')")


def move_to(tab: Tab, step: int) -> None:
    """Move the slider as a hand would; 0 is the whole run."""
    tab.run(f"slider.value = {step}; slider.dispatchEvent(new Event('input')); slider.blur(); 1")
    tab.wait_for(f"{SHOWN}.endsWith(' {step - 1}')")


def colour_class(tab: Tab, link: str) -> int:
    return int(tab.run(f"{STATE.format(link)}.colour % PALETTE"))


def test_it_opens_without_a_complaint_and_asks_nobody(tab: Tab) -> None:
    assert tab.run("trafficComparison.map.map.loaded()") is True
    assert tab.run("document.getElementById('trouble').hidden") is True
    assert tab.complaints == []
    assert {url.partition(":")[0] for url in tab.requests} <= {"file", "data", "blob"}
    assert tab.run("window.harm ?? null") is None


def test_links_of_one_network_alone_have_classes_of_their_own(tab: Tab) -> None:
    choose(tab, 0)
    move_to(tab, 0)
    assert colour_class(tab, "bd") == 7
    assert colour_class(tab, "bc") == 8
    # nobody on the link in the base: no speed to compare, and no change of 0
    tab.run("document.querySelector('#quantities [value=speed_kmh]').click()")
    tab.wait_for(f"{SHOWN} === '0 speed_kmh -1'")
    assert colour_class(tab, "ac") == 9
    tab.run("document.querySelector('#quantities [value=delay_veh_h]').click()")
    tab.wait_for(f"{SHOWN} === '0 delay_veh_h -1'")
    assert colour_class(tab, "ab") < 3
    assert colour_class(tab, "ea") == 3


def test_the_chooser_shows_the_tables_of_its_scenario(tab: Tab) -> None:
    hidden = "[...document.querySelectorAll('.block')].map((block) => block.hidden)"
    choose(tab, 1)
    assert tab.run(hidden) == [True, False]
    # a link that is not in this scenario is not drawn, and none changes
    assert tab.run(f"{STATE.format('bc')}.width") == 0
    assert {colour_class(tab, link) for link in ("ab", "ac", "cd", "ea", "de", "bd")} == {3}
    choose(tab, 0)
    assert tab.run(hidden) == [False, True]


def test_slider_and_keys_move_in_time(tab: Tab) -> None:
    choose(tab, 0)
    move_to(tab, 2)
    assert tab.run("document.getElementById('clock').textContent") == "07:35–07:40"
    tab.key("ArrowRight", code=39)
    tab.wait_for(f"{SHOWN}.endsWith(' 2')")
    assert tab.run("slider.getAttribute('aria-valuetext')") == "07:40–07:45"
    for _ in range(4):
        tab.key("ArrowLeft", code=37)
    tab.wait_for(f"{SHOWN}.endsWith(' -1')")
    assert tab.run("document.getElementById('clock').textContent") == "whole run"


def test_search_finds_a_link_and_tells_both_values_and_the_interval(tab: Tab) -> None:
    choose(tab, 0)
    move_to(tab, 0)
    for wanted in ("AB", "bd", "no such street"):
        tab.run(f"search.value = {wanted!r}; search.dispatchEvent(new Event('change')); 1")
        if wanted == "AB":
            told = tab.run(DETAILS)
            table = study().compared[0].comparison.links.set_index("link_id").loc["ab"]
            low, high = (number(table[f"delay_veh_h_{end}"]) for end in ("low", "high"))
            assert f"({low} to {high})" in told
        if wanted == "bd":
            assert "there is nothing to compare" in tab.run(DETAILS)
    assert tab.run("found.textContent") == "No street or link is called so."
    tab.run("search.value = 'DROP TABLE'; search.dispatchEvent(new Event('change')); 1")
    assert tab.run("document.querySelector('#details h3').textContent") == EVIL[0]
    assert tab.run("window.harm ?? null") is None


def test_sure_changes_alone_leave_the_others_grey(tab: Tab) -> None:
    choose(tab, 0)
    move_to(tab, 0)
    tab.run("document.getElementById('relative').click(); 1")
    tab.wait_for(f"{SHOWN} === '0 delay_veh_h relative -1'")
    assert "%" in tab.run("document.querySelector('#legend b').textContent")
    tab.run("document.getElementById('relative').click(); 1")
    tab.wait_for(f"{SHOWN} === '0 delay_veh_h -1'")
    tab.run("document.getElementById('sure').click(); 1")
    sure = study().compared[0].comparison.links.set_index("link_id")["delay_veh_h_significant"]
    assert sure["ab"]
    assert colour_class(tab, "ab") < 3
    tab.run("document.getElementById('sure').click(); 1")


def test_it_is_dark_where_that_is_wished_and_prints_all_scenarios(tab: Tab, tmp_path: Path) -> None:
    ground = "getComputedStyle(document.body).backgroundColor"
    light = tab.run(ground)
    tab.media("dark")
    assert tab.run(ground) != light
    tab.media("light")
    tab.printed(tmp_path / "page.pdf")
    assert (tmp_path / "page.pdf").stat().st_size > 20_000
    assert tab.complaints == []


def test_one_seed_says_that_nothing_is_known_of_chance(tmp_path: Path) -> None:
    write_comparison_page(tmp_path / "comparison.html", study(1))
    with opened(tmp_path / "profile") as tab:
        tab.size(900, 700)
        tab.open(tmp_path / "comparison.html")
        assert "how sure a change is, is not known" in tab.run("legend.textContent")
        assert tab.run(f"{STATE.format('ab')}.opacity") == 1
        assert tab.complaints == []

"""The page in a report and in scripts: written, listed, attributed."""

from __future__ import annotations

from pathlib import Path

from page_parts import document
from small_networks import demand, link, network
from small_run import CONFIG, run_small, write_small_run

from uxsim_geo import World, explore, simulate
from uxsim_geo.settings import Settings


def test_a_run_writes_the_page_with_its_facts(tmp_path: Path) -> None:
    write_small_run(tmp_path, CONFIG.replace("[geopackage]", "[page]"))
    assert run_small(tmp_path, "--set", "report.start=2026-03-04T07:30:00+01:00") == 0
    folder = tmp_path / "runs/small"
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert '"report.html"' in (folder / "manifest.json").read_text(encoding="utf-8")
    assert "<h1>small</h1>" in text
    assert "<dt>duration s</dt><dd>1,200</dd>" in text
    assert "OpenStreetMap contributors, ODbL" not in text
    content = document(text)
    assert content["spans"] == ["07:30–07:35", "07:35–07:40", "07:40–07:45", "07:45–07:50"]
    assert "Times are those of 4 March 2026, UTC+01:00." in text
    assert content["edges"] == [0, 300, 600, 900, 1200]
    assert content["links"]["ids"] == ["1-3", "3-4", "4-2"]
    assert content["zones"]["kind"] == "zones of the network"
    assert content["zones"]["vehicles"] == [100]


def test_scripts_get_the_page_for_a_notebook(tmp_path: Path) -> None:
    roads = network([link("a", "1", "2"), link("b", "2", "3")])
    result = simulate(roads, demand(("1", "3", 0.0, 300.0, 100.0)), Settings(900.0, 5))
    shown = explore(roads, result)
    assert shown._repr_html_().startswith("<iframe")
    shown.save(tmp_path / "a.html")
    assert document((tmp_path / "a.html").read_text("utf-8"))["links"]["ids"] == ["a", "b"]
    told = result._repr_html_()
    assert "<tr><th>vehicles completed</th><td>100</td></tr>" in told


def test_worlds_are_explored_too() -> None:
    W = World("<b>name</b>", tmax=900, print_mode=0, save_mode=0, random_seed=3)
    W.addNode("1", 0, 0)
    W.addNode("2", 1000, 0)
    W.addLink("a", "1", "2", length=1000)
    W.adddemand("1", "2", 0, 300, 0.3)
    W.exec_simulation()
    text = W.explore(bin_s=100).text
    assert "<h1>&lt;b&gt;name&lt;/b&gt;</h1>" in text
    assert len(document(text)["edges"]) == 10

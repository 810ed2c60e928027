"""Scenarios of a study: what they resolve to, and every fault of all of them at its line."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import geopandas as gpd
import pandas as pd
import pyogrio
import pytest
from conftest import REPOSITORY

from pipeline.config_file import config_of, load_config, read_config, write_config
from pipeline.config_keys import Reading
from pipeline.dry_run import dry_run_text, write_changes
from pipeline.ingest import read_sources
from pipeline.scenarios import Scenario, Tables, read_scenarios, resolve
from pipeline.yaml_source import read_yaml
from uxsim_geo.errors import InputError

CONFIG = REPOSITORY / "configs/sioux_falls.yaml"

#: measures of the base, from line 2 on in their own file
CONTROL = """\
closures:
  - {links: [6-8, 8-6], begin_s: 600, end_s: 3000}
  - {where: "link_id == '10-16'"}
signals:
  - node_id: "10"
    phases: [{duration_s: 30, links: [9-10]}, {duration_s: 30, links: [15-10]}]
"""


@cache
def tables() -> Tables:
    return Tables(*read_sources(load_config(CONFIG).ingest))


@pytest.fixture
def study(tmp_path: Path) -> Callable[[str], dict[str, Scenario]]:
    (tmp_path / "control.yaml").write_text(CONTROL, encoding="utf-8")

    def resolved(scenarios: str) -> dict[str, Scenario]:
        path = tmp_path / "study.yaml"
        path.write_text(f"name: study\nscenarios:\n{scenarios}", encoding="utf-8")
        reading = Reading(read_yaml(path), tmp_path)
        set_ = [f"simulate.control={tmp_path / 'control.yaml'}"]
        return resolve(read_config(CONFIG, set_), reading, read_scenarios(reading), tables())

    return resolved


Study = Callable[[str], dict[str, Scenario]]


def faults_of(study: Study, scenarios: str) -> list[str]:
    """Faults without the folder of the study: ``study.yaml:4: ...``."""
    with pytest.raises(InputError) as error:
        study(scenarios)
    return [re.sub(r"^\S*/(?=\w+\.yaml)", "", str(fault)) for fault in error.value.faults]


def closures(scenario: Scenario) -> list[tuple[tuple[str, ...], float, float]]:
    entries = scenario.config.simulate.control.closures
    return [(entry.links, entry.begin_s, entry.end) for entry in entries]


def test_the_base_comes_first_and_changes_nothing(study: Study) -> None:
    found = study("  wider:\n    - add: {links: [6-8], lanes: 1}\n")
    assert list(found) == ["base", "wider"]
    base = found["base"]
    assert base.config.name == "sioux_falls"
    assert base.config.edits == ()
    assert base.tables is not None
    assert base.tables.network is tables().network
    assert base.tables.demand is tables().demand
    assert not len(base.changes)
    assert found["wider"].config.name == "sioux_falls_wider"
    assert found["wider"].config.simulate == base.config.simulate


def test_control_alone_leaves_the_tables_to_the_base(study: Study) -> None:
    found = study("  closed:\n    - close: {links: [1-2], end_s: 900}\n")["closed"]
    assert found.config.edits == ()
    assert found.tables is not None
    assert found.tables.network is tables().network
    assert closures(found)[-1] == (("1-2",), 0.0, 900.0)
    assert len(closures(found)) == 3


def test_a_scenario_written_as_a_configuration_says_the_same(study: Study, tmp_path: Path) -> None:
    found = study(
        "  all:\n"
        "    - add: {links: [6-8], lanes: 1}\n"
        "    - add_node: {id: new, x: -96.75, y: 43.59}\n"
        "    - add_link: {id: there, from: '6', to: new, lanes: 2, free_speed_kmh: 50}\n"
        "    - shift_demand: {by_s: 600, share: 0.1, origins: ['1']}\n"
        "    - simulate: {platoon_size: 10}\n"
        "    - control: {tolls: [{links: [1-2], amount: 2}]}\n"
    )["all"]
    write_config(found.config, tmp_path / "written.yaml")
    assert load_config(tmp_path / "written.yaml") == found.config
    assert found.config.simulate.platoon_size == 10
    assert [edit.only()[0] for edit in found.config.edits] == [
        "add",
        "add_node",
        "add_link",
        "shift_demand",
    ]


def test_scenarios_build_on_others_each_once(study: Study) -> None:
    found = study(
        "  one:\n    - set: {links: [6-8], free_speed_kmh: 40}\n"
        "  two:\n    - build_on: one\n    - scale: {links: [6-8], free_speed: 0.5}\n"
        "  three:\n    - build_on: [one]\n    - add: {links: [6-8], lanes: 1}\n"
        "  all:\n    - build_on: [two, three]\n    - require: [one]\n"
    )
    assert [edit.only()[0] for edit in found["all"].config.edits] == ["set", "scale", "add"]
    tables_of_all = found["all"].tables
    assert tables_of_all is not None
    row = tables_of_all.network.links.set_index("link_id").loc["6-8"]
    assert (row["free_speed"], row["lanes"]) == (pytest.approx(20 / 3.6), 2)


def test_links_are_reopened_for_a_time_and_others_stay_closed(study: Study) -> None:
    found = study(
        "  part:\n    - reopen: {links: [6-8], begin_s: 1200, end_s: 1800}\n"
        "  all:\n    - reopen: {links: [6-8, 8-6, 10-16]}\n"
        "  own:\n    - close: {links: [1-2, 2-1]}\n    - reopen: {links: [1-2], begin_s: 3600}\n"
    )
    rest = ((), 0.0, float("inf"))  # by an expression, as it was
    assert closures(found["part"]) == [
        (("8-6",), 600.0, 3000.0),
        (("6-8",), 600.0, 1200.0),
        (("6-8",), 1800.0, 3000.0),
        rest,
    ]
    assert closures(found["all"]) == []
    assert closures(found["own"])[2:] == [
        (("2-1",), 0.0, float("inf")),
        (("1-2",), 0.0, 3600.0),
    ]


def test_lanes_are_closed_as_an_incident(study: Study) -> None:
    found = study(
        "  works:\n    - add: {links: [6-8], lanes: 1}\n"
        "    - close: {links: [6-8], lanes: 1, begin_s: 3000}\n"
    )["works"]
    (incident,) = found.config.simulate.control.incidents
    assert (incident.links, incident.lanes_closed, incident.begin_s) == (("6-8",), 1, 3000.0)


def test_signals_are_replaced_and_removed(study: Study) -> None:
    plan = "{node_id: '10', phases: [{duration_s: 20, links: [9-10, 15-10]}]}"
    found = study(
        f"  other:\n    - signal: {plan}\n"
        "  none:\n    - remove_signals: {nodes: ['10']}\n"
        f"  two:\n    - signal:\n"
        "      - {node_id: '10', end_s: 600, phases: [{duration_s: 20, links: [9-10]}]}\n"
        "      - {node_id: '10', begin_s: 600, phases: [{duration_s: 20, links: [15-10]}]}\n"
    )
    (signal,) = found["other"].config.simulate.control.signals
    assert signal.phases[0].links == ("9-10", "15-10")
    assert found["none"].config.simulate.control.signals == ()
    assert len(found["two"].config.simulate.control.signals) == 2


def test_settings_are_those_of_the_scenario_with_paths_from_the_study(
    study: Study, tmp_path: Path
) -> None:
    found = study(
        "  other:\n"
        "    - simulate:\n"
        "        route_update_weight: 0.2\n"
        "        classes: [{name: default, informed_share: 0.5}]\n"
        "    - config: {report.bin_s: 600, simulate.duration_s: 3600}\n"
    )["other"].config
    assert found.simulate.route_update_weight == 0.2
    assert found.simulate.classes[0].informed_share == 0.5
    assert (found.report.bin_s, found.simulate.duration_s) == (600, 3600)
    overrides = tmp_path / "overrides.csv"
    overrides.write_text("link_id,lanes\n6-8,3\n", encoding="utf-8")
    other = study("  other:\n    - config: {ingest.overrides: overrides.csv}\n")["other"]
    assert other.config.ingest.overrides == overrides
    assert other.tables is None


def test_trips_that_lose_every_way_are_told(study: Study) -> None:
    found = study(
        "  island:\n    - remove_links: {where: \"to_node_id == '1'\"}\n"
        "  shut:\n    - close: {where: \"to_node_id == '1'\"}\n"
        "  for_a_while:\n    - close: {where: \"to_node_id == '1'\", end_s: 600}\n"
    )
    lost = found["island"].cut_off
    assert set(lost["destination"]) == {"1"}
    assert lost["had_way"].all()
    pd.testing.assert_frame_equal(found["shut"].cut_off, lost)
    assert not len(found["for_a_while"].cut_off)
    text = dry_run_text(found, tables())
    assert f"warning: no way is left for {len(lost)} pairs with" in text


def test_the_dry_run_says_from_what_to_what(study: Study) -> None:
    text = dry_run_text(
        study(
            "  wider:\n"
            "    - add: {links: [6-8], lanes: 1}\n"
            "    - set: {links: [8-6, 6-8], free_speed_kmh: 40}\n"
            "    - close: {links: [1-2], begin_s: 600, end_s: 900}\n"
            "    - scale_demand: {factor: 2, pairs: [['1', '2'], ['2', '1']]}\n"
            "    - simulate: {platoon_size: 10}\n"
            "  less:\n    - build_on: wider\n    - remove_links: {links: [10-17]}\n"
        ),
        tables(),
    )
    assert text.splitlines() == [
        "wider: 5 edits",
        "  line 4  add           1 link, 2.0 km   lanes: 1 → 2",
        "  line 5  set           2 links, 4.0 km  free_speed_kmh: 10.8 → 40",
        "  line 6  close         1 link, 6.0 km   closed: – → from 600 to 900 s",
        "  line 7  scale_demand  2 pairs          vehicles: 20.8 → 41.6",
        "  line 8  simulate                       simulate.platoon_size: 5 → 10",
        "",
        "less: 6 edits",
        "  line 4   add           1 link, 2.0 km   lanes: 1 → 2",
        "  line 5   set           2 links, 4.0 km  free_speed_kmh: 10.8 → 40",
        "  line 6   close         1 link, 6.0 km   closed: – → from 600 to 900 s",
        "  line 7   scale_demand  2 pairs          vehicles: 20.8 → 41.6",
        "  line 8   simulate                       simulate.platoon_size: 5 → 10",
        "  line 11  remove_links  1 link, 8.0 km   removed",
    ]


def test_the_map_shows_links_added_removed_and_closed(study: Study, tmp_path: Path) -> None:
    found = study(
        "  all:\n"
        "    - add_link: {id: new, from: '6', to: '16', lanes: 1, free_speed_kmh: 50}\n"
        "    - remove_links: {links: [10-17]}\n"
        "    - close: {links: [1-2]}\n"
        "    - set: {links: [1-2], lanes: 2}\n"
        "    - scale: {links: [2-1], capacity: 0.5}\n"
        "    - ban_turn: {from_link: 6-8, to_link: 8-9}\n"
        "    - shift_demand: {by_s: 60, pairs: [['1', '2']]}\n"
    )
    for name in ("first.gpkg", "second.gpkg"):
        write_changes(tmp_path / name, found, tables())
    path = tmp_path / "first.gpkg"
    assert path.read_bytes() == (tmp_path / "second.gpkg").read_bytes()
    links = gpd.read_file(path, layer="changes").set_index("link_id")
    assert links["kind"].to_dict() == {
        "new": "added",
        "10-17": "removed",
        "1-2": "closed",
        "2-1": "attributes",
    }
    assert links.loc["1-2", "what"] == "closed – → always; lanes 1 → 2"
    assert links.loc["1-2", "edits"] == "close (line 6), set (line 7)"
    assert links.geometry.notna().all()
    assert links.crs == "EPSG:4326"
    nodes = gpd.read_file(path, layer="changes_at_nodes")
    assert nodes["kind"].tolist() == ["turn banned"]
    other = pyogrio.read_dataframe(path, layer="other_changes")
    told = ["1 pair", "demand", "mean_departure_s: 2,400 → 2,460", "shift_demand (line 10)"]
    assert other[["id", "kind", "what", "edits"]].to_numpy().tolist() == [told]
    styles = pyogrio.read_dataframe(path, layer="layer_styles")
    assert "WHEN \"kind\" = 'closed' THEN 2" in styles["styleQML"].iloc[0].replace("&quot;", '"')


# faults: each scenario is one of them, and what is said, with its line in study.yaml

FAULTS = {
    "unknown edit": ("- clos: {links: [1-2]}", "unknown key scenarios.it[0].clos; did you mean"),
    "unknown key": (
        "- close: {links: [1-2], lane: 1}",
        "unknown key scenarios.it[0].close.lane; did you mean close.lanes?",
    ),
    "two in one": (
        "- {add: {links: [6-8], lanes: 1}, close: {links: [1-2]}}",
        "scenarios.it[0]: must have one of set, scale, add,",
    ),
    "no link": ("- close: {}", "scenarios.it[0].close: says of no link; give links, where"),
    "unknown link": (
        "- set: {links: [6-88], lanes: 2}",
        "scenarios.it[0].set.links: the network has no such link_id; did you mean",
    ),
    "nothing chosen": (
        "- scale: {where: lanes > 9, capacity: 2}",
        "scenarios.it[0].scale.where: no link of the network is meant",
    ),
    "street without names": (
        "- add: {street: Main Street, lanes: 1}",
        "scenarios.it[0].add.street: the links of the network have no names",
    ),
    "unknown column": (
        "- remove_links: {where: lames > 1}",
        "scenarios.it[0].remove_links.where: no such column: did you mean lanes",
    ),
    "no polygon file": (
        "- remove_links: {polygon: nowhere.gpkg}",
        "scenarios.it[0].remove_links.polygon: no such file",
    ),
    "two units": (
        "- set: {links: [6-8], free_speed: 2, free_speed_kmh: 30}",
        "scenarios.it[0].set: free_speed and free_speed_kmh say the same; keep one",
    ),
    "sets nothing": ("- set: {links: [6-8]}", "scenarios.it[0].set: sets nothing"),
    "no such speed": (
        "- set: {links: [6-8], free_speed_kmh: 0}",
        "scenarios.it[0].set.free_speed_kmh: must be greater than 0",
    ),
    "no last lane": ("- add: {links: [6-8], lanes: -1}", "it[0].add.lanes: leaves no lane of 1"),
    "link that is there": (
        "- add_link: {id: 6-8, from: '6', to: '9', lanes: 1, free_speed_kmh: 30}",
        "scenarios.it[0].add_link.id: the network has this link_id already",
    ),
    "node that is not": (
        "- add_link: {id: n, from: '6', to: '99', lanes: 1, free_speed_kmh: 30}",
        "scenarios.it[0].add_link.to: the network has no such node_id",
    ),
    "no speed": (
        "- add_link: {id: n, from: '6', to: '9', lanes: 1}",
        "scenarios.it[0].add_link: free_speed_kmh is missing",
    ),
    "no line": (
        "- {add_link: {id: n, from: '6', to: '9', along: way.gpkg, lanes: 1, free_speed: 3}}",
        "scenarios.it[0].add_link.along: no such file",
    ),
    "node that is there": (
        "- add_node: {id: '6', x: 0, y: 0}",
        "scenarios.it[0].add_node.id: the network has this node_id already",
    ),
    "turn that is allowed": (
        "- allow_turn: {from_link: 6-8, to_link: 8-9}",
        "scenarios.it[0].allow_turn.from_link: is not banned",
    ),
    "turn over nothing": (
        "- ban_turn: {from_link: 6-8, to_link: 10-9}",
        "scenarios.it[0].ban_turn.to_link: does not start where 6-8 ends",
    ),
    "nothing closed": (
        "- reopen: {links: [1-2]}",
        "scenarios.it[0].reopen: none of these links is closed then",
    ),
    "nothing closed then": (
        "- reopen: {links: [6-8], begin_s: 3000}",
        "scenarios.it[0].reopen: none of these links is closed then",
    ),
    "no signal": (
        "- remove_signals: {nodes: ['9']}",
        "scenarios.it[0].remove_signals.nodes[0]: this node has no signal",
    ),
    "negative factor": (
        "- scale_demand: {factor: -1}",
        "scenarios.it[0].scale_demand.factor: must be greater than or equal to 0",
    ),
    "unknown origin": (
        "- scale_demand: {factor: 2, origins: [nowhere]}",
        "scenarios.it[0].scale_demand.origins: no row of the table is of this name",
    ),
    "times": (
        "- shift_demand: {by_s: 60, between_s: [10, 5]}",
        "scenarios.it[0].shift_demand.between_s: must be an earlier and a later moment",
    ),
    "before the start": (
        "- shift_demand: {by_s: -60}",
        "scenarios.it[0].shift_demand.by_s: 528 rows of the demand would begin before the start",
    ),
    "replaced by nothing": (
        "- replace_demand: {}",
        "scenarios.it[0].replace_demand: takes all trips out and puts none in",
    ),
    "unknown setting": (
        "- simulate: {platoon: 10}",
        "unknown key simulate.platoon; did you mean simulate.platoon_size?",
    ),
    "wrong setting": (
        "- config: {simulate.platoon_size: many}",
        "simulate.platoon_size: must be a valid integer",
    ),
    "seed": ("- simulate: {seed: 3}", "it[0].simulate.seed: give seeds at the top of the study"),
    "toll of a wrong link": (
        "- control: {tolls: [{links: [1-99], amount: 3}]}",
        "scenario it: simulate.control.tolls[0].links: the network has no such link_id",
    ),
    "closed twice at once": (
        "- close: {links: [6-8], lanes: 1}",
        "scenario it: simulate.control.incidents[0].lanes_closed: ",
    ),
    "late closure": (
        "- close: {links: [1-2], begin_s: 9000}",
        "scenario it: simulate.control.closures[2].begin_s: begins when the simulation is over",
    ),
    "itself": ("- build_on: it", "scenarios.it[0].build_on: names the scenario itself"),
    "unknown scenario": (
        "- build_on: [itt]",
        "scenarios.it[0].build_on[0]: no such scenario; did you mean it?",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_told_at_its_line(study: Study, fault: str) -> None:
    edit, message = FAULTS[fault]
    (first, *_) = faults_of(study, f"  it:\n    {edit}\n")
    assert first.startswith("study.yaml:4: ")
    assert message in first


def test_the_faults_of_all_scenarios_are_told_at_once(study: Study) -> None:
    told = faults_of(
        study,
        "  one:\n    - set: {links: [6-88], lanes: 2}\n    - add: {links: [x], lanes: 1}\n"
        "  two:\n    - build_on: one\n    - ban_turn: {from_link: 6-8, to_link: 10-9}\n"
        "  three:\n    - close: {links: [6-8]}\n    - reopen: {links: [1-2]}\n",
    )
    assert [fault.partition(": ")[0] for fault in told] == [
        "study.yaml:4",
        "study.yaml:5",
        "study.yaml:8",
        "study.yaml:11",
    ]


def test_edits_that_contradict_one_another_are_named_with_both_lines(study: Study) -> None:
    told = faults_of(
        study,
        "  it:\n"
        "    - set: {links: [6-8, 8-6, 1-2], lanes: 2}\n"
        "    - set: {links: [6-8, 8-6], lanes: 3, free_speed: 9}\n"
        "    - remove_links: {links: [10-17]}\n"
        "    - scale: {links: [10-17], capacity: 2}\n"
        "    - ban_turn: {from_link: 6-8, to_link: 8-9}\n"
        "    - allow_turn: {from_link: 6-8, to_link: 8-9}\n"
        "    - add_node: {id: n, x: -96.75, y: 43.59}\n"
        "    - add_node: {id: n, x: -96.75, y: 43.59}\n"
        "    - set: {links: [1-2], lanes: 2}\n",
    )
    assert [fault.partition(": ")[2] for fault in told] == [
        "scenarios.it[1].set: contradicts scenarios.it[0].set (line 4): both change lanes of 6-8, "
        "8-6; keep one, or choose other links",
        "scenarios.it[3].scale.links: the link is taken out by scenarios.it[2].remove_links "
        "(line 6) (found '10-17')",
        "scenarios.it[5].allow_turn: contradicts scenarios.it[4].ban_turn (line 8): both change "
        "banned of 6-8 8-9; keep one, or choose other links",
        "scenarios.it[7].add_node.id: the network has this node_id already (found 'n')",
    ]


def test_settings_that_contradict_one_another_are_named(study: Study) -> None:
    (told,) = faults_of(
        study,
        "  it:\n    - simulate: {platoon_size: 10}\n    - config: {simulate.platoon_size: 20}\n",
    )
    assert told == (
        "study.yaml:5: scenarios.it[1].config.simulate.platoon_size: contradicts "
        "scenarios.it[0].simulate.platoon_size, which sets simulate.platoon_size too; keep one"
    )


def test_measures_of_the_base_that_name_a_removed_link_are_told_at_their_line(
    study: Study,
) -> None:
    (told,) = faults_of(study, "  it:\n    - remove_links: {links: [15-10]}\n")
    assert told.startswith(
        "control.yaml:6: scenario it: simulate.control.signals[0].phases: the network has no such "
    )


def test_circles_and_missing_and_excluded_scenarios(study: Study) -> None:
    add = "    - add: {links: [6-8], lanes: 1}\n"
    told = faults_of(
        study,
        "  a:\n    - build_on: b\n  b:\n    - build_on: c\n  c:\n    - build_on: a\n",
    )
    assert told == [
        "study.yaml:4: scenarios.a[0].build_on: a scenario cannot build on itself: a on b on c on a"
    ]
    told = faults_of(
        study,
        f"  road:\n{add}"
        f"  bus:\n    - require: road\n    - close: {{links: [1-2]}}\n"
        f"  calm:\n    - exclude: [road]\n    - close: {{links: [2-1]}}\n"
        "  both:\n    - build_on: [road, bus]\n"
        "  wrong:\n    - build_on: [road, calm]\n",
    )
    assert told == [
        "study.yaml:6: scenarios.bus[0].require: bus requires road: let bus build on it, too",
        "study.yaml:9: scenarios.calm[0].exclude[0]: calm, on which wrong builds, excludes road, "
        "and wrong builds on it",
    ]


@pytest.mark.parametrize(
    ("scenarios", "message"),
    [
        ("  base:\n    - close: {links: [1-2]}\n", "is the name of the scenario without edits"),
        ("  it: {close: {links: [1-2]}}\n", "must be a list of edits"),
        ("  a b:\n    - close: {links: [1-2]}\n", "a scenario's name consists of"),
        ("  - close\n", "must be a section: the name of each scenario"),
    ],
)
def test_scenarios_that_are_none(study: Study, scenarios: str, message: str) -> None:
    (told,) = faults_of(study, scenarios)
    assert message in told


def test_a_base_at_fault_is_told_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text("name: x\n", encoding="utf-8")
    with pytest.raises(InputError, match="ingest is missing"):
        config_of(read_config(tmp_path / "base.yaml"))

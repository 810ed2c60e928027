"""What scenarios change, in sentences for those who read a study's results."""

from __future__ import annotations

from pathlib import Path

from study_files import write_study

from pipeline.config_file import config_of
from pipeline.edit_sentences import edits_in_sentences
from pipeline.progress import Silence
from pipeline.sources import Sources
from pipeline.study_config import read_study
from pipeline.study_folder import StudyFolder
from pipeline.study_scenarios import Preparation

EDITS = """base: small.yaml
scenarios:
  all:
    - close: {links: [3-4], begin_s: 60, end_s: 120}
    - set: {links: [1-3], free_speed_kmh: 36, lanes: 2}
    - scale_demand: {factor: 0.5}
    - shift_demand: {by_s: 60}
    - add_node: {id: "5", x: 1000, y: 500}
    - add_link: {id: 3-5, from: "3", to: "5", lanes: 1, free_speed_kmh: 50}
    - ban_turn: {from_link: 1-3, to_link: 3-5}
    - signal: {node_id: "4", phases: [{duration_s: 30, links: [3-4]}]}
    - control: {tolls: [{links: [4-2], amount: 2}]}
    - simulate: {platoon_size: 10}
  gone:
    - remove_links: {links: [4-2]}
"""


def sentences(folder: Path, name: str) -> list[str]:
    path = write_study(folder, EDITS)
    file, own = read_study(path), StudyFolder(folder / "runs/study")
    sources = Sources(config_of(file.base_copy()), own, ["test"], Silence())
    preparation = Preparation(file, own, sources, 0)
    scenarios, tables = preparation.scenarios()
    return list(edits_in_sentences(scenarios[name], scenarios["base"], tables))


def test_each_edit_is_a_sentence_with_places_and_units(tmp_path: Path) -> None:
    assert sentences(tmp_path, "all") == [
        "1 link, 1.0 km (3-4) closed, from 60 to 120 s",
        "1 link, 0.5 km (1-3): lanes 1 → 2",
        "1 link, 0.5 km (1-3): free speed 72 → 36 km/h",
        "1 link, 0.5 km (1-3): capacity 1,800 → 3,600 veh/h",
        "1 pair: vehicles 100 → 50",
        "1 pair: mean departure 300 → 360 s",
        "1 node (5) added",
        "1 link, 0.7 km (3-5) added",
        "1 turn (1-3 3-5) banned",
        "1 node (4): signal always, cycle 30 s: 30 s 3-4",
        "1 link, 0.5 km (4-2): tolls amount 2.0",
        "simulate.platoon_size 5 → 10",
    ]


def test_trips_without_any_way_are_told(tmp_path: Path) -> None:
    removed, warned = sentences(tmp_path, "gone")
    assert removed == "1 link, 0.5 km (4-2) removed"
    assert warned == "warning: no way is left for 1 pair with 100 trips: 1 to 2"

"""The benchmarks: cases are what they say, runs go in turns, and the page tells the figures."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from cases import Tables, at_home, city, grid, write_tables
from conftest import REPOSITORY
from figures import Goal, Place, Spread, is_met, ratio, spread
from page import number, page, told
from plan import OURS, UXSIM, compared, large, series
from sumo_files import _trips
from turns import Engine, Limits, NoFiguresError, run_in_turns, run_once

GENEROUS = Limits(120.0, 8000.0, 120.0)


def test_the_grid_is_that_of_the_reference() -> None:
    made = grid(11)
    assert (len(made.nodes), len(made.links)) == (121, 440)
    assert (made.demand["vehicles"] // 5 * 5).sum() == 60_500
    assert len(made.demand) == 4 * 11 * 11
    place = made.nodes.set_index("node_id")
    start, end = (place.loc[made.demand[name]].to_numpy() for name in ("origin", "destination"))
    assert (np.abs(start - end).max(axis=1) == 10_000).all()  # from one side to the opposite


def test_links_of_a_grid_tie_neighbours_both_ways() -> None:
    made = city(5, 4, 1000.0, 600.0)
    place = made.nodes.set_index("node_id")
    start, end = (place.loc[made.links[f"{name}_node_id"]].to_numpy() for name in ("from", "to"))
    assert (np.abs(start - end).sum(axis=1) == made.links["length"]).all()
    ways = set(zip(made.links["from_node_id"], made.links["to_node_id"], strict=True))
    assert len(ways) == len(made.links) == 4 * 5 * 4
    assert {(b, a) for a, b in ways} == ways


def test_a_city_has_the_vehicles_it_is_asked_for_in_whole_platoons() -> None:
    made = city(10, 6, 1000.0, 600.0)
    assert made.demand["vehicles"].sum() == 1000
    assert (made.demand["vehicles"] % 5 == 0).all()
    assert made.demand.groupby(["origin", "destination"]).ngroups == 6 * 5
    few = city(10, 6, 50.0, 600.0)
    assert few.demand["vehicles"].sum() == 50
    assert len(few.demand) == 10


def test_at_home_somebody_wants_to_go_to_every_destination_in_the_end() -> None:
    made = at_home(city(10, 6, 50.0, 600.0), 40, 5000.0)
    assert made.demand["destination"].nunique() == 40
    assert (made.demand["origin"] != made.demand["destination"]).all()
    assert made.demand["start_s"].min() == 5000.0


def test_chicago_sketch_is_that_of_the_reference(shared: Path) -> None:
    from cities import chicago_sketch

    made = chicago_sketch()
    reference = json.loads((shared / "reference" / "uxsim_1_15_1.json").read_text())["cost"]
    vehicles = made.demand["vehicles"]
    assert (vehicles // 30 * 30).sum() == reference["chicago_sketch_platoon_30"]["vehicles"]
    # there the last platoon of some pairs is lost to rounding
    given = reference["chicago_sketch_platoon_5"]["vehicles"]
    assert (vehicles // 5 * 5).sum() == pytest.approx(given, rel=1e-3)
    assert (len(made.nodes), len(made.links)) == (546, 2176)


def test_sioux_falls_is_that_of_the_paper() -> None:
    from cities import sioux_falls

    made = sioux_falls()
    assert made.demand["vehicles"].sum() == pytest.approx(37_502.4)
    assert (len(made.nodes), len(made.links)) == (24, 76)


def test_cases_have_names_of_their_own() -> None:
    keys = [case.key for case in [*compared(), *large(), *series()]]
    assert len(set(keys)) == len(keys)


def test_a_growing_grid_asks_for_whole_steps_of_time() -> None:
    for case in series():
        if case.series == "network":
            last = case.make().demand["end_s"].max()
            assert {last % 5, case.interval % 5, case.duration % 5} == {0.0}


def test_sumo_gets_a_trip_for_every_vehicle_in_order_of_departure() -> None:
    rows = {"origin": ["a", "b"], "destination": ["b", "a"], "vehicles": [2.4, 2.6]}
    demand = pd.DataFrame(rows).assign(start_s=[0.0, 10.0], end_s=[100.0, 20.0])
    lines = _trips(demand, {"a": 0, "b": 1})
    departures = [float(line.split('depart="')[1].split('"')[0]) for line in lines]
    # 5 vehicles in all: 2 of the first row, 3 of the second
    assert departures == [11.67, 15.0, 18.33, 25.0, 75.0]
    assert ['fromJunction="0"' in line for line in lines] == [False, False, False, True, True]


@pytest.fixture
def program(tmp_path: Path) -> Callable[..., Engine]:
    """An engine that is a line of Python."""

    def make(name: str, line: str) -> Engine:
        path = tmp_path / f"{name}.py"
        path.write_text(line, encoding="utf-8")
        return Engine(name, sys.executable, str(path), {})

    return make


def test_engines_run_in_turns_each_round_with_its_own_seed(
    program: Callable[..., Engine], tmp_path: Path
) -> None:
    line = "import json, sys; print('hello'); print(json.dumps(json.loads(sys.argv[2])))"
    engines = [program("a", line), program("b", line)]
    runs = run_in_turns(tmp_path, engines, 2, GENEROUS, lambda _: None)
    assert [(run["engine"], run["round"]) for run in runs] == [
        ("a", 0),
        ("b", 0),
        ("a", 1),
        ("b", 1),
    ]
    assert [run["figures"]["seed"] for run in runs] == [0, 0, 1, 1]


def test_an_engine_that_fails_is_told_and_not_run_again(
    program: Callable[..., Engine], tmp_path: Path
) -> None:
    engines = [program("a", "raise SystemExit('no road')"), program("b", "print('{}')")]
    runs = run_in_turns(tmp_path, engines, 2, GENEROUS, lambda _: None)
    assert [run["engine"] for run in runs] == ["a", "b", "b"]
    assert runs[0]["reason"] == "no road"


def test_an_engine_that_has_used_up_its_time_is_not_run_again(
    program: Callable[..., Engine], tmp_path: Path
) -> None:
    limits = Limits(120.0, 8000.0, 0.0001)
    runs = run_in_turns(tmp_path, [program("a", "print('{}')")], 3, limits, lambda _: None)
    assert len(runs) == 1


def test_a_run_is_stopped_at_its_limits(program: Callable[..., Engine], tmp_path: Path) -> None:
    endless = program("a", "while True: pass")
    with pytest.raises(NoFiguresError, match=r"more than 0\.2 s"):
        run_once(tmp_path, endless, 0, Limits(0.2, 8000.0, 1.0))
    large = program("b", "all = bytearray(200_000_000)\nwhile True: pass")
    with pytest.raises(NoFiguresError, match=r"more than 0\.1 GB"):
        run_once(tmp_path, large, 0, Limits(60.0, 100.0, 1.0))


def test_a_run_of_ours_counts_entries_and_vehicles(tmp_path: Path) -> None:
    nodes = pd.DataFrame({"node_id": ["1", "2", "3"], "x": 0.0, "y": 0.0})
    links = pd.DataFrame({"link_id": ["a", "b"], "from_node_id": ["1", "2"]})
    links = links.assign(to_node_id=["2", "3"], length=500.0, lanes=1, free_speed=20.0)
    links = links.assign(jam_density=0.2, capacity=np.nan, merge_priority=1.0)
    demand = pd.DataFrame({"origin": ["1"], "destination": ["3"], "start_s": [0.0]})
    write_tables(Tables(nodes, links, demand.assign(end_s=100.0, vehicles=50.0)), tmp_path)
    case = compared()[0]
    (tmp_path / "case.json").write_text(json.dumps(case.settings()), encoding="utf-8")
    engine = Engine(OURS, sys.executable, "with_uxsim_geo.py", {})
    figures = run_once(tmp_path, engine, 0, GENEROUS)
    assert figures["vehicles"] == figures["completed"] == 50
    assert figures["entries"] == 50 / 5 * 2
    assert figures["peak_mb"] > figures["run_mb"]


def test_the_program_runs_what_it_is_asked_for(tmp_path: Path) -> None:
    command = [sys.executable, REPOSITORY / "benchmarks", "--quick", "--rounds", "1"]
    command += ["--only", "network-10000", "--out", tmp_path, "--peers", sys.executable]
    subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert [case["key"] for case in results["cases"]] == ["network-10000"]
    (ours,) = (run for run in results["runs"] if run["engine"] == OURS)
    assert ours["figures"]["vehicles"] == 10_000
    assert "10,000 vehicles on a grid that grows" in (tmp_path / "performance.md").read_text()
    assert (tmp_path / "images" / "performance_growth.png").stat().st_size > 10_000


def record(engine: str, number: int, **figures: float) -> dict[str, Any]:
    return {"case": "c", "engine": engine, "round": number, "figures": figures, "threads": 1}


def test_ratios_are_of_the_same_round() -> None:
    ours = [record(OURS, number, engine_s=value) for number, value in enumerate((1.0, 2.0, 4.0))]
    theirs = [record(UXSIM, number, engine_s=value) for number, value in enumerate((10.0, 40.0))]
    found = ratio([*ours, *theirs], Place("c", UXSIM, "engine_s"), Place("c", OURS, "engine_s"))
    assert found == Spread(10.0, 15.0, 20.0, 2)
    assert spread([]) is None


def test_figures_are_goals_from_above_and_ratios_from_below() -> None:
    place, found = Place("c", OURS, "engine_s"), Spread(1.0, 2.0, 9.0, 3)
    assert is_met(Goal("time", place, 2.0), found)
    assert not is_met(Goal("time", place, 1.9), found)
    assert is_met(Goal("ratio", place, 2.0, per=place), found)
    assert not is_met(Goal("ratio", place, 2.1, per=place), found)


def test_numbers_have_three_digits_that_count() -> None:
    values = [0.0012345, 1.0, 12.345, 999.6, 1234.5]
    assert [number(value) for value in values] == ["0.00123", "1", "12.3", "1000", "1,234"]
    assert told(Spread(1.0, 2.0, 3.0, 3)) == "2 (1–3)"
    assert told(None) == "–"


def test_the_page_tells_medians_ratios_and_what_was_not_run() -> None:
    case = {"key": "c", "title": "a case", "engines": [OURS, UXSIM], "series": "", "updates": 0}
    runs = [record(OURS, 0, engine_s=2.0, engine_cpu_s=1.0), record(UXSIM, 0, engine_s=30.0)]
    runs.append({"case": "c", "engine": UXSIM, "round": 1, "reason": "stopped", "threads": 1})
    machine = {"date": "a day", "processor": "a chip", "cores": 2, "memory_gb": 8.0}
    results = {
        "machine": machine | {"system": "Linux", "python": "3.11", "libraries": {}},
        "version": "0.1",
        "first_start_s": 9.0,
        "peers": {"UXsim": "1.15.1"},
        "cases": [case],
        "runs": runs,
        "skipped": {"another": "needs a file"},
    }
    text = page(results)
    assert "Measured a day on a chip, 2 cores, 8 GB, Linux: uxsim-geo 0.1" in text
    assert "| a case: uxsim-geo | 2 | – |" in text
    assert "| a case: UXsim, logs off, loop / engine | 15 | 1 |" in text
    assert "| another | needs a file |" in text
    assert "| a case: UXsim, logs off | stopped |" in text
    assert "busy with other work" in text  # 2 s for 1 s of work

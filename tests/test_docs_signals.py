"""The page on signals: its example runs, its table is that of the rule, its numbers are ours."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from conftest import REPOSITORY
from signal_sites import junction
from small_networks import demand

from uxsim_geo.network.signal_options import CLASS_LOADS, SignalOptions
from uxsim_geo.network.signal_rows import COLUMNS
from uxsim_geo.network.signal_times import assumed_cycle, webster_cycle
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

PAGE = (REPOSITORY / "docs/signals.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.search(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert found
    return found[1]


def test_the_example_runs_and_gives_the_table_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names = {
        "network": junction([0, 90, 180, 270]),
        "demand": demand(("A", "C", 0, 600, 100), ("B", "D", 0, 600, 100)),
        "settings": Settings(1200, 1),
    }
    exec(block("python"), names)
    result = names["result"]
    assert isinstance(result, Result)
    assert (result.trips["status"] == "completed").all()
    assert Path("signals.csv").read_text(encoding="utf-8") == block("text")


def test_every_column_and_load_is_listed() -> None:
    assert tuple(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)) == COLUMNS
    listed = {
        name: float(load)
        for names, load in re.findall(r"^\| ([\w, ]+) \| (\d\.\d) \|$", PAGE, re.MULTILINE)
        for name in names.split(", ")
        if name in CLASS_LOADS
    }
    assert listed == CLASS_LOADS


def test_defaults_and_figures_are_those_of_the_code() -> None:
    options = SignalOptions()
    for name, unit in (
        ("pedestrian_green", " s"),
        ("look_back", " m"),
        ("same_direction", "°"),
        ("opposite_within", "°"),
        ("cycle_per_phase", " s"),
        ("min_green", " s"),
        ("min_cycle", " s"),
        ("max_cycle", " s"),
    ):
        found = re.findall(rf"`?{name}`?\s\((\d+){unit}\)", PAGE)
        assert [float(value) for value in found] == [getattr(options, name)], name
    assert f"`all_red_s` ({options.all_red:g} s)" in PAGE
    lost = [options.all_red * phases for phases in (2, 3, 4)]
    assert [assumed_cycle(phases, options) for phases in (2, 3, 4)] == [60, 90, 120]
    for load, shown in ((0.7, [57, 77, 97]), (0.75, [68, 92, 116])):
        assert [round(webster_cycle([load], one, options)) for one in lost] == shown
    # u κ / (1 + u τ κ) of one lane
    assert round(3600 * 12.5 * 0.2 / (1 + 12.5 * 0.2)) == 2571

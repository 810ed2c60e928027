"""Plots of a report: every kind is made, wrong wishes are told, and one failure stops no other."""

from __future__ import annotations

import typing
from pathlib import Path

import pytest
from small_run import CONFIG, run_small, write_small_run

from pipeline import plots
from pipeline.cli import main
from pipeline.config_file import load_config
from pipeline.plot_config import KINDS, PlotEntry, PlotName
from uxsim_geo.errors import Fault, InputError

ENTRIES = {
    "network_average.png": "{plot: network_average}",
    "network_600s.svg": "{plot: network, time_s: 600, bin_s: 60, format: svg}",
    "network_plan.png": "{plot: network_plan}",
    "macroscopic_fundamental_diagram.pdf": "{plot: macroscopic_fundamental_diagram, format: pdf}",
    "middle.png": "{plot: macroscopic_fundamental_diagram, file: middle, region: {links: [3-4]}}",
    "time_space_diagram_traj_links_1-3_3-4_4-2.png": (
        "{plot: time_space_diagram_traj_links, links: [1-3, 3-4, 4-2], by_speed: true}"
    ),
    "time_space_diagram_state_links_speed_3-4.png": (
        "{plot: time_space_diagram_state_links, links: [3-4], state: speed, cell_m: 50}"
    ),
    "cumulative_curves_3-4.png": "{plot: cumulative_curves, links: [3-4]}",
    "fundamental_diagram_3-4.png": "{plot: fundamental_diagram, links: [3-4], bin_s: 60}",
    "travel_times.png": "{plot: travel_times}",
    "desire_lines.png": "{plot: desire_lines, most: 5}",
    "network_anim.gif": "{plot: network_anim, frame_ms: 50}",
    "network_fancy.gif": "{plot: network_fancy, share: 1, interval_s: 100}",
}


def config_with(folder: Path, *entries: str) -> Path:
    return write_small_run(folder, CONFIG.replace("plots: []", f"plots: [{', '.join(entries)}]"))


def test_every_kind_is_tried_and_has_its_function() -> None:
    assert set(typing.get_args(PlotName)) == set(KINDS) == {*plots.FIGURES, *plots.FILMS}
    tried = {entry.split("plot: ")[1].split(",")[0].rstrip("}") for entry in ENTRIES.values()}
    assert tried == set(KINDS)


def test_every_plot_is_made_under_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config_with(tmp_path, *ENTRIES.values())
    assert run_small(tmp_path) == 0
    folder = tmp_path / "runs/small/plots"
    assert {path.name for path in folder.iterdir()} == set(ENTRIES)
    assert all(path.stat().st_size > 1000 for path in folder.iterdir())
    shown = capsys.readouterr()
    assert "network_fancy.gif: 100 %" in shown.err
    assert "plots/travel_times.png" in shown.out.replace("\n", "")
    config_with(tmp_path, "{plot: travel_times}")
    assert run_small(tmp_path) == 0
    assert [path.name for path in folder.iterdir()] == ["travel_times.png"]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{plot: nonsense}", r"plots\[0\].plot: must be"),
        ("{plot: network}", "network needs time_s"),
        ("{plot: network_average, time_s: 5}", "network_average takes no time_s"),
        ("{plot: cumulative_curves, links: []}", "cumulative_curves needs links"),
        ("{plot: cumulative_curves, links: [a, b]}", "an entry for each"),
        ("{plot: network_anim, format: png}", "network_anim is made as gif or mp4"),
        ("{plot: travel_times, format: mp4}", "travel_times is made as png or svg or pdf"),
        ("{plot: travel_times, file: ../x}", "file"),
        ("{plot: travel_times}, {plot: travel_times}", "two of them make travel_times.png"),
        ("{plot: desire_lines, most: 0}", "most"),
        ("{plot: network_fancy, share: 1.5}", "share"),
        ("{plot: network_fancy, frame_ms: 5}", "frame_ms"),
        (
            "{plot: travel_times, file: a}, {plot: network_plan, file: A}",
            "two of them make a.png",
        ),
    ],
)
def test_wrong_keys_are_told_before_anything_runs(tmp_path: Path, entry: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as raised:
        load_config(config_with(tmp_path, entry))
    assert all(fault.line is not None for fault in raised.value.faults)


def test_a_resolved_configuration_is_one_again_and_tables_come_from_its_run(
    tmp_path: Path,
) -> None:
    config_with(tmp_path, *ENTRIES.values())
    assert run_small(tmp_path, "--quiet", "--set", "report.plots=[{plot: travel_times}]") == 0
    run = tmp_path / "runs/small"
    resolved = load_config(run / "config.yaml").report.plots
    assert resolved == (PlotEntry(plot="travel_times"),)
    assert main(["export", str(run), "--table", "od"]) == 0


def test_all_wishes_in_vain_are_told_at_once_and_nothing_is_written(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_bytes() for path in finished.rglob("*.gpkg")}
    config_with(
        finished.parents[1],
        "{plot: cumulative_curves, links: [9-9]}",
        "{plot: time_space_diagram_traj_links, links: [1-3, 4-2]}",
        "{plot: network, time_s: 5000}",
        "{plot: macroscopic_fundamental_diagram, region: {where: lanes > 9}}",
        f"{{plot: fundamental_diagram, links: [{', '.join(['3-4'] * 22)}]}}",
        "{plot: time_space_diagram_state_links, links: [3-4], cell_m: 1e-4}",
        "{plot: network_fancy, interval_s: 5000}",
        "{plot: network_fancy, interval_s: 1e-3, file: fast}",
        "{plot: network_anim, bin_s: 0.05}",
    )
    assert run_small(finished.parents[1]) == 2
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")]
    expected = (
        "small.yaml:16: report.plots[0] (cumulative_curves): links: the network has no such link",
        "begins at node 4, the one before it ends at 3",
        "is after the end of the simulation, 1200 s",
        "region: no link is meant",
        "links: at most 21 can be told apart (found '22')",
        "cell_m: makes more than 20,000,000 cells",
        "interval_s: is longer than the simulation, 1200 s",
        "interval_s: makes more than 5,000 pictures; take 0.24 s or more",
        "bin_s: makes more than 5,000 pictures; take 0.24 s or more",
    )
    assert len(errors) == len(expected)
    for line, words in zip(errors, expected, strict=True):
        assert words in line
    assert {path: path.read_bytes() for path in finished.rglob("*.gpkg")} == before


def test_a_failure_in_one_plot_fails_the_command_after_all_others_are_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("no such luck")

    monkeypatch.setitem(plots.FIGURES, "desire_lines", fail)
    config_with(tmp_path, "{plot: desire_lines}", "{plot: travel_times}")
    assert run_small(tmp_path) == 1
    shown = capsys.readouterr().err
    assert "error: plots/desire_lines.png could not be written: ZeroDivisionError" in shown
    assert "Traceback" not in shown
    folder = tmp_path / "runs/small"
    assert [path.name for path in (folder / "plots").iterdir()] == ["travel_times.png"]
    assert (folder / "results.gpkg").exists()
    assert "no such luck" in (folder / "run.log").read_text(encoding="utf-8")
    monkeypatch.undo()
    assert run_small(tmp_path) == 0
    assert (folder / "plots/desire_lines.png").exists()


@pytest.mark.parametrize(
    ("error", "lines"),
    [
        (ValueError("in plain words"), ["in plain words"]),
        (InputError([Fault("one"), Fault("other", value=5)]), ["one", "other (found '5')"]),
        (KeyError("name"), ["KeyError: 'name'"]),
    ],
)
def test_what_went_wrong_is_told_as_it_was_meant(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    lines: list[str],
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setitem(plots.FIGURES, "travel_times", fail)
    config_with(tmp_path, "{plot: travel_times}")
    assert run_small(tmp_path, "--quiet") == 1
    shown = capsys.readouterr().err.splitlines()
    begin = "error: plots/travel_times.png could not be written: "
    assert shown == [f"{begin}{line}" for line in lines]


def test_bins_of_report_and_plots_are_told_with_the_limit_that_holds(
    finished: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.material.MOST_STATES", 3 * 1200 * 4)
    config_with(finished.parents[1], "{plot: network, time_s: 0, bin_s: 0.2}")
    assert run_small(finished.parents[1], "--set", "report.bin_s=0.24") == 2
    shown = capsys.readouterr().err.splitlines()
    assert [line for line in shown if line.startswith("error")] == [
        "error: report.bin_s: too short for 3 links; take 0.25 s or more (found '0.24')",
        "error: report.plots[0].bin_s: too short for 3 links; take 0.25 s or more (found '0.2')",
    ]
    assert (
        run_small(finished.parents[1], "--set", "report.bin_s=0.25", "--set", "report.plots=[]")
        == 0
    )
    # a table of one link may have three times as many bins
    assert main(["export", str(finished), "--table", "cumulative", "--bin-s", "0.1"]) == 2
    asked = ["--table", "cumulative", "--bin-s", "0.1", "--links", "3-4"]
    assert main(["export", str(finished), *asked]) == 0


def test_every_plot_is_made_where_nobody_drives(tmp_path: Path) -> None:
    path = config_with(tmp_path, *ENTRIES.values())
    text = path.read_text(encoding="utf-8")
    late = text.replace("demand_period_s: 600", "demand_period_s: 10\n    start_s: 10000")
    path.write_text(late, encoding="utf-8")
    assert run_small(tmp_path, "--quiet") == 0
    assert {path.name for path in (tmp_path / "runs/small/plots").iterdir()} == set(ENTRIES)


def test_plots_are_the_same_each_time(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        config_with(tmp_path / name, *ENTRIES.values())
        assert run_small(tmp_path / name, "--quiet") == 0
    for file in ENTRIES:
        one, other = (tmp_path / name / "runs/small/plots" / file for name in ("a", "b"))
        assert one.read_bytes() == other.read_bytes(), file


def test_a_corridor_of_many_links_has_a_name_that_any_system_takes() -> None:
    entry = PlotEntry(
        plot="time_space_diagram_traj_links", links=tuple(f"{i}/{i + 1}" for i in range(300))
    )
    assert entry.file_name == "time_space_diagram_traj_links_0_1_to_299_300.png"

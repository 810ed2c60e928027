"""Which seeds a study runs, and when there are enough of them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from scipy import stats
from study_files import lines_of, manifest, results, study, write_study

from pipeline.study_config import SeedsSection, UntilSection
from pipeline.study_seeds import Seeds, half_width, widths

UNTIL = UntilSection(half_width=1.0)


@pytest.mark.parametrize(
    ("key", "batches"),
    [
        (3, [(7, 8, 9)]),
        ((5, 1, 4), [(5, 1, 4)]),
        (SeedsSection(until=UNTIL, minimum=2, step=3, maximum=6), [(7, 8), (9, 10, 11), (12,)]),
        (SeedsSection(until=UNTIL, minimum=4, step=3, maximum=4), [(7, 8, 9, 10)]),
    ],
)
def test_batches_are_in_order_and_end_at_the_maximum(
    key: int | tuple[int, ...] | SeedsSection, batches: list[tuple[int, ...]]
) -> None:
    seeds = Seeds(key, first=7)
    assert list(seeds.batches()) == batches
    assert tuple(seeds.done) == sum(batches, ())


def test_half_width_is_that_of_students_t() -> None:
    values = [3.0, 5.0, 10.0, 4.0]
    low, high = stats.t.interval(0.95, 3, loc=5.5, scale=stats.sem(values))
    assert half_width(values) == pytest.approx((high - low) / 2, rel=1e-12)
    assert half_width([2.0, 2.0, 2.0]) == 0.0
    assert half_width([2.0]) == math.inf
    assert half_width([]) == math.inf


def test_widths_are_of_paired_differences() -> None:
    base = {("base", seed): 100.0 + 10 * seed for seed in range(3)}
    always_one_more = {("one", seed): 101.0 + 10 * seed for seed in range(3)}
    lost: dict[tuple[str, int], float | None] = {("two", 0): 1.0, ("two", 1): None, ("two", 2): 5.0}
    figures = base | always_one_more | lost
    one, two = widths(UNTIL, figures, ["base", "one", "two"], range(3))
    assert (one.half_width, one.most, one.is_narrow) == (0.0, 1.0, True)
    assert two.half_width == pytest.approx(half_width([-99.0, -115.0]))
    assert not two.is_narrow
    relative = UntilSection(relative_half_width=0.1)
    (alone,) = widths(relative, base, ["base"], range(3))
    assert alone.most == pytest.approx(11.0)
    assert alone.half_width == pytest.approx(half_width([100.0, 110.0, 120.0]))


SECTION = """name: study
base: small.yaml
seeds:
  until: {{figure: total_delay_veh_h, half_width: {width}}}
  minimum: 2
  step: 1
  maximum: 4
comparison: none
scenarios:
  larger: [{{simulate: {{platoon_size: 10}}}}]
"""


def test_seeds_are_added_until_the_interval_is_narrow(tmp_path: Path) -> None:
    # the demand is not drawn and there is one route: runs of all seeds are alike
    write_study(tmp_path, SECTION.format(width=1000))
    said = study(tmp_path)
    assert manifest(tmp_path)["study"]["seeds"] == [0, 1]
    assert any(
        line.startswith("after 2 seeds, total_delay_veh_h: larger ± ") for line in said.lines
    )


def test_seeds_end_at_the_maximum_with_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.study_seeds.half_width", lambda _: 7.0)
    write_study(tmp_path, SECTION.format(width=1))
    said = study(tmp_path)
    assert manifest(tmp_path)["study"]["seeds"] == [0, 1, 2, 3]
    assert len(lines_of(said, "link entries")) == 8
    (warning,) = (line for line in said.lines if line.startswith("warning: after 4 seeds"))
    assert "larger ± 7 (asked: 1)" in warning
    assert "maximum" in warning
    by_one = results(tmp_path)
    write_study(tmp_path / "two", SECTION.format(width=1))
    study(tmp_path / "two", scheduler="processes", workers=2)
    assert results(tmp_path / "two") == by_one


def test_an_unknown_figure_is_told_before_anything_runs(tmp_path: Path) -> None:
    path = write_study(tmp_path, SECTION.format(width=1).replace("total_delay_veh_h", "delays"))
    from pipeline.cli import main

    assert main(["study", str(path), "--out", str(tmp_path / "runs")]) == 2
    assert not (tmp_path / "runs").exists()

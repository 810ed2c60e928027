"""What the runs say together: spreads, ratios of the same round, and whether goals are met."""

from __future__ import annotations

from collections.abc import Iterable
from statistics import median
from typing import Any, NamedTuple

from plan import OURS, UXSIM, UXSIM_LOGS

Records = list[dict[str, Any]]


class Spread(NamedTuple):
    """Of some runs."""

    least: float
    middle: float
    most: float
    runs: int


class Place(NamedTuple):
    """Where a figure stands."""

    case: str
    engine: str
    figure: str


class Goal(NamedTuple):
    """A figure, or its ratio to that of another place, and the bound that it shall keep.

    Ratios are goals from below, figures from above.
    """

    what: str
    figure: Place
    bound: float
    per: Place | None = None
    unit: str = ""


def spread(values: Iterable[float]) -> Spread | None:
    """Least, median and most; None of nothing."""
    known = sorted(values)
    return Spread(known[0], median(known), known[-1], len(known)) if known else None


def by_round(records: Records, place: Place) -> dict[int, float]:
    """A figure in all rounds that have it."""
    return {
        record["round"]: record["figures"][place.figure]
        for record in records
        if (record["case"], record["engine"]) == place[:2]
        and place.figure in record.get("figures", {})
    }


def figure(records: Records, case: str, engine: str, name: str) -> Spread | None:
    """The spread of a figure."""
    return spread(by_round(records, Place(case, engine, name)).values())


def ratio(records: Records, above: Place, below: Place) -> Spread | None:
    """The spread of the ratios of two figures, each of the same round."""
    one, other = by_round(records, above), by_round(records, below)
    return spread(one[number] / other[number] for number in one if other.get(number, 0.0) > 0)


def _times(case: str, title: str, least: float, engine: str = UXSIM) -> Goal:
    """Our engine's time against a loop's, with logs off, or all of exec_simulation, with logs."""
    what, name = ("loop", "engine_s") if engine == UXSIM else ("exec_simulation", "exec_s")
    return Goal(
        f"{title}: time of {what}, {engine}, against our engine's",
        Place(case, engine, name),
        least,
        Place(case, OURS, "engine_s"),
    )


def _memory(case: str, title: str) -> Goal:
    what = f"{title}: memory that a run adds, {UXSIM}, against ours"
    return Goal(what, Place(case, UXSIM, "run_mb"), 3.0, Place(case, OURS, "run_mb"))


#: what is wanted, see the page
GOALS = (
    _times("sioux-falls-5", "Sioux Falls, Δn 5", 15.0),
    _times("grid-11", "grid 11 × 11", 10.0),
    _times("sketch-30", "Chicago-Sketch, Δn 30", 15.0),
    _times("sketch-5", "Chicago-Sketch, Δn 5", 80.0),
    _times("sioux-falls-5", "Sioux Falls, Δn 5", 80.0, UXSIM_LOGS),
    _times("grid-11", "grid 11 × 11", 80.0, UXSIM_LOGS),
    _memory("sioux-falls-5", "Sioux Falls, Δn 5"),
    _memory("grid-11", "grid 11 × 11"),
    _memory("sketch-30", "Chicago-Sketch, Δn 30"),
    _memory("sketch-5", "Chicago-Sketch, Δn 5"),
    Goal("1 M vehicles, 39,600 links: engine", Place("city-1m", OURS, "engine_s"), 5.0, unit="s"),
    Goal("1 M vehicles, 39,600 links: memory", Place("city-1m", OURS, "peak_mb"), 700, unit="MB"),
    Goal("Chicago-regional: engine", Place("regional", OURS, "engine_s"), 20.0, unit="s"),
    Goal("Chicago-regional: memory", Place("regional", OURS, "peak_mb"), 3000.0, unit="MB"),
    Goal(
        "Chicago-regional: an update of routes to 1,790 destinations",
        Place("regional-routes", OURS, "update_ms"),
        60.0,
        unit="ms",
    ),
    Goal(
        "Porto: an update of routes to 2,000 destinations",
        Place("porto-routes", OURS, "update_ms"),
        150.0,
        unit="ms",
    ),
    Goal(
        "time per link entry at 10,000 vehicles against that at 1 M, the grid grows",
        Place("network-10000", OURS, "entry_ns"),
        0.5,
        Place("network-1e+06", OURS, "entry_ns"),
    ),
)


def attained(records: Records, goal: Goal) -> Spread | None:
    """Where a goal's figure stands; None where it was not run."""
    if goal.per is None:
        return spread(by_round(records, goal.figure).values())
    return ratio(records, goal.figure, goal.per)


def is_met(goal: Goal, found: Spread) -> bool:
    """Tell whether the median keeps the bound."""
    return found.middle <= goal.bound if goal.per is None else found.middle >= goal.bound

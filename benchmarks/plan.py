"""What is run: the cases, which engines run each, and the series that show how cost grows."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cases
import cities

OURS, UXSIM, UXSIM_LOGS, SUMO = "uxsim-geo", "UXsim, logs off", "UXsim, logs on", "SUMO, mesoscopic"
ALL = (OURS, UXSIM, UXSIM_LOGS, SUMO)

NOBODY_BEFORE = 1e6  # s; in cases of which only the updates of routes are timed
ZONES = 200
SERIES_ROUNDS = 3

#: what the series vary: the axis of a plot, with its unit
AXES = {
    "vehicles": "vehicles, on a grid of 39,600 links",
    "network": "vehicles, on a grid that grows with them",
    "links": "links, with 100,000 vehicles",
    "destinations": "destinations, with 100,000 vehicles",
    "platoon": "Δn, vehicles a platoon, with 100,000 vehicles",
    "threads": "threads, updates of routes to 1,000 destinations",
}

TITLES = {
    "vehicles": "{:,.0f} vehicles on 39,600 links",
    "network": "{:,.0f} vehicles on a grid that grows",
    "links": "{:,.0f} links",
    "destinations": "{:,.0f} destinations",
    "platoon": "Δn {:,.0f}",
    "threads": "threads: {:,.0f}",
}


@dataclass(frozen=True)
class Case:
    """One case: tables, settings, and who runs it how often.

    updates
        where above 0, only so many updates of routes are timed, and nobody drives
    series, value
        of :data:`AXES`, and where on that axis
    files
        that must be there
    """

    key: str
    title: str
    make: Callable[[], cases.Tables]
    engines: tuple[str, ...] = (OURS,)
    rounds: int = 5
    platoon_size: int = 5
    duration: float = 7200.0
    interval: float = 600.0
    threads: int = 1
    updates: int = 0
    series: str = ""
    value: float = 0.0
    files: tuple[Path, ...] = ()

    def settings(self) -> dict[str, object]:
        """What every engine is told beside the tables.

        Beside UXsim, demand is cut to whole platoons as there, so that both move the same.
        """
        beside = UXSIM in self.engines
        return {
            "platoon_size": self.platoon_size,
            "duration": self.duration,
            "route_update_interval": self.interval,
            "demand_rounding": "truncate" if beside else "conserve",
            "threads": self.threads,
            "updates": self.updates,
        }


SKETCH = (cities.DATA / "tntp" / "Chicago-Sketch",)
REGIONAL = (cities.DATA / "tntp" / "chicago-regional",)
PORTO = (cities.DATA / "osm" / "porto_portugal.osm.pbf",)


def compared() -> list[Case]:
    """Cases that peers run too."""
    sioux, sketch = cities.sioux_falls, cities.chicago_sketch
    hours = {"duration": 10_000.0, "files": SKETCH}
    return [
        Case("sioux-falls-5", "Sioux Falls, Δn 5", sioux, ALL),
        Case("sioux-falls-1", "Sioux Falls, Δn 1", sioux, ALL[:3], 3, platoon_size=1),
        Case("grid-11", "grid 11 × 11, Δn 5", cases.grid, ALL),
        Case("sketch-30", "Chicago-Sketch, Δn 30", sketch, ALL, 3, platoon_size=30, **hours),
        Case("sketch-5", "Chicago-Sketch, Δn 5", sketch, ALL[:2], 3, **hours),
    ]


def large() -> list[Case]:
    """Cases at the size of a metropolis."""
    city = partial(cases.city, 100, ZONES, 1e6, 5400.0)
    threads = min(2, os.cpu_count() or 1)
    regional = cities.chicago_regional
    return [
        Case("city-1m", "grid 100 × 100, 1 M vehicles, 200 zones", city, rounds=3),
        Case(
            "regional",
            f"Chicago-regional, 1.3 M vehicles, {threads} threads",
            regional,
            rounds=3,
            duration=10_800.0,
            threads=threads,
            files=REGIONAL,
        ),
        _updates("regional-routes", "Chicago-regional", cities.chicago_regional_at_home, 1790),
        _updates("porto-routes", "Porto", cities.porto_at_home, 2000),
    ]


def _updates(key: str, place: str, make: Callable[..., cases.Tables], number: int) -> Case:
    title = f"{place}, an update of routes to {number:,} destinations"
    return Case(
        key,
        title,
        partial(make, number, NOBODY_BEFORE),
        rounds=3,
        duration=NOBODY_BEFORE + 100.0,
        updates=8,
        files=PORTO if place == "Porto" else REGIONAL,
    )


def series(most_vehicles: int = 1_000_000) -> list[Case]:
    """Cases that differ in one thing alone, from small to large."""
    sizes = [10, 20, 40, 70, 100]
    numbers = [10_000, 31_600, 100_000, 316_000, 1_000_000]
    made = [_point("vehicles", n, partial(cases.city, 100, ZONES, n, 5400.0)) for n in numbers]
    made += [_grown(size) for size in sizes]
    made += [
        _point("links", 4 * n * (n - 1), partial(cases.city, n, 100, 1e5, 5400.0))
        for n in (20, 32, 50, 71, 100)
    ]
    made += [
        _point("destinations", n, partial(cases.city, 50, n, 1e5, 5400.0))
        for n in (25, 50, 100, 200, 400)
    ]
    city = partial(cases.city, 32, 64, 1e5, 5400.0)
    made += [_point("platoon", n, city, platoon_size=n) for n in (1, 2, 5, 10, 20)]
    made += _on_threads()
    return [case for case in made if _vehicles(case) <= most_vehicles]


def _vehicles(case: Case) -> float:
    return case.value if case.series in ("vehicles", "network") else 0.0


def _point(name: str, value: float, make: Callable[[], cases.Tables], **more: object) -> Case:
    title = TITLES[name].format(value)
    how = {"rounds": SERIES_ROUNDS, "series": name, "value": value} | more
    return Case(f"{name}-{value:g}", title, make, **how)


def _grown(size: int) -> Case:
    """100 vehicles a node: as many on a link at a time whatever the size, for all times grow too.

    A trip is as long as the grid is wide, on the average, and so are the times of departure, the
    duration and the interval of twelve updates.
    """
    vehicles = 100 * size * size
    city = partial(cases.city, size, 2 * size, vehicles, 54.0 * size)
    times = {"duration": 72.0 * size, "interval": 6.0 * size}
    return _point("network", vehicles, city, engines=ALL[:2], **times)


def _on_threads() -> list[Case]:
    """Updates of routes alone, on one thread, two, four ... as many as the machine has cores."""

    def make() -> cases.Tables:
        return cases.at_home(cases.city(71, 2, 10.0, 100.0), 1000, NOBODY_BEFORE)

    numbers = [2**power for power in range((os.cpu_count() or 1).bit_length())]
    how = {"duration": NOBODY_BEFORE + 100.0, "updates": 8}
    return [_point("threads", number, make, threads=number, **how) for number in numbers]

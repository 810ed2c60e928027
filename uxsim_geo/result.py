"""What a simulation leaves behind: events and trips, from which everything else is derived."""

from __future__ import annotations

import html
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import pandas as pd

from uxsim_geo.events import EventLog
from uxsim_geo.settings import Settings


class Progress(NamedTuple):
    """Where a simulation stands, for those who watch it."""

    time: float  # simulated, s after the start
    duration: float  # its end, s
    vehicles_running: int  # in the network now
    vehicles_completed: int  # arrived so far
    mean_speed: float  # of the vehicles in the network, m/s; nan when there are none


@dataclass(frozen=True)
class Result:
    """Link-boundary events and trips of one simulation.

    log
        the events, in memory or in a file, for who reads them piece by piece
    events
        the same as one table, read into memory where they are in a file: one row per link entry,
        in the order of the exits: vehicle (row of ``trips``, int32), link (link_id, categorical
        with the categories in the order of the links table), enter_s, exit_s (s; NaN while on the
        link at the end)
    trips
        one row per platoon, ordered by departure, those added during the run after the others:
        vehicle (int32), origin, destination (node_id, categorical), class (of drivers,
        categorical), number (of the platoon within its OD pair and class), depart_s, enter_s
        (into the network; NaN while waiting), arrive_s (NaN until arrived), status (categorical:
        waiting, running, completed, aborted), vehicles (in this platoon), distance_m (covered so
        far), free_time_s (of the fastest route at free flow; NaN where there is none), toll (paid
        so far by each vehicle, currency)
    settings
        as the simulation was told
    engine_wall_s
        seconds the compiled core took, compilation excluded
    locked_vehicles
        vehicles on links from which, at the end, no move can ever happen again unless routes
        change: they wait for one another in circles
    notes
        what to know of the control: measures that never took effect
    speed_limits
        (time_s, link, speed_limit_m_s), from when on which limit held on a link, where that was
        not its free speed for the whole run; those who entered before keep their speed
    """

    log: EventLog
    trips: pd.DataFrame
    settings: Settings
    engine_wall_s: float
    locked_vehicles: int
    notes: tuple[str, ...] = ()
    speed_limits: pd.DataFrame = field(default_factory=pd.DataFrame)

    @cached_property
    def events(self) -> pd.DataFrame:
        """The events as one table."""
        return self.log.table()

    def _repr_html_(self) -> str:
        """What a notebook shows: how many vehicles did what."""
        vehicles = self.trips["vehicles"].groupby(self.trips["status"].astype(str)).sum()
        rows = [(f"vehicles {status}", f"{number:,.0f}") for status, number in vehicles.items()]
        rows += [
            ("link entries", f"{len(self.log):,}"),
            ("simulated", f"{self.settings.duration:,g} s"),
            ("gridlock", "yes" if self.locked_vehicles else "no"),
            ("seed", str(self.settings.seed)),
        ]
        return html_table(rows)


def html_table(rows: Iterable[tuple[str, str]]) -> str:
    """Names and values as a small table for notebooks."""
    cells = (
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
        for name, value in rows
    )
    return f"<table>{''.join(cells)}</table>"

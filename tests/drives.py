"""Results told drive by drive, and a run of the engine with trips of every fate but abortion."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from small_networks import across, grid, network

from uxsim_geo.engine.simulation import simulate
from uxsim_geo.events import EventTable
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

STATUS = ["waiting", "running", "completed", "aborted"]


class Drive(NamedTuple):
    """One platoon: from where to where, when, and (link, enter, exit) of its route.

    ``rest_m`` are the metres on a link that it has not left.
    """

    origin: str
    destination: str
    depart_s: float
    passages: Sequence[tuple[str, float, float]] = ()
    status: str = "completed"
    vehicles: int = 5
    driver_class: str = "default"
    free_time_s: float = 50.0
    toll: float = 0.0
    rest_m: float = 0.0


def result_of(of: Network, drives: Sequence[Drive], duration: float) -> Result:
    """The result in which those drives, in the order of their departures, were all there was."""
    links = of.links.set_index("link_id")["length"]
    rows = [(v, *passage) for v, drive in enumerate(drives) for passage in drive.passages]
    events = pd.DataFrame(rows, columns=["vehicle", "link", "enter_s", "exit_s"])
    events = events.astype({"vehicle": "int32", "enter_s": float, "exit_s": float})
    events["link"] = pd.Categorical(events["link"], categories=links.index)
    events = events.sort_values("exit_s", kind="stable", ignore_index=True)
    trips = [
        {
            "vehicle": vehicle,
            "origin": drive.origin,
            "destination": drive.destination,
            "class": drive.driver_class,
            "number": vehicle,
            "depart_s": drive.depart_s,
            "enter_s": drive.passages[0][1] if drive.passages else np.nan,
            "arrive_s": drive.passages[-1][2] if drive.status == "completed" else np.nan,
            "status": drive.status,
            "vehicles": drive.vehicles,
            "distance_m": drive.rest_m
            + sum(links[link] for link, _, leave in drive.passages if not np.isnan(leave)),
            "free_time_s": drive.free_time_s,
            "toll": drive.toll,
        }
        for vehicle, drive in enumerate(drives)
    ]
    table = pd.DataFrame(trips).astype({"vehicle": "int32", "vehicles": "int32"})
    for end in ("origin", "destination"):
        table[end] = pd.Categorical(table[end], categories=of.nodes["node_id"])
    table["class"] = table["class"].astype("category")
    table["status"] = pd.Categorical(table["status"], categories=STATUS)
    return Result(EventTable(events), table, Settings(duration), 0.0, 0)


@cache
def crowded_grid() -> tuple[Network, Result]:
    """More than a grid of 5 × 5 can serve in its time: some wait and some drive at the end."""
    of = network(grid(5))
    result = simulate(of, across(5, 40, 900.0), Settings(800.0, seed=3))
    assert {"waiting", "running", "completed"} <= set(result.trips["status"])
    return of, result

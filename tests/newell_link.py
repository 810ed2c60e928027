"""Small networks, and events worked out on them by Newell's theory, for tests of the analysis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.events import EventTable
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings


def network_of(rows: Sequence[dict[str, Any]], nodes: Sequence[str] = ("a", "b")) -> Network:
    """A network without geometry; every row overrides a 1 km, one-lane link from a to b."""
    usual = {
        "from_node_id": "a",
        "to_node_id": "b",
        "length": 1000.0,
        "lanes": 1,
        "free_speed": 20.0,
        "jam_density": 0.2,
        "capacity": np.nan,
        "merge_priority": 1.0,
        "road_class": "primary",
        "name": None,
        "source_id": None,
        "lanes_source": "given",
        "free_speed_source": "given",
    }
    links = [{"link_id": f"link {i}", **usual, **row} for i, row in enumerate(rows)]
    node_rows = [{"node_id": n, "zone_id": None, "control": "none"} for n in nodes]
    node_table = pd.DataFrame(node_rows).assign(through_traffic=True)[list(NODE_COLUMNS)]
    return Network(node_table, pd.DataFrame(links)[list(LINK_COLUMNS)])


def events_of(network: Network, rows: Sequence[tuple[int, int, float, float]]) -> pd.DataFrame:
    """Events from (vehicle, row of the link, enter, exit)."""
    vehicle, link, enter, leave = zip(*rows, strict=True) if rows else ((), (), (), ())
    categories = pd.Index(network.links["link_id"])
    return pd.DataFrame(
        {
            "vehicle": np.array(vehicle, np.int32),
            "link": pd.Categorical.from_codes(np.array(link, int), categories=categories),
            "enter_s": np.array(enter, float),
            "exit_s": np.array(leave, float),
        }
    )


def trips_of(rows: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Trips from a to b of one platoon of 5 each, with what each row overrides."""
    usual = {
        "origin": "a",
        "destination": "b",
        "class": "default",
        "depart_s": 0.0,
        "enter_s": np.nan,
        "arrive_s": np.nan,
        "status": "completed",
        "vehicles": 5,
        "distance_m": 0.0,
        "free_time_s": 50.0,
        "toll": 0.0,
    }
    numbered = [{"vehicle": i, "number": i, **usual, **row} for i, row in enumerate(rows)]
    table = pd.DataFrame(numbered, columns=["vehicle", "number", *usual])
    return table.astype({"status": "category", "class": "category", "vehicle": "int32"})


def result_of(
    events: pd.DataFrame,
    trips: pd.DataFrame,
    settings: Settings,
    speed_limits: pd.DataFrame | None = None,
) -> Result:
    """What a run would have left with these tables."""
    limits = pd.DataFrame() if speed_limits is None else speed_limits
    return Result(EventTable(events), trips, settings, 0.0, 0, speed_limits=limits)


def random_link(
    seed: int, link: dict[str, float], platoons: int = 40
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entry, exit and size of platoons on one link whose exit is shut at random.

    Entry and exit obey the rules of Newell's link: free-flow time, capacity at both ends, and
    storage by the hole that travels back.
    """
    random = np.random.default_rng(seed)
    length, u, lanes, jam, tau = (
        link[name] for name in ("length", "free_speed", "lanes", "jam_density", "tau")
    )
    capacity = lanes * u * jam / (1 + u * tau * jam)
    storage = max(5.0, lanes * jam * length)
    size = random.choice([5, 5, 5, 3, 1], platoons).astype(float)
    ahead = np.concatenate(([0.0], np.cumsum(size)))
    wish = np.cumsum(random.exponential(6.0, platoons))
    shut = random.choice([0.0, 0.0, 25.0], platoons)
    enter, leave = np.zeros(platoons), np.zeros(platoons)
    for k in range(platoons):
        enter[k] = wish[k]
        if k:
            enter[k] = max(enter[k], enter[k - 1] + size[k - 1] / capacity)
        freed = ahead[k + 1] - storage  # vehicles that must have left, a real number
        if freed > 0:
            j = int(np.searchsorted(ahead, freed))
            missing = (ahead[j] - freed) / capacity
            hole = max(leave[j - 1] - missing, leave[j - 2] if j > 1 else -np.inf)
            enter[k] = max(enter[k], hole + length * tau * jam, leave[j - 1])
        leave[k] = enter[k] + length / u + shut[k]
        if k:
            leave[k] = max(leave[k], leave[k - 1] + size[k - 1] / capacity)
    return enter, leave, size

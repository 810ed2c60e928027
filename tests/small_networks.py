"""Networks and demands of a few rows for the tests of the engine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.control.site import Measure
from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: a row of the links table
Row = dict[str, Any]

Q = 0.8  # veh/s: the capacity of a link as `link` makes it, 20·0.2 / (1 + 20·1·0.2)


def link(link_id: str, start: str, end: str, length: float = 1000.0, **other: object) -> Row:
    """One lane, 20 m/s, 0.2 veh/m, unless told otherwise."""
    row: Row = {
        "link_id": link_id,
        "from_node_id": start,
        "to_node_id": end,
        "length": length,
        "lanes": 1,
        "free_speed": 20.0,
        "jam_density": 0.2,
        "capacity": np.nan,
        "merge_priority": 1.0,
    }
    return row | other


def network(
    links: Iterable[Row], *, no_through: Sequence[str] = (), banned: Iterable[Sequence[str]] = ()
) -> Network:
    """``banned`` are link_ids that must not be driven one after the other, two or more of them."""
    table = pd.DataFrame(list(links))
    ids = pd.unique(pd.concat([table["from_node_id"], table["to_node_id"]]))
    through = [node not in no_through for node in ids]
    nodes = pd.DataFrame({"node_id": ids, "through_traffic": through})
    return Network(nodes, table, turns(table, banned))


def turns(links: pd.DataFrame, banned: Iterable[Sequence[str]]) -> pd.DataFrame:
    """The table of banned turns, and of paths over via links."""
    end = dict(zip(links["link_id"], links["to_node_id"], strict=True))
    rows = [(end[first], first, last, " ".join(via) or None) for first, *via, last in banned]
    columns = ["node_id", "from_link_id", "to_link_id", "via_link_ids"]
    return pd.DataFrame(rows, columns=columns, dtype="str")


def demand(*rows: tuple[str, str, float, float, float]) -> Demand:
    """Rows of origin, destination, start_s, end_s, vehicles."""
    return Demand(pd.DataFrame(rows, columns=list(DEMAND_COLUMNS)))


def grid(size: int, length: float = 300.0) -> list[Row]:
    """Two-way streets; node ids are "row,column"."""
    links = []
    for i in range(size):
        for j in range(size):
            for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if 0 <= a < size and 0 <= b < size:
                    links.append(link(f"{i},{j}-{a},{b}", f"{i},{j}", f"{a},{b}", length))
    return links


def across(size: int, vehicles: float, until: float) -> Demand:
    """From every node of each side of a grid to every node of the opposite side."""
    rows = []
    for a in range(size):
        for b in range(size):
            for start, end in (
                (f"0,{a}", f"{size - 1},{b}"),
                (f"{size - 1},{a}", f"0,{b}"),
                (f"{a},0", f"{b},{size - 1}"),
                (f"{a},{size - 1}", f"{b},0"),
            ):
                rows.append((start, end, 0.0, until, vehicles))
    return demand(*rows)


#: origin, destination, start (s), end (s), flow (veh/s)
Stream = tuple[str, str, float, float, float]


def run_streams(
    links: Iterable[Row],
    streams: Iterable[Stream],
    duration: float,
    platoon_size: int,
    *,
    control: Sequence[Measure] = (),
    **settings: Any,
) -> Result:
    """Simulate streams without randomness: platoon k departs (k + 1) Δn / flow after the start."""
    rows = [
        (origin, destination, start, end, flow * (end - start))
        for origin, destination, start, end, flow in streams
    ]
    told = Settings(duration, platoon_size, demand_rounding="truncate", **settings)
    return simulate(network(links), demand(*rows), told, control=control)


def on_link(result: Result, link_id: str) -> pd.DataFrame:
    """The events on a link in the order of the entries."""
    events = result.events[result.events["link"] == link_id]
    return events.sort_values("enter_s", kind="stable").reset_index(drop=True)


def exits(result: Result, link_id: str) -> np.ndarray:
    """Times (s) at which platoons have left a link, in their order."""
    return np.sort(on_link(result, link_id)["exit_s"].dropna().to_numpy())


def entries(result: Result, link_id: str) -> np.ndarray:
    """Times (s) at which platoons have entered a link, in their order."""
    return on_link(result, link_id)["enter_s"].to_numpy()

"""Winners and losers over all pairs of runs: of everybody, by class and zone; how much."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.inference import half_width
from uxsim_geo.analysis.comparison.moments import Moments
from uxsim_geo.analysis.comparison.winners import EDGES, arrived_in_both, distribution
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.types import Floats

#: what is known of a group of vehicles in one pair of runs
FIGURES = (
    "vehicles",
    "gaining_share",
    "losing_share",
    "little_change_share",
    "undetermined_share",
    "gained_veh_h",
    "lost_veh_h",
    "mean_change_s",
    "change_p05_s",
    "change_p50_s",
    "change_p95_s",
)

#: those of them that come with an interval
WITH_INTERVAL = ("gaining_share", "losing_share", "mean_change_s")

#: by what vehicles are put together
BY = ("all", "class", "origin_zone", "destination_zone")

HOUR = 3600.0


class WinnerTables:
    """What the trips of all pairs so far have in common."""

    def __init__(self) -> None:
        self.groups: dict[tuple[str, str], int] = {}
        self.figures = Moments.of_nothing(0, len(FIGURES))
        self.changes = Moments.of_nothing(len(EDGES) - 1, 1)
        self.statuses: dict[tuple[str, str], float] = {}
        self.pairs = 0

    def add(self, trips: pd.DataFrame) -> None:
        """Take in a pair: :func:`uxsim_geo.analysis.comparison.winners.match_trips`."""
        found = _figures_by_group(trips[~trips["outcome"].isin(["base_only", "scenario_only"])])
        for group in found:
            self.groups.setdefault(group, len(self.groups))
        # a group that a pair lacks has no vehicles there, and no shares
        empty = np.array([name == "vehicles" for name in FIGURES])
        self.figures.grow(len(self.groups), self.pairs * empty)
        values = np.where(empty, 0.0, np.full((len(self.groups), len(FIGURES)), np.nan))
        for group, row in found.items():
            values[self.groups[group]] = row
        self.figures.add(values)
        self.changes.add(distribution(trips)[:, None])
        by_status = trips.groupby(["status_base", "status_scenario"])["vehicles"].sum()
        for statuses, vehicles in zip(by_status.index.tolist(), by_status, strict=True):
            self.statuses[statuses] = self.statuses.get(statuses, 0.0) + float(vehicles)
        self.pairs += 1

    def trips(self) -> pd.DataFrame:
        """Shares and changes of every group: mean of the pairs, with intervals."""
        order = sorted(self.groups, key=lambda group: BY.index(group[0]))
        rows = [self.groups[group] for group in order]
        mean, width = self.figures.known_mean[rows], half_width(self.figures)[rows]
        columns: dict[str, Any] = {
            "group": pd.Series([group for group, _ in order], dtype="str"),
            "name": pd.Series([name for _, name in order], dtype="str"),
        }
        for number, name in enumerate(FIGURES):
            columns[name] = mean[:, number]
            if name in WITH_INTERVAL:
                columns[f"{name}_low"] = mean[:, number] - width[:, number]
                columns[f"{name}_high"] = mean[:, number] + width[:, number]
        return pd.DataFrame(columns)

    def trip_changes(self) -> pd.DataFrame:
        """Vehicles by how much their travel time changes."""
        vehicles = self.changes.mean[:, 0]
        total = vehicles.sum()
        share = vehicles / total if total > 0 else np.full(len(vehicles), np.nan)
        edges = {"from_s": EDGES[:-1], "to_s": EDGES[1:]}
        return pd.DataFrame({**edges, "vehicles": vehicles, "share": share})

    def trip_statuses(self) -> pd.DataFrame:
        """Vehicles by what became of them in both runs."""
        rows = [(*names, vehicles / self.pairs) for names, vehicles in self.statuses.items()]
        table = pd.DataFrame(rows, columns=["status_base", "status_scenario", "vehicles"])
        table = table.astype({"status_base": "str", "status_scenario": "str", "vehicles": float})
        return table.sort_values(["status_base", "status_scenario"], ignore_index=True)


def _figures_by_group(trips: pd.DataFrame) -> dict[tuple[str, str], Floats]:
    """Figures of each group of the vehicles that are in both runs."""
    found: dict[tuple[str, str], Floats] = {}
    for by in BY:
        names = pd.Series("", index=trips.index) if by == "all" else trips[by]
        codes, known = pd.factorize(names)
        chosen = trips[codes >= 0]
        if len(chosen):
            figures = _figures(chosen, Groups.of(codes[codes >= 0].astype(np.int64)))
            every = zip(known, figures, strict=True)
            found |= {(by, str(name)): row for name, row in every}
    return found


def _figures(trips: pd.DataFrame, groups: Groups) -> Floats:
    """Rows: groups; columns: :data:`FIGURES`."""
    vehicles, change = trips["vehicles"].to_numpy(float), trips["change_s"].to_numpy(float)
    outcome = trips["outcome"].to_numpy()
    exact = vehicles * arrived_in_both(trips)
    shares = [
        groups.mean((outcome == name).astype(float), vehicles)
        for name in ("gains", "loses", "little_change", "undetermined")
    ]
    sums = [
        groups.total(np.where(outcome == name, exact * sign * np.nan_to_num(change), 0.0)) / HOUR
        for name, sign in (("gains", -1.0), ("loses", 1.0))
    ]
    changes = (groups.mean(change, exact), *groups.percentiles(change, exact, (5, 50, 95)))
    return np.stack((groups.total(vehicles), *shares, *sums, *changes), axis=1)

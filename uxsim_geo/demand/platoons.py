"""From vehicles per pair and time slice to platoons, each with its departure and its identity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.rounding import round_keeping_totals
from uxsim_geo.draws import DEPARTURE, Keys, combine, text_keys, unit
from uxsim_geo.settings import Settings

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Platoons:
    """Platoons in the order of their departure; all arrays have the shape (platoons,).

    ``origin`` and ``destination`` are positions in ``node_ids``; ``number`` counts the platoons of
    a pair from 0; ``depart`` in s; ``key`` is the random identity: seed, pair and number.
    """

    node_ids: npt.NDArray[np.object_]
    origin: Ints
    destination: Ints
    number: Ints
    depart: Floats
    vehicles: Ints
    key: Keys


@np.errstate(over="ignore")  # hashes overflow by design
def make_platoons(demand: Demand, settings: Settings) -> Platoons:
    """Cut a demand into platoons of Δn vehicles.

    ``conserve``: every pair gets a whole number of vehicles such that the totals of all origins
    and destinations hold within one, and its last platoon may be smaller. A platoon departs at a
    random moment of its own share of the pair's demand over time, so departures follow the
    profile at any number of platoons. ``truncate``: every row of the demand is cut to whole
    platoons, and each departs when its last vehicle has accumulated, as in UXsim.
    """
    table = demand.table
    codes, node_ids = pd.factorize(
        np.concatenate([table["origin"].to_numpy(object), table["destination"].to_numpy(object)])
    )
    origin, destination = np.split(codes.astype(np.int64), 2)
    pair, pair_of_row = np.unique(np.stack([origin, destination]), axis=1, return_inverse=True)
    node_keys = combine(np.uint64(settings.seed), text_keys(node_ids))
    pair_keys = combine(node_keys[pair[0]], node_keys[pair[1]])
    rows = Slices.of(table, pair_of_row.reshape(-1))
    if settings.demand_rounding == "conserve":
        totals = weighted_counts(rows.group, rows.vehicles, pair.shape[1])
        whole = round_keeping_totals(totals, pair[0], pair[1], pair_keys)
        pair_of_group = np.arange(whole.size)
    else:
        totals, pair_of_group = rows.vehicles, rows.group
        whole = settings.platoon_size * _full_platoons(totals, settings.platoon_size)
        rows = Slices(np.arange(whole.size), rows.start, rows.end, rows.vehicles)
    group, before, vehicles = _cut(whole, settings.platoon_size)
    pair_of_platoon = pair_of_group[group]
    number = _count_within(pair_of_platoon)
    key = combine(pair_keys[pair_of_platoon], number.astype(np.uint64))
    if settings.demand_rounding == "conserve":
        share = (before + vehicles * unit(combine(key, DEPARTURE))) / whole[group]
    else:
        share = (before + vehicles) / totals[group]
    depart = rows.moments(group, share)
    order = np.lexsort((number, pair_of_platoon, depart))
    pair_of_platoon = pair_of_platoon[order]
    return Platoons(
        node_ids=node_ids,
        origin=pair[0][pair_of_platoon],
        destination=pair[1][pair_of_platoon],
        number=number[order],
        depart=depart[order],
        vehicles=vehicles[order],
        key=key[order],
    )


@dataclass(frozen=True)
class Slices:
    """Rows of a demand by group (a pair, or a row of its own) and time; shape (rows,)."""

    group: Ints
    start: Floats
    end: Floats
    vehicles: Floats

    @classmethod
    def of(cls, table: pd.DataFrame, group: Ints) -> Slices:
        """Order the rows of a demand table by group and time."""
        start, end, vehicles = (
            table[name].to_numpy(np.float64) for name in ("start_s", "end_s", "vehicles")
        )
        order = np.lexsort((end, start, group))
        return cls(group[order], start[order], end[order], vehicles[order])

    def moments(self, group: Ints, share: Floats) -> Floats:
        """Give the time at which a share of the vehicles of a group has departed, s.

        Slices of a group that overlap are taken one after the other by their start.
        """
        row = np.searchsorted(self.group, group, side="left")
        last_row = np.searchsorted(self.group, group, side="right") - 1
        wanted = share * weighted_counts(self.group, self.vehicles)[group]
        # slice by slice, so that no other group takes part in the sums
        while (done := (wanted >= self.vehicles[row]) & (row < last_row)).any():
            wanted -= np.where(done, self.vehicles[row], 0.0)
            row += done
        part = np.clip(wanted / self.vehicles[row], 0.0, 1.0)
        moments: Floats = self.start[row] + part * (self.end - self.start)[row]
        return moments


def weighted_counts(groups: Ints, weights: Floats, size: int = 0) -> Floats:
    """Sum the weights of every group 0, 1, …, and up to ``size`` groups if there are fewer."""
    return np.bincount(groups, weights, minlength=size).astype(np.float64)


def _full_platoons(vehicles: Floats, size: int) -> Ints:
    """Count the whole platoons in a real number of vehicles; rounding must not lose one."""
    return np.floor(vehicles / size + 1e-9).astype(np.int64)


def _cut(vehicles: Ints, size: int) -> tuple[Ints, Ints, Ints]:
    """Cut groups of vehicles into platoons: group, vehicles of the group before it, vehicles."""
    count = -(-vehicles // size)
    group = np.repeat(np.arange(vehicles.size), count)
    first = np.repeat(np.cumsum(count) - count, count)
    before = (np.arange(group.size) - first) * size
    return group, before, np.minimum(size, vehicles[group] - before)


def _count_within(values: Ints) -> Ints:
    """Number the occurrences of every value from 0, in their order."""
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    first = np.searchsorted(ordered, ordered, side="left")
    number = np.empty_like(order)
    number[order] = np.arange(order.size) - first
    return number

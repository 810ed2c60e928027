"""From vehicles per pair and time slice to platoons, each with its departure and its identity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.drivers import DEFAULT
from uxsim_geo.demand.changed_platoons import changed_platoons
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.rounding import round_keeping_totals
from uxsim_geo.draws import DEPARTURE, Keys, combine, text_keys, unit
from uxsim_geo.network.rows import count_within
from uxsim_geo.settings import Settings

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Platoons:
    """Platoons in the order of their departure; all arrays have the shape (platoons,).

    ``origin`` and ``destination`` are positions in ``node_ids``, ``driver_class`` in
    ``class_names`` and ``route`` in ``routes`` (-1: chosen on the way); ``number`` counts the
    platoons of a pair and class from 0; ``depart`` in s; ``key`` is the random identity: seed,
    pair, class and number.
    """

    node_ids: npt.NDArray[np.object_]
    class_names: tuple[str, ...]
    routes: tuple[tuple[str, ...], ...]
    origin: Ints
    destination: Ints
    driver_class: Ints
    route: Ints
    number: Ints
    depart: Floats
    vehicles: Ints
    key: Keys

    def next_numbers(self) -> dict[tuple[str, str, str], int]:
        """Number of the next platoon by origin, destination and class; from some some are gone."""
        names = zip(
            self.node_ids[self.origin],
            self.node_ids[self.destination],
            np.array(self.class_names, object)[self.driver_class],
            strict=True,
        )
        following: dict[tuple[str, str, str], int] = {}
        for name, number in zip(names, self.number.tolist(), strict=True):
            following[name] = max(following.get(name, 0), number + 1)
        return following

    def only(self, rows: npt.NDArray[Any]) -> Platoons:
        """Return some of the platoons, in the order of ``rows`` (numbers, or a flag for each)."""
        by_platoon = ("origin", "destination", "driver_class", "route", "number", "depart")
        names = (*by_platoon, "vehicles", "key")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def joined(self, more: Platoons) -> Platoons:
        """Return these platoons and more behind them."""
        nodes, codes = pd.factorize(np.concatenate([self.node_ids, more.node_ids]))[::-1]
        names, classes = pd.factorize(np.array([*self.class_names, *more.class_names], object))[
            ::-1
        ]
        own, own_names = self.node_ids.size, len(self.class_names)
        return Platoons(
            node_ids=nodes,
            class_names=tuple(names),
            routes=self.routes + more.routes,
            origin=np.concatenate([self.origin, codes[own:][more.origin]]),
            destination=np.concatenate([self.destination, codes[own:][more.destination]]),
            driver_class=np.concatenate(
                [self.driver_class, classes[own_names:][more.driver_class]]
            ),
            route=np.concatenate(
                [self.route, np.where(more.route < 0, -1, more.route + len(self.routes))]
            ),
            number=np.concatenate([self.number, more.number]),
            depart=np.concatenate([self.depart, more.depart]),
            vehicles=np.concatenate([self.vehicles, more.vehicles]),
            key=np.concatenate([self.key, more.key]),
        )


@np.errstate(over="ignore")  # hashes overflow by design
def make_platoons(
    demand: Demand, settings: Settings, taken: Mapping[tuple[str, str, str], int] | None = None
) -> Platoons:
    """Cut a demand into platoons of Δn vehicles.

    ``conserve``: every pair gets a whole number of vehicles such that the totals of all origins
    and destinations hold within one, and its last platoon may be smaller. A platoon departs at a
    random moment of its own share of the pair's demand over time, so departures follow the
    profile at any number of platoons. ``truncate``: every row of the demand is cut to whole
    platoons, and each departs when its last vehicle has accumulated, as in UXsim.

    Batches are rounded and cut apart, and numbered on from one another: the platoons of batch 0 are
    what they would be alone.

    The changes of the demand come last, so that platoons which they do not concern are the same.

    ``taken`` numbers of platoons are in use already, by origin, destination and class.
    """
    ends = _Ends.of(demand.table)
    kinds = _Kinds.of(ends)
    seed = 0 if settings.deterministic else settings.seed
    pair_keys = _pair_keys(seed, ends, kinds)
    rows = Slices.of(demand.table, kinds.group_of_row)
    if settings.demand_rounding == "conserve":
        totals = weighted_counts(rows.group, rows.vehicles, kinds.pair.size)
        keys = combine(pair_keys[kinds.pair], kinds.route.astype(np.uint64))
        keys = np.where(kinds.route < 0, pair_keys[kinds.pair], keys)
        whole = _rounded(totals, kinds, keys)
        kind_of_group = np.arange(whole.size)
    else:
        totals, kind_of_group = rows.vehicles, rows.group
        whole = settings.platoon_size * _full_platoons(totals, settings.platoon_size)
        rows = replace(rows, group=np.arange(whole.size))
    group, before, vehicles = _cut(whole, settings.platoon_size)
    kind = kind_of_group[group]
    pair = kinds.pair[kind]
    number = count_within(pair) + _numbers_taken(ends, kinds, taken)[pair]
    key = combine(pair_keys[pair], number.astype(np.uint64))
    if settings.demand_rounding == "conserve":
        chance = 0.5 if settings.deterministic else unit(combine(key, DEPARTURE))
        share = (before + vehicles * chance) / whole[group]
    else:
        share = (before + vehicles) / totals[group]
    depart, row = rows.moments(group, share)
    platoons = Platoons(
        node_ids=ends.node_ids,
        class_names=ends.class_names,
        routes=ends.routes,
        origin=kinds.origin[pair],
        destination=kinds.destination[pair],
        driver_class=kinds.driver_class[pair],
        route=kinds.route[kind],
        number=number,
        depart=depart,
        vehicles=vehicles,
        key=key,
    )
    stays, later = changed_platoons(demand.changes, row, key, settings)
    platoons = replace(platoons, depart=depart + later)
    order = np.lexsort((number, pair, platoons.depart))
    return platoons.only(order[stays[order]])


def _rounded(totals: Floats, kinds: _Kinds, keys: Keys) -> Ints:
    """Round the vehicles of every group, those of each batch as if there were no others."""
    whole = np.zeros(totals.size, np.int64)
    for batch in np.unique(kinds.batch).tolist():
        own = np.flatnonzero(kinds.batch == batch)
        pair = kinds.pair[own]
        of_batch = keys[own] if batch == 0 else combine(keys[own], np.uint64(batch))
        whole[own] = round_keeping_totals(
            totals[own], kinds.origin[pair], kinds.destination[pair], of_batch
        )
    return whole


@dataclass(frozen=True)
class _Ends:
    """Nodes, classes and routes of a demand by number, in the order in which they occur."""

    node_ids: npt.NDArray[np.object_]
    class_names: tuple[str, ...]
    routes: tuple[tuple[str, ...], ...]
    origin: Ints  # (rows,), as all below
    destination: Ints
    driver_class: Ints
    route: Ints
    batch: Ints

    @classmethod
    def of(cls, table: pd.DataFrame) -> _Ends:
        batch = np.zeros(len(table), np.int64)
        if "batch" in table:
            batch = table["batch"].to_numpy(np.int64)
        # nodes of later batches come last: they must not change the order of those before
        order = np.argsort(np.tile(batch, 2), kind="stable")
        names = np.concatenate([table[name].to_numpy(object) for name in ("origin", "destination")])
        codes, node_ids = pd.factorize(names[order])
        place = np.empty(order.size, np.int64)
        place[order] = codes
        origin, destination = np.split(place, 2)
        classes = class_of_rows(table)
        class_code, class_names = pd.factorize(classes)
        route_code, routes = pd.factorize(_routes_of_rows(table))
        return cls(
            node_ids=node_ids,
            class_names=tuple(class_names),
            routes=tuple(routes),
            origin=origin,
            destination=destination,
            driver_class=class_code.astype(np.int64),
            route=route_code.astype(np.int64),
            batch=batch,
        )


def class_of_rows(table: pd.DataFrame) -> npt.NDArray[np.object_]:
    """Return the class of drivers of every row of a demand table."""
    if "class" not in table:
        return np.full(len(table), DEFAULT, object)
    return table["class"].astype(object).where(table["class"].notna(), DEFAULT).to_numpy()


def _routes_of_rows(table: pd.DataFrame) -> npt.NDArray[np.object_]:
    """Return the route of every row, a tuple of link_ids; None where they choose."""
    routes = np.full(len(table), None, object)
    for row, route in enumerate(table.get("route", ())):
        if isinstance(route, list | tuple | np.ndarray):
            routes[row] = tuple(str(link) for link in route)
    return routes


@dataclass(frozen=True)
class _Kinds:
    """Rows that are cut into platoons together: of one pair and class, and of one route.

    origin, destination, driver_class
        (pairs,)
    pair, route, batch
        (groups,); route -1: none is given
    group_of_row
        (rows,)
    """

    origin: Ints
    destination: Ints
    driver_class: Ints
    pair: Ints
    route: Ints
    batch: Ints
    group_of_row: Ints

    @classmethod
    def of(cls, ends: _Ends) -> _Kinds:
        nodes, classes = ends.node_ids.size, len(ends.class_names)
        pair_code = (ends.origin * nodes + ends.destination) * classes + ends.driver_class
        pairs, pair_of_row = np.unique(pair_code, return_inverse=True)
        routes, batches = len(ends.routes) + 1, int(ends.batch.max(initial=0)) + 1
        batch_of_row = pair_of_row * batches + ends.batch
        groups, group_of_row = np.unique(
            batch_of_row * routes + ends.route + 1, return_inverse=True
        )
        return cls(
            origin=pairs // max(nodes * classes, 1),
            destination=pairs // max(classes, 1) % max(nodes, 1),
            driver_class=pairs % max(classes, 1),
            pair=groups // routes // batches,
            route=groups % routes - 1,
            batch=groups // routes % batches,
            group_of_row=group_of_row,
        )


def _pair_keys(seed: int, ends: _Ends, kinds: _Kinds) -> Keys:
    """Give every pair its key; those of the default class do not depend on there being others."""
    node_keys = combine(np.uint64(seed), text_keys(ends.node_ids))
    keys: Keys = combine(node_keys[kinds.origin], node_keys[kinds.destination])
    named = combine(keys, text_keys(ends.class_names)[kinds.driver_class])
    default = np.array([name == DEFAULT for name in ends.class_names], dtype=bool)
    return np.where(default[kinds.driver_class], keys, named)


def _numbers_taken(
    ends: _Ends, kinds: _Kinds, taken: Mapping[tuple[str, str, str], int] | None
) -> Ints:
    if not taken:
        return np.zeros(kinds.origin.size, np.int64)
    names = zip(
        ends.node_ids[kinds.origin],
        ends.node_ids[kinds.destination],
        np.array(ends.class_names, object)[kinds.driver_class],
        strict=True,
    )
    return np.array([taken.get(name, 0) for name in names], np.int64)


@dataclass(frozen=True)
class Slices:
    """Rows of a demand by group (a pair, or a row of its own) and time; shape (rows,).

    ``row`` is where each stands in the table.
    """

    group: Ints
    start: Floats
    end: Floats
    vehicles: Floats
    row: Ints

    @classmethod
    def of(cls, table: pd.DataFrame, group: Ints) -> Slices:
        """Order the rows of a demand table by group and time."""
        start, end, vehicles = (
            table[name].to_numpy(np.float64) for name in ("start_s", "end_s", "vehicles")
        )
        order = np.lexsort((end, start, group))
        return cls(group[order], start[order], end[order], vehicles[order], order)

    def moments(self, group: Ints, share: Floats) -> tuple[Floats, Ints]:
        """Give the time at which a share of the vehicles of a group has departed, s; and the row.

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
        return moments, self.row[row]


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

"""Which part of each row of the demand passed which count: what an adjustment to counts needs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.observations import COUNT, INTERVAL, LINK, check_observations
from uxsim_geo.analysis.subsets import check_links, node_rows
from uxsim_geo.analysis.types import Integers
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.platoons import class_of_rows
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result


def link_shares(result: Result, network: Network, demand: Demand, counts: pd.DataFrame) -> Any:
    """The part of the vehicles of every row of a demand that each count saw in a run.

    ``counts``: link_id, start_s, end_s, vehicles, as
    :func:`uxsim_geo.analysis.observations.read_counts` reads them: entries to the link from
    start_s on and before end_s. ``demand`` is the one that was simulated. Returns a sparse matrix
    (scipy csr_array) of shape (counts, rows of the demand), for
    :func:`uxsim_geo.demand.count_adjustment.adjust_to_counts`. A vehicle that enters a link twice
    counts twice.

    A trip belongs to the row of its pair and class that began last at its departure; rows alike
    in both times share theirs. Rows without any trip, as may be where few vehicles make platoons,
    have no shares.

    Raises :class:`uxsim_geo.errors.InputError` for counts that are wrong or of links that are not
    there, a result of another network, and trips that belong to no row.
    """
    from scipy.sparse import coo_array, csr_array

    check_observations(counts, LINK, COUNT).raise_if_any()
    link = _links_of(counts, network)
    cell, cells = _cells(demand)
    trip_cell = _cells_of_trips(result, network, demand, cell)
    vehicles = result.trips["vehicles"].to_numpy(float)
    made = np.bincount(trip_cell, vehicles, minlength=cells)
    check_links(result, network)
    counted = np.isin(np.arange(len(network.links)), link)
    events = result.log.some("vehicle", "link", "enter_s", links=counted)
    order = np.lexsort((events["enter_s"], events["link"]))
    first = np.searchsorted(events["link"][order], np.arange(len(network.links) + 1))
    moments, driver = events["enter_s"][order], events["vehicle"][order]
    parts = []
    times = (counts[name].to_numpy(float) for name in INTERVAL)
    for number, (row, *interval) in enumerate(zip(link, *times, strict=True)):
        own = slice(first[row], first[row + 1])
        begin, end = np.searchsorted(moments[own], interval)
        vehicle = driver[own][begin:end]
        some, place = np.unique(trip_cell[vehicle], return_inverse=True)
        seen = np.bincount(place, vehicles[vehicle], minlength=len(some))
        parts.append((np.full(len(some), number), some, seen / made[some]))
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    by_cell = csr_array(coo_array((values, (rows, columns)), shape=(len(counts), cells)))
    return csr_array(by_cell[:, cell])


def _links_of(counts: pd.DataFrame, network: Network) -> Integers:
    row = pd.Index(network.links["link_id"].astype(str)).get_indexer(
        pd.Index(counts["link_id"].astype(str))
    )
    faults = Faults(str(counts.attrs.get("source", "counts")))
    for place in np.flatnonzero(row < 0).tolist():
        line = int(counts.index[place]) if counts.index.name == "line" else None
        value = counts["link_id"].iloc[place]
        faults.add("there is no such link", line=line, column="link_id", value=value)
    faults.raise_if_any()
    return row.astype(np.int64)


def _cells(demand: Demand) -> tuple[Integers, int]:
    """Rows of one pair, class and time have one number; those of every row, and how many."""
    table = demand.table
    keys = [table["origin"].astype(str), table["destination"].astype(str)]
    keys += [pd.Series(class_of_rows(table), index=table.index), table["start_s"], table["end_s"]]
    number = pd.DataFrame(dict(enumerate(keys))).groupby(list(range(len(keys))), sort=False)
    return number.ngroup().to_numpy().astype(np.int64), int(number.ngroups)


def _cells_of_trips(result: Result, network: Network, demand: Demand, cell: Integers) -> Integers:
    """The cell of every trip: the last of its pair and class that began before it departed."""
    trips, table = result.trips, demand.table
    group = _groups(result, network, demand)
    depart = trips["depart_s"].to_numpy(float)
    is_trip = np.arange(len(group)) >= len(table)
    start, end = (
        np.concatenate((table[name].to_numpy(float), depart)) for name in ("start_s", "end_s")
    )
    order = np.lexsort((end, is_trip, start, group))
    # the last row of the demand before each place, if it is of the same group
    last = np.maximum.accumulate(np.where(is_trip[order], -1, np.arange(len(order))))
    own = order[np.maximum(last, 0)]
    lost = is_trip[order] & ((last < 0) | (group[own] != group[order]))
    faults = Faults("trips")
    for trip in (order[lost] - len(table))[:5].tolist():
        what = "is of no row of the demand: was another one simulated?"
        told = f"{trips['origin'].iloc[trip]} to {trips['destination'].iloc[trip]}"
        faults.add(f"row {trip}: {what}", column="origin, destination", value=told)
    faults.raise_if_any()
    found = np.empty(len(trips), np.int64)
    found[order[is_trip[order]] - len(table)] = cell[own[is_trip[order]]]
    return found


def _groups(result: Result, network: Network, demand: Demand) -> Integers:
    """The pair and class of every row of the demand, and then of every trip, as one number."""
    ids = pd.Index(network.nodes["node_id"].astype(str))
    keys: dict[str, object] = {}
    for end in ("origin", "destination"):
        of_rows = ids.get_indexer(pd.Index(demand.table[end].astype(str)))
        keys[end] = np.concatenate((of_rows, node_rows(result, network, end)))
    of_trips = result.trips["class"].astype(str).to_numpy(object)
    keys["class"] = np.concatenate((class_of_rows(demand.table), of_trips))
    return pd.DataFrame(keys).groupby(list(keys)).ngroup().to_numpy().astype(np.int64)

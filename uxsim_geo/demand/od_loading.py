"""From vehicles between places to the demand of a network, and what became of all of them."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.access import Access, access_of_network
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.od_table import (
    CLASS,
    DROPPED_COLUMNS,
    TIMES,
    Ends,
    OdTable,
    add_of_rows,
    ends_of,
    nothing_dropped,
    ordered,
    vehicles_of,
    with_notes,
)
from uxsim_geo.demand.spreading import NONE, REASONS, UNREACHABLE, Pairs, served_pairs
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes

#: what each reason of :data:`uxsim_geo.demand.spreading.REASONS` means
MEANING = {
    "unknown place": "trips from or to places that the network does not know were left out",
    "intrazonal": "trips that start and end in the same zone (or node) were left out",
    "no access node": "trips whose origin or destination has no node to start or end at "
    "were left out",
    "same access node": "trips between zones that start and end at the same node were left out",
    "no path": "trips from whose origin no path leads to the destination were left out",
}


class Loaded(NamedTuple):
    """The demand of a network, and where all vehicles of the OD table have gone.

    demand
        between nodes; its notes have those of the OD table, and the sum dropped for each reason
    report
        one row a place, in natural order: place, out_given, out_loaded, out_dropped, in_given,
        in_loaded, in_dropped (vehicles), why (text: how much was dropped for which reason, out
        and in)
    dropped
        one row a pair and reason: reason, origin, destination (places), vehicles
    """

    demand: Demand
    report: pd.DataFrame
    dropped: pd.DataFrame


def load_od(
    od: OdTable,
    network: Network,
    access: Access | None = None,
    *,
    unreachable: Literal["drop", "keep"] = "drop",
    unknown: Literal["fault", "drop"] = "fault",
) -> Loaded:
    """Spread vehicles between places over the nodes at which they start and end.

    A pair of zones with access nodes i and j of shares p_i and q_j sends the part
    p_i q_j / Σ p_i q_j of its vehicles from i to j, the sum over those of its pairs of different
    nodes that a path connects. So all vehicles of a pair are kept if any of its pairs of nodes
    can be driven; otherwise they are dropped, or with ``keep`` have a part of them all and will
    not arrive. ``access`` is that of the table itself, or else of the network, if None is given.
    Where a table is of a wider area than the network, ``unknown`` may be ``drop``.

    Raises :class:`uxsim_geo.errors.InputError` for a table without times
    (:func:`uxsim_geo.demand.timing.in_time` gives them) and, unless they are to be dropped, with
    every place that is not known.
    """
    access = access or od.access or access_of_network(network)
    ends = ends_of(od.table)
    _check(od, ends, None if unknown == "drop" else access)
    pairs = served_pairs(ends, access, network, keep=unreachable == "keep")
    kept = pairs.reason[pairs.of_row] == NONE
    dropped = _dropped(od, pairs)
    notes = Notes()
    _note_dropped(dropped, notes)
    _note_unreachable(od, pairs, kept, notes)
    all_notes = with_notes(with_notes(od.notes, access.notes), notes.table())
    demand = Demand(pairs.spread(od.table), all_notes)
    return Loaded(demand, _report(od.table[kept], dropped), dropped)


def _check(od: OdTable, ends: Ends, access: Access | None) -> None:
    faults = Faults(od.source)
    if not set(TIMES) <= set(od.table):
        faults.add("has no times: state the period in which its vehicles depart, and the profile")
    if access is not None:
        _add_unknown(od, ends, access, faults)
    faults.raise_if_any()


def _add_unknown(od: OdTable, ends: Ends, access: Access, faults: Faults) -> None:
    """Places that are not known, each where it stands first in the file."""
    known = access.zones.get_indexer(ends.names) >= 0
    what = "is no zone or node that is known here"
    order = np.argsort(od.table.index.to_numpy(), kind="stable")
    for end, places in (("origin", ends.origin), ("destination", ends.destination)):
        place, first = np.unique(places[order], return_index=True)
        rows = np.sort(first[~known[place]])
        unknown = np.zeros(len(order), bool)
        unknown[rows] = True
        add_of_rows(faults, od.table.iloc[order], unknown, end, what)


def _dropped(od: OdTable, pairs: Pairs) -> pd.DataFrame:
    """What the reader and the loading left out, summed by reason and pair."""
    code = pairs.reason[pairs.of_row]
    rows = (code != NONE) & (vehicles_of(od.table) > 0)
    reasons = np.array(REASONS, object)[code[rows]]
    here = od.table.loc[rows, ["origin", "destination", "vehicles"]].assign(reason=reasons)
    found = [table for table in (od.dropped, here) if len(table)]
    if not found:
        return nothing_dropped()
    table = pd.concat([part[list(DROPPED_COLUMNS)] for part in found])
    # the reason stands where a class does, so that rows of one pair and reason are summed
    summed = ordered(table.rename(columns={"reason": CLASS})).rename(columns={CLASS: "reason"})
    return summed[list(DROPPED_COLUMNS)].reset_index(drop=True)


def _note_dropped(dropped: pd.DataFrame, notes: Notes) -> None:
    for reason, total in dropped.groupby("reason")["vehicles"].sum().items():
        note = MEANING.get(str(reason), "trips that were left out on reading") + "; value: trips"
        topic, value = f"dropped: {reason}", repr(float(total))
        notes.add(topic, note, element="demand", severity="warning", value=value)


def _note_unreachable(od: OdTable, pairs: Pairs, kept: npt.NDArray[np.bool_], notes: Notes) -> None:
    """Tell of vehicles that were kept though they cannot arrive."""
    total = float(vehicles_of(od.table)[kept & pairs.unreached[pairs.of_row]].sum())
    if total > 0:
        note = "trips from whose origin no path leads to the destination were kept: "
        notes.add(
            REASONS[UNREACHABLE],
            note + "they cannot arrive; value: trips",
            element="demand",
            severity="warning",
            value=repr(total),
        )


def _report(kept: pd.DataFrame, dropped: pd.DataFrame) -> pd.DataFrame:
    both = pd.concat([kept[["origin", "destination", "vehicles"]], dropped])
    ends, vehicles = ends_of(both), vehicles_of(both)
    is_kept = np.arange(len(both)) < len(kept)
    sums = {
        name: ends.totals(np.where(chosen, vehicles, 0.0))
        for name, chosen in (("loaded", is_kept), ("dropped", ~is_kept))
    }
    columns: dict[str, object] = {"place": ends.names}
    for side, end in enumerate(("out", "in")):
        columns[f"{end}_given"] = sums["loaded"][side] + sums["dropped"][side]
        columns |= {f"{end}_{name}": sums[name][side] for name in ("loaded", "dropped")}
    return pd.DataFrame(columns).assign(why=_why(ends.names, dropped))


def _why(places: pd.Index[str], dropped: pd.DataFrame) -> pd.Series[str]:
    """Text such as ``intrazonal: out 2.5, in 2.5; no path: in 3`` for every place."""
    told: dict[str, list[str]] = {}
    for reason, rows in dropped.groupby("reason", sort=True):
        sums: dict[str, list[str]] = {}
        for end, column in (("out", "origin"), ("in", "destination")):
            for place, total in rows.groupby(column)["vehicles"].sum().items():
                sums.setdefault(str(place), []).append(f"{end} {float(total):.6g}")
        for place, parts in sums.items():
            told.setdefault(place, []).append(f"{reason}: {', '.join(parts)}")
    return pd.Series(["; ".join(told.get(place, [])) for place in places], dtype="str")

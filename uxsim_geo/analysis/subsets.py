"""Which vehicles, links and nodes are meant: what the tables of trips ask at their door.

Vehicles are named by their rows in the trips: the users that a selection gives, or those of a
class, ``np.flatnonzero(result.trips["class"] == "truck")``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.types import Booleans, Integers
from uxsim_geo.errors import Faults, did_you_mean
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: unknown names for which those nearest to them are looked for, which takes long in large networks
SUGGESTED = 5

#: links of a street that a message names
LINKS_TOLD = 5


def chosen_vehicles(trips: pd.DataFrame, vehicles: npt.ArrayLike | None) -> Booleans:
    """Whether each row of ``trips`` is among ``vehicles`` (its rows; None: all of them).

    Raises :class:`uxsim_geo.errors.InputError` if ``vehicles`` is empty or not among the trips.
    """
    if vehicles is None:
        return np.ones(len(trips), bool)
    rows = np.asarray(vehicles)
    faults = Faults()
    if rows.size == 0:
        faults.add("names nobody: choose one at least, or leave it out for all", column="vehicles")
    elif not np.issubdtype(rows.dtype, np.integer):
        what = "must hold rows of the trips, whole numbers"
        faults.add(what, column="vehicles", value=rows.dtype)
    else:
        absent = np.unique(rows[(rows < 0) | (rows >= len(trips))])
        if absent.size:
            what = f"{absent.size:,} of them are no trips: those are 0 to {len(trips) - 1:,}"
            faults.add(what, column="vehicles", value=", ".join(map(str, absent[:20])))
    faults.raise_if_any()
    chosen = np.zeros(len(trips), bool)
    chosen[rows] = True
    return chosen


def named_rows(
    names: str | Iterable[str],
    known: pd.Index,
    argument: str,
    streets: pd.Series[str] | None = None,
) -> Integers:
    """The place of each name among the ``known``, ascending and once each.

    ``argument`` is what the user calls the names, such as ``links``; ``streets`` are names of
    streets, as long as ``known``, for who gives one of them in place of ids. Raises
    :class:`uxsim_geo.errors.InputError` if there are none, or with all that are not known.
    """
    faults = Faults()
    if not isinstance(names, Iterable):
        faults.add("must be a name, or several", column=argument, value=names)
    faults.raise_if_any()
    asked = list(dict.fromkeys([names] if isinstance(names, str) else names))
    rows = known.get_indexer(pd.Index(asked, dtype=object))
    if not asked:
        faults.add("is empty: name one at least", column=argument)
    for number, name in enumerate(name for name, row in zip(asked, rows, strict=True) if row < 0):
        advice = _advice(str(name), known, streets) if number < SUGGESTED else ""
        faults.add(f"there is none of this name{advice}", column=argument, value=name)
    faults.raise_if_any()
    return np.sort(rows).astype(np.int64)


def _advice(name: str, known: pd.Index, streets: pd.Series[str] | None) -> str:
    """What was meant: links of a street of this name, or names that are near."""
    found = (
        [] if streets is None else known[(streets == name).to_numpy(bool, na_value=False)].tolist()
    )
    if found:
        more = f" and {len(found) - LINKS_TOLD:,} more" if len(found) > LINKS_TOLD else ""
        return f", it is a street: its links are {', '.join(found[:LINKS_TOLD])}{more}"
    return did_you_mean(name, known.astype(str))


def rows_in_order(network: Network, links: Sequence[str]) -> Integers:
    """Rows of the links table of some link_ids, one for each, in the order in which they are given.

    Raises :class:`uxsim_geo.errors.InputError` if there are none, or with all that are not there.
    """
    rows_of_links(network, links)
    known = pd.Index(network.links["link_id"].astype(str))
    return known.get_indexer(pd.Index(links, dtype=object)).astype(np.int64)


def rows_of_links(network: Network, links: str | Iterable[str] | None) -> Integers:
    """Rows of the links table of some link_ids (None: all), ascending and once each.

    Errors as of :func:`named_rows`.
    """
    if links is None:
        return np.arange(len(network.links))
    streets = network.links.get("name")
    return named_rows(links, pd.Index(network.links["link_id"].astype(str)), "links", streets)


def check_links(result: Result, network: Network) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` if the events are of another network."""
    if result.log.link_ids.tolist() != network.links["link_id"].astype(str).tolist():
        faults = Faults("events")
        faults.add("its links are not those of the network: is it of another run?", column="link")
        faults.raise_if_any()


def names_of(rows: Integers, ids: pd.Series) -> pd.Categorical[str]:
    """The ids of rows of the nodes or links table, as categories in the order of that table."""
    return pd.Categorical.from_codes(rows, categories=pd.Index(ids.astype(str)))


def node_rows(result: Result, network: Network, end: str) -> Integers:
    """The row of the nodes table of every trip's ``end``: origin or destination.

    Raises :class:`uxsim_geo.errors.InputError` if the trips are of another network.
    """
    names = pd.Categorical(result.trips[end])
    ids = pd.Index(network.nodes["node_id"].astype(str))
    rows = ids.get_indexer(names.categories.astype(str))[names.codes]
    if (rows < 0).any():
        faults = Faults("trips")
        lost = names.astype(str)[np.argmax(rows < 0)]
        what = "is no node of the network: is it of another run?"
        faults.add(what, column=end, value=lost)
        faults.raise_if_any()
    return np.asarray(rows, np.int64)

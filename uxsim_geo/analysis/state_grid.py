"""States of links in time bins as arrays of links × bins, checked to be such a grid.

Figures of several links or bins together are sums over whole rows or columns of that grid. A table
that somebody has filtered or sorted is none, and would give wrong ones without a word.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.analysis.kept_states import LinkStates
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network

#: a table, or what one is made of
States = pd.DataFrame | LinkStates

GRID = ("link_id", "begin_s", "end_s")


@dataclass(frozen=True)
class StateGrid:
    """States as :mod:`uxsim_geo.analysis.link_states` gives them.

    link_ids (text, as often as links), begin and end (of the bins, s)
    """

    states: States
    link_ids: pd.Index[str]
    begin: Floats
    end: Floats

    @classmethod
    def of(cls, states: States) -> StateGrid:
        """Look at all bins of all links that the table names.

        Raises :class:`uxsim_geo.errors.InputError` if the rows are not those of every link in every
        bin, link by link.
        """
        if isinstance(states, LinkStates):
            return cls(states, states.ids[states.rows], states.edges[:-1], states.edges[1:])
        faults = Faults("states")
        for name in (name for name in GRID if name not in states.columns):
            faults.add("there is no such column: take what link_times returns", column=name)
        if not len(states):
            faults.add("holds no rows")
        faults.raise_if_any()
        link, names = _codes(states["link_id"])
        bins = int(np.argmax(np.append(link[1:] != link[:-1], True))) + 1
        begin, end = (states[name].to_numpy(float) for name in ("begin_s", "end_s"))
        if not (_is_grid(link, bins) and _repeats(begin, bins) and _repeats(end, bins)):
            faults.add(
                "must hold each of its links in each of its time bins, link by link, as link_times "
                "returns them: choose links and bins by its arguments, and do not sort the rows"
            )
        faults.raise_if_any()
        return cls(states, names[link[::bins]], begin[:bins], end[:bins])

    @classmethod
    def of_all(cls, states: States, network: Network) -> StateGrid:
        """As :meth:`of`; raises unless it holds all links of the network, in its order."""
        grid = cls.of(states)
        check_all_links(grid.link_ids, network, "states")
        return grid

    def values(self, column: str) -> Floats:
        """A column of numbers; shape (links, bins)."""
        if isinstance(self.states, LinkStates):
            return self.states.values(column)
        return self.states[column].to_numpy(float).reshape(len(self.link_ids), -1)

    def table_of(self, bins: slice) -> pd.DataFrame:
        """The table of some of the bins, link by link."""
        if isinstance(self.states, LinkStates):
            return self.states.table(bins=bins)
        rows = np.arange(len(self.states)).reshape(len(self.link_ids), -1)[:, bins]
        return self.states.iloc[rows.ravel()].reset_index(drop=True)

    def rows_in(self, network: Network) -> Integers:
        """The row of each link in the network's table.

        Raises :class:`uxsim_geo.errors.InputError` for a link that the network lacks.
        """
        rows = pd.Index(network.links["link_id"].astype(str)).get_indexer(self.link_ids)
        faults = Faults("states")
        for name in self.link_ids[rows < 0]:
            faults.add("the network has no such link", column="link_id", value=name)
        faults.raise_if_any()
        return rows.astype(np.int64)


def check_all_links(link_ids: pd.Index[str], network: Network, source: str) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` unless these are the network's, in its order."""
    if link_ids.tolist() != network.links["link_id"].astype(str).tolist():
        faults = Faults(source)
        what = "must hold all links of the network, in the order of its table"
        faults.add(what, column="link_id")
        faults.raise_if_any()


def _codes(link_id: pd.Series) -> tuple[Integers, pd.Index[str]]:
    """A number for the link of every row, and the names that the numbers stand for."""
    if isinstance(link_id.dtype, pd.CategoricalDtype):
        codes, names = link_id.cat.codes.to_numpy(), link_id.cat.categories
    else:
        codes, names = pd.factorize(link_id)
    return codes.astype(np.int64), pd.Index(names.astype(str))


def _is_grid(link: Integers, bins: int) -> bool:
    """Whether blocks of so many rows are of one link each, and of another one every time."""
    if len(link) % bins:
        return False
    blocks = link.reshape(-1, bins)
    first = blocks[:, 0]
    return bool((blocks == first[:, None]).all()) and len(np.unique(first)) == len(first)


def _repeats(moments: Floats, bins: int) -> bool:
    """Whether the moments ascend over so many rows, and are the same in all such blocks."""
    blocks = moments.reshape(-1, bins)
    return bool((blocks == blocks[0]).all() and (np.diff(blocks[0]) > 0).all())

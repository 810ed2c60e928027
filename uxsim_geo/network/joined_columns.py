"""What a joined link has in each column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.network.incidence import Flags, Floats, Rows
from uxsim_geo.network.rows import numbers

#: columns that hold for the end of a link
OF_THE_LAST = ("turn_lanes", "to_node_id")

#: lists with blanks between; a node that ends one piece and begins the next stands once
LISTS = ("source_node_ids",)

#: columns made elsewhere
OTHERS = ("link_id", "from_node_id", "to_node_id", "length", "free_speed", "geometry")


@dataclass(frozen=True)
class Groups:
    """Rows of links in the order of their chains.

    order
        rows, chain after chain; (links,)
    begin, size
        place in ``order`` of each chain's first link, and how many it has; (chains,)
    """

    order: Rows
    begin: Rows
    size: Rows

    @classmethod
    def of(cls, head: Rows, place: Rows) -> Groups:
        """Group links by the first of their chain; chains stand where their first link stood."""
        order = np.lexsort((place, head))
        begin = np.flatnonzero(np.diff(head[order], prepend=-1))
        return cls(order, begin, np.diff(np.append(begin, len(order))))

    @property
    def first(self) -> Rows:
        """Row of the first link of each chain."""
        return self.order[self.begin]

    @property
    def last(self) -> Rows:
        """Row of the last link of each chain."""
        return np.asarray(self.order[self.begin + self.size - 1])

    @property
    def number(self) -> Rows:
        """Number of the chain of each place in ``order``."""
        return np.repeat(np.arange(len(self.size)), self.size)

    @property
    def of_link(self) -> Rows:
        """Number of the chain of each link."""
        number = np.empty(len(self.order), dtype=np.int64)
        number[self.order] = self.number
        return number

    def sums(self, values: Floats) -> Floats:
        """Sum over each chain; the same in both directions of a road, to the last bit."""
        order = self.order[np.lexsort((values[self.order], self.number))]
        return np.asarray(np.add.reduceat(values[order], self.begin))

    def least(self, values: Any) -> Any:
        """The least value of each chain."""
        return np.minimum.reduceat(values[self.order], self.begin)

    def greatest(self, values: Any) -> Any:
        """The greatest value of each chain."""
        return np.maximum.reduceat(values[self.order], self.begin)


def joined_columns(table: pd.DataFrame, groups: Groups, kind: Rows) -> dict[str, Any]:
    """Values of the columns that a joined link does not simply have from its first piece.

    Numbers and flags are those of the kind with the greatest length in the chain; texts stand
    side by side with ``; `` between where they differ; ``*_source`` is assumed if one was.
    """
    main = _main_rows(table, groups, kind)
    columns: dict[str, Any] = {}
    for name in table.columns:
        if name in OTHERS:
            continue
        column = table[name]
        if name in OF_THE_LAST:
            columns[name] = column.iloc[groups.last].to_numpy()
        elif name == "road_class" or not _is_text(column):
            columns[name] = column.iloc[main].to_numpy()
        else:
            columns[name] = _texts(column, groups)
    return columns


def _is_text(column: pd.Series) -> bool:
    return isinstance(column.dtype, pd.StringDtype) or column.dtype == object


def _main_rows(table: pd.DataFrame, groups: Groups, kind: Rows) -> Rows:
    """A row of the kind with the greatest length, of each chain; the first of that kind."""
    length = numbers(table["length"])[groups.order]
    number, kinds = groups.number, kind[groups.order]
    pair = number * (int(kind.max()) + 1) + kinds
    _, first, inverse = np.unique(pair, return_index=True, return_inverse=True)
    total = np.round(np.bincount(inverse, weights=length), 3)
    order = np.lexsort((kinds[first], -total, number[first]))
    best = order[np.flatnonzero(np.diff(number[first][order], prepend=-1))]
    return np.asarray(groups.order[first[best]])


def _texts(column: pd.Series, groups: Groups) -> pd.Series:
    """The text of each chain: the one that all pieces have, or all that they have."""
    codes, names = pd.factorize(column)
    differs: Flags = groups.least(codes) != groups.greatest(codes)
    values = column.iloc[groups.first].tolist()
    if column.name in LISTS:
        differs = groups.size > 1
    for chain in np.flatnonzero(differs).tolist():
        begin = int(groups.begin[chain])
        rows = groups.order[begin : begin + int(groups.size[chain])]
        found = [names[code] for code in codes[rows].tolist() if code >= 0]
        values[chain] = _together(str(column.name), found)
    return pd.Series(values, dtype="str")


def _together(name: str, found: list[str]) -> str | None:
    if name.endswith("_source"):
        return "assumed" if "assumed" in found else found[0]
    if name not in LISTS:
        parts = [part for text in found for part in text.split("; ")]
        return "; ".join(dict.fromkeys(parts))
    along: list[str] = []
    for ids in found:
        names = ids.split()
        along.extend(names[1:] if along and along[-1] == names[0] else names)
    return " ".join(along)

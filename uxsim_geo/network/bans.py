"""Banned turns as rows of ``movements``: which links each names, and rows made of links."""

from __future__ import annotations

from collections.abc import Set as AbstractSet

import numpy.typing as npt
import pandas as pd

#: column of banned turns that some tables have: link_ids with blanks between them, or null
VIA_COLUMN = "via_link_ids"

#: rows of links, one after the other
Way = tuple[int, ...]


def beginning_after(way: Way, banned: AbstractSet[Way], beginnings: AbstractSet[Way]) -> Way | None:
    """What has to be remembered after a way: the longest beginning of a ban that it ends with.

    Empty if there is none, and None if the way ends with a ban (Aho and Corasick 1975).
    """
    endings = [way[place:] for place in range(len(way))]
    if not banned.isdisjoint(endings):
        return None
    return next((ending for ending in endings if ending in beginnings), ())


def via_links(movements: pd.DataFrame) -> list[list[str]]:
    """Return the via links of every row of banned turns; of turns at a node there are none."""
    if VIA_COLUMN not in movements:
        return [[] for _ in range(len(movements))]
    texts = movements[VIA_COLUMN].astype("object").fillna("")
    return [str(text).split() for text in texts]


def ban_paths(movements: pd.DataFrame) -> list[tuple[str, ...]]:
    """Ids of the links that each ban names, from the first to the last."""
    first, last = (movements[f"{end}_link_id"].astype("str") for end in ("from", "to"))
    columns = (first, via_links(movements), last)
    return [(one, *between, other) for one, between, other in zip(*columns, strict=True)]


def ban_rows(
    movements: pd.DataFrame,
    node_ids: npt.ArrayLike,
    before: npt.ArrayLike,
    after: npt.ArrayLike,
    why: str,
) -> pd.DataFrame:
    """Rows for ``movements``, with its columns, that ban going on from links to others.

    ``before`` and ``after`` are link_ids, ``node_ids`` those of the nodes between them; ``why``
    goes into the column restriction, if there is one.
    """
    columns = {"node_id": node_ids, "from_link_id": before, "to_link_id": after}
    table = pd.DataFrame(columns, dtype="str").assign(restriction=why)
    return table.reindex(columns=movements.columns).astype("str")

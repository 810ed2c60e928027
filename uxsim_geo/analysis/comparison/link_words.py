"""What changes on links, in sentences: on how many, and on which streets most."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import pandas as pd

from uxsim_geo.analysis.comparison.numbers import with_interval

#: links that are named
MOST_LINKS = 3


class _Told(NamedTuple):
    """A quantity of links: what is said of it, and what change of a link is not worth it."""

    name: str
    title: str
    unit: str
    more: str
    less: str
    little: float


TOLD_OF_LINKS = (
    _Told("volume_veh", "Volume", "veh", "More vehicles take", "Fewer take", 1.0),
    _Told(
        "delay_veh_h",
        "Delay",
        "veh·h",
        "Most delay is added on",
        "Most delay is saved on",
        0.05,
    ),
)


def links_in_sentences(links: pd.DataFrame) -> Iterator[str]:
    """Links of one network alone; then what changes on the others."""
    for side in ("base", "scenario"):
        alone = links[links["exists"] == side].to_dict("records")
        if alone:
            some = ", ".join(map(link_in_words, alone[:MOST_LINKS]))
            some += ", …" if len(alone) > MOST_LINKS else ""
            count = f"{len(alone):,} link{'s' if len(alone) > 1 else ''} ({some})"
            yield f"In the {side} alone: {count}; no differences are told of them."
    for told in TOLD_OF_LINKS:
        yield from _changes(links, told)


def _changes(links: pd.DataFrame, told: _Told) -> Iterator[str]:
    """On how many links a quantity changes for sure, and on which of them most."""
    name = told.name
    known = links[links[f"{name}_difference"].notna()]
    if known[f"{name}_p"].notna().any():
        sure = known[f"{name}_significant"].fillna(False).astype(bool).sum()
        own = (known[f"{name}_low"] > 0) | (known[f"{name}_high"] < 0)
        yield (
            f"{told.title} changes for sure on {sure:,} of {len(known):,} links; on {own.sum():,} "
            "its own 95 % interval leaves out 0, as chance alone makes it on up to 5 %."
        )
        known = known[own]
    for words, sign in ((told.more, 1.0), (told.less, -1.0)):
        named = [_link(row, told) for row in _most_changed(known, told, sign)]
        if named:
            yield f"{words} {'; '.join(named)}."


def _most_changed(links: pd.DataFrame, told: _Told, sign: float) -> Iterator[Mapping[Any, Any]]:
    """Yield the links on which it rises (+1) or falls (−1) most, one of each street."""
    change = sign * links[f"{told.name}_difference"]
    order = change[change >= told.little].sort_values(ascending=False, kind="stable").index
    seen: set[str] = set()
    for at in order:
        row = links.loc[at].to_dict()
        street = row["name"] if isinstance(row["name"], str) else row["link_id"]
        if street not in seen:
            seen.add(street)
            yield row
        if len(seen) == MOST_LINKS:
            return


def _link(row: Mapping[Any, Any], told: _Told) -> str:
    change, *ends = (row[f"{told.name}_{end}"] for end in ("difference", "low", "high"))
    return f"{link_in_words(row)} {with_interval(change, (ends[0], ends[1]), told.unit)}"


def link_in_words(row: Mapping[Any, Any] | pd.Series) -> str:
    """Its street, or its id where it has none."""
    return row["name"] if isinstance(row["name"], str) else str(row["link_id"])

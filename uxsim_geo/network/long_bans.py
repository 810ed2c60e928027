"""Bans that hold for those who came along certain links: what lies behind one counts.

Links with what lies behind them are the states of a search for words in a text, the bans being
the words and the links of a way the letters (Aho and Corasick, 1975).
"""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from uxsim_geo.network.network import Network

#: rows of links, the last being the one that one is on
Path = tuple[int, ...]


@dataclass(frozen=True)
class LongBans:
    """Bans of paths of three and more links, by rows of links.

    states
        beginnings of bans, of two links and more
    of_link
        by link: the bans that name it
    """

    bans: frozenset[Path]
    states: frozenset[Path]
    of_link: dict[int, list[Path]]

    @classmethod
    def of(cls, network: Network) -> LongBans:
        """The bans of a network that name links between."""
        row = {link_id: row for row, link_id in enumerate(network.links["link_id"])}
        paths = ban_paths(network.movements)
        bans = frozenset(tuple(row[name] for name in path) for path in paths if len(path) > 2)
        of_link: dict[int, list[Path]] = {}
        for ban in sorted(bans):
            for link in ban:
                of_link.setdefault(link, []).append(ban)
        states = frozenset(ban[:size] for ban in bans for size in range(2, len(ban)))
        return cls(bans, states, of_link)

    def onward(self, state: Path, link: int) -> Path | None:
        """The state on a link that one comes to from a state; None if a ban says no."""
        if not self.bans:
            return (link,)
        behind = [(*state, link)[cut:] for cut in range(len(state))]
        if not self.bans.isdisjoint(behind):
            return None
        return next((tail for tail in behind if tail in self.states), (link,))


def ban_paths(movements: pd.DataFrame) -> list[tuple[str, ...]]:
    """Ids of the links that each ban names, from the first to the last."""
    has_via = "via_link_ids" in movements
    via = movements["via_link_ids"].fillna("") if has_via else [""] * len(movements)
    columns = (movements["from_link_id"], via, movements["to_link_id"])
    return [(first, *between.split(), last) for first, between, last in zip(*columns, strict=True)]

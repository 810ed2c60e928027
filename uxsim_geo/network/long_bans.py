"""Bans that hold for those who came along certain links: what lies behind one counts.

Links with what lies behind them are the states of a search for words in a text, the bans being
the words and the links of a way the letters (Aho and Corasick, 1975).
"""

from __future__ import annotations

from dataclasses import dataclass

from uxsim_geo.network.bans import beginning_after
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import banned_paths

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
        bans = frozenset(path for path in banned_paths(network) if len(path) > 2)
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
        behind = beginning_after((*state, link), self.bans, self.states)
        return None if behind is None else behind or (link,)

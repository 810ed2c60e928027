"""How work that takes a while tells how far it has come."""

from __future__ import annotations

from collections.abc import Callable

#: called with what is being done and the share of the whole that is done, 0 to 1
Telling = Callable[[str, float], None]


def silent(_what: str, _share: float) -> None:
    """Progress that nobody watches."""

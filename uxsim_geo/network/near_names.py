"""What to say of a name that is not known: those that are written nearly alike."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """``; did you mean a or b?``, of the three known names nearest to one; empty if none is."""
    near = difflib.get_close_matches(name, list(known), n=3)
    return f"; did you mean {' or '.join(sorted(near))}?" if near else ""

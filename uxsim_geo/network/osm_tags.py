"""Tags of OpenStreetMap elements, and what reading them gives rise to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

Tags = Mapping[str, str]


@dataclass(frozen=True)
class Remark:
    """What was found on a way and how it was dealt with; ``value`` is what stood there."""

    topic: str
    note: str
    value: str


def oriented(key: str, direction: str) -> tuple[str, str]:
    """The keys that say something of one direction, the more specific first."""
    return f"{key}:{direction}", key


def values(text: str) -> list[str]:
    """The values of a list such as ``psv;bicycle``, in small letters."""
    return [part.strip() for part in text.lower().split(";") if part.strip()]

"""Counter-based random numbers: every draw is a hash of what it is for.

A draw depends on the seed, on whom it concerns (by the ids of the source data) and on a counter,
never on how many draws came before. So a change in one place leaves every draw elsewhere as it
was, and the order in which things are computed does not matter.

The hash is the finalizer of splitmix64 (Steele, Lea and Flood 2014, "Fast splittable
pseudorandom number generators"), chained. The functions take numpy scalars and arrays alike; the
engine compiles the same functions.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

Keys = npt.NDArray[np.uint64]

# purposes, one a kind of draw
CHOICE = np.uint64(0x1)
MERGE = np.uint64(0x2)
NOISE = np.uint64(0x3)
DEPARTURE = np.uint64(0x4)
ROUNDING = np.uint64(0x5)
INFORMED = np.uint64(0x6)
COMPLIANCE = np.uint64(0x7)
ENFORCED = np.uint64(0x8)
STAYS = np.uint64(0x9)
MOVED = np.uint64(0xA)

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_UNIT = 1.0 / 9007199254740992.0  # 2^-53


def combine(key: Any, other: Any) -> Any:
    """Hash two 64-bit keys (uint64, of any shape) into one."""
    mixed = (key ^ _SECOND) + other * _GOLDEN + _GOLDEN
    mixed = (mixed ^ (mixed >> _30)) * _FIRST
    mixed = (mixed ^ (mixed >> _27)) * _SECOND
    return mixed ^ (mixed >> _31)


def unit(key: Any) -> Any:
    """Turn 64-bit keys (uint64, of any shape) into numbers of [0, 1)."""
    return (key >> _11) * _UNIT


def text_keys(texts: Iterable[str]) -> Keys:
    """Give every id a 64-bit key that depends on its text alone; shape (n,)."""
    digests = [hashlib.blake2b(text.encode(), digest_size=8).digest() for text in texts]
    return np.frombuffer(b"".join(digests), dtype="<u8").astype(np.uint64)

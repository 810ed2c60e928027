"""What control can change: one array a quantity, written in place."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.errors import Faults

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]


class Levers:
    """The quantities that control sets. Links and nodes stand in the order of their tables.

    exit_capacity, entry_capacity
        (links,) veh/s that may leave, or enter, a link; the link's own capacity at the start; 0
        holds everybody, inf sets no limit
    entry_closed, exit_closed
        (links,) nobody may enter the link; nobody may leave it
    speed_limit
        (links,) m/s, for those who enter from now on; the free speed at the start
    merge_priority
        (links,) weight > 0
    toll
        (links,) currency, paid on entry
    banned
        (classes, links) drivers of this class may not use the link
    advice
        (classes, links) s that those who follow advice add to the cost of the link: above 0 to
        avoid it, below 0 to prefer it
    node_capacity
        (nodes,) veh/s from link to link over the node; inf: no limit
    plan
        (nodes,) number of the signal plan in force, -1: none. Set by signals.
    phase
        (nodes,) phase of that plan that is held, counted from 0; -1: the plan runs by itself

    An array is written to in place: ``levers.toll[7] = 2.5``, or as a whole: ``levers.toll = x``.
    """

    __slots__ = (
        "advice",
        "banned",
        "entry_capacity",
        "entry_closed",
        "exit_capacity",
        "exit_closed",
        "merge_priority",
        "node_capacity",
        "phase",
        "plan",
        "speed_limit",
        "toll",
    )

    exit_capacity: Floats
    entry_capacity: Floats
    entry_closed: Flags
    exit_closed: Flags
    speed_limit: Floats
    merge_priority: Floats
    toll: Floats
    banned: Flags
    advice: Floats
    node_capacity: Floats
    plan: Ints
    phase: Ints

    def __init__(self, arrays: dict[str, npt.NDArray[np.generic]]) -> None:
        for name in QUANTITIES:
            object.__setattr__(self, name, np.array(arrays[name]))

    def __setattr__(self, name: str, value: object) -> None:
        if name not in QUANTITIES:
            near = difflib.get_close_matches(name, QUANTITIES, n=1)
            advice = f"did you mean {near[0]}?" if near else f"there are {', '.join(QUANTITIES)}"
            raise AttributeError(f"control cannot set {name}; {advice}")
        getattr(self, name)[...] = value

    def copy(self) -> Levers:
        """Return the same values in arrays of their own."""
        return Levers({name: getattr(self, name) for name in QUANTITIES})

    def differences(self, other: Levers) -> set[str]:
        """Return the quantities that are not the same everywhere."""
        # bytes are compared since that takes a tenth of the time; there are no NaNs
        return {
            name
            for name in QUANTITIES
            if getattr(self, name).tobytes() != getattr(other, name).tobytes()
        }

    def add_faults(
        self, faults: Faults, ids: dict[str, tuple[str, ...]], quantities: Collection[str]
    ) -> None:
        """Note every value that no road can have; ``ids`` names ``links`` and ``nodes``."""
        for name in sorted(_LIMITS.keys() & set(quantities)):
            good, what = _LIMITS[name]
            values = getattr(self, name)
            wrong = ~good(values)
            if not wrong.any():
                continue
            element = "nodes" if name in NODE_QUANTITIES else "links"
            for place in np.argwhere(wrong):
                where = f"{name} of {element[:-1]} {ids[element][place[-1]]}"
                faults.add(f"{what} ({where})", value=float(values[tuple(place)]))


QUANTITIES: tuple[str, ...] = Levers.__slots__
NODE_QUANTITIES = ("node_capacity", "phase", "plan")
CLASS_QUANTITIES = ("banned", "advice")

#: by quantity: what is good, and what to say of the rest
_LIMITS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "exit_capacity": (lambda x: x >= 0, "must be 0 or more, veh/s"),
    "entry_capacity": (lambda x: x >= 0, "must be 0 or more, veh/s"),
    "speed_limit": (lambda x: (x > 0) & (x < np.inf), "must be a finite number above 0, m/s"),
    "merge_priority": (lambda x: (x > 0) & (x < np.inf), "must be a finite number above 0"),
    "toll": (lambda x: (x >= 0) & (x < np.inf), "must be a finite number of 0 or more"),
    "advice": (np.isfinite, "must be a finite number of seconds"),
    "node_capacity": (lambda x: x >= 0, "must be 0 or more, veh/s"),
    "phase": (lambda x: x >= -1, "must be a phase, or -1"),
}

"""Units as people write them in a configuration: ``km``, ``0.01 h``, ``veh/h/lane``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Quantity = Literal["length", "time", "speed", "capacity"]

#: metres
LENGTHS = {"m": 1.0, "km": 1000.0, "ft": 0.3048, "mi": 1609.344}

#: seconds
TIMES = {"s": 1.0, "min": 60.0, "h": 3600.0, "day": 86400.0}

#: metres a second
SPEEDS = {f"{way}/{time}": LENGTHS[way] / TIMES[time] for way in LENGTHS for time in TIMES} | {
    "mph": LENGTHS["mi"] / TIMES["h"],
    "kmh": LENGTHS["km"] / TIMES["h"],
}

#: vehicles a second
CAPACITIES = {f"veh/{time}": 1.0 / TIMES[time] for time in TIMES} | {"vph": 1.0 / TIMES["h"]}

UNITS: dict[Quantity, dict[str, float]] = {
    "length": LENGTHS,
    "time": TIMES,
    "speed": SPEEDS,
    "capacity": CAPACITIES,
}

PER_LANE = "/lane"

#: from SI to what people read: km/h in 1 m/s, 1/h in 1/s, 1/km in 1/m
KMH, PER_HOUR, PER_KM = 3.6, 3600.0, 1000.0


@dataclass(frozen=True)
class Unit:
    """What one unit of a column is worth in SI (m, s, m/s or veh/s), and whether it is per lane."""

    factor: float
    per_lane: bool = False


def parse_unit(text: str, quantity: Quantity) -> Unit:
    """Read a unit, with a number before it if one unit in the file is several of it.

    ``0.01 h`` is 36 s, ``3 s`` is 3 s, ``veh/h/lane`` is 1/3600 veh/s of each lane. Raises
    ValueError, with the units known, if it is none.
    """
    name = text.strip()
    per_lane = quantity == "capacity" and name.endswith(PER_LANE)
    if per_lane:
        name = name.removesuffix(PER_LANE)
    number, blank, rest = name.partition(" ")
    try:
        multiple, name = (float(number), rest.strip()) if blank else (1.0, name)
    except ValueError:
        multiple = math.nan
    if name not in UNITS[quantity] or not 0 < multiple < math.inf:
        known = ", ".join(UNITS[quantity])
        lane = f", each also with {PER_LANE}" if quantity == "capacity" else ""
        raise ValueError(
            f"is not a unit of {quantity}: write one of {known}{lane}; "
            "a number and a blank may stand before it, as in 0.01 h"
        )
    return Unit(multiple * UNITS[quantity][name], per_lane)

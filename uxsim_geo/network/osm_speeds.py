"""Speed limits as OpenStreetMap writes them: by direction, in every unit, or as a zone's name.

Looked at, for each direction, until one says something:

    maxspeed:forward (or :backward), maxspeed     a number with its unit, several of them (the
                                                  lowest holds), a zone (DE:urban), walk, none
    maxspeed:type, source:maxspeed, zone:maxspeed, zone:traffic, maxspeed:source     a zone
    the table of road classes                     of the country asked for

A number in the file is ``given`` (also that of a zone that has it in its name, DE:zone30); what
a table makes of a zone's or a class's name is ``assumed``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from uxsim_geo.network.osm_tags import Remark, Tags, oriented
from uxsim_geo.network.units import SPEEDS

if TYPE_CHECKING:
    from uxsim_geo.network.osm_defaults import Defaults

#: m/s in one of each unit; a number alone is in km/h
UNITS = {
    "": SPEEDS["km/h"],
    **dict.fromkeys(("km/h", "kmh", "kph", "kmph"), SPEEDS["km/h"]),
    **dict.fromkeys(("mph", "mp/h"), SPEEDS["mph"]),
    **dict.fromkeys(("knots", "knot", "kn"), 1852.0 / 3600.0),
}

#: countries whose zones have miles an hour in their names (GB:zone20)
MILES = frozenset({"GB", "GG", "IM", "JE", "PR", "UK", "US"})

#: keys that name a zone or say by what law a limit holds
ZONE_KEYS = ("maxspeed:type", "source:maxspeed", "zone:maxspeed", "zone:traffic", "maxspeed:source")

#: limits that no number goes with: the next source of a speed is asked
UNNUMBERED = frozenset(
    {"signals", "variable", "unposted", "implicit", "default", "national", "unknown", "no", "yes"}
)

#: m/s; nothing on roads is beyond these (1 km/h, 250 km/h)
SLOWEST, FASTEST = 1.0 / 3.6, 250.0 / 3.6

_NUMBER = re.compile(r"([0-9]{1,4}(?:[.,][0-9]{1,4})?) ?([a-z/]*)")
_ZONE = re.compile(r"([a-z]{2})(-[a-z0-9]{1,3})?:(.+)")
_ZONE_NUMBER = re.compile(r"(?:zone:?)?([0-9]{1,3})")


@dataclass(frozen=True)
class Speed:
    """A free speed (m/s), whether it is ``given`` or ``assumed``, and which tag it comes from."""

    value: float
    source: str
    basis: str


def free_speeds(
    tags: Tags, country: str, defaults: Defaults, remarks: list[Remark]
) -> tuple[Speed, Speed]:
    """Free speed forward and backward along a way."""
    road_class = tags["highway"]
    of_class = Speed(defaults.speed(country, road_class), "assumed", f"class {road_class}")
    found: list[Speed] = []
    for direction in ("forward", "backward"):
        told: list[Remark] = []
        limit = _limit(tags, direction, country, defaults, told)
        found.append(limit or of_class)
        remarks.extend(remark for remark in told if remark not in remarks)
    return found[0], found[1]


def _limit(
    tags: Tags, direction: str, country: str, defaults: Defaults, remarks: list[Remark]
) -> Speed | None:
    for key in oriented("maxspeed", direction):
        text = tags.get(key)
        if text is not None:
            speed = _speed_of(text, key, country, defaults, remarks)
            if speed is not None:
                return speed
    for key in ZONE_KEYS:
        text = tags.get(key)
        zone = None if text is None else zone_speed(text, country, defaults)
        if zone is not None:
            return Speed(zone[0], zone[1], f"{key}={text}")
    return None


def _speed_of(
    text: str, key: str, country: str, defaults: Defaults, remarks: list[Remark]
) -> Speed | None:
    """What one maxspeed says; None, with a remark unless it is usual, where that is no speed."""
    values = parse_numbers(text)
    if values:
        if len(values) > 1:
            what = "several speed limits (value): the lowest is used"
            remarks.append(Remark("several speed limits", what, f"{key}={text}"))
        if SLOWEST <= min(values) <= FASTEST:
            return Speed(min(values), "given", key)
        what = "a speed limit (value) that no road has: the next source is used"
        remarks.append(Remark("implausible speed limit", what, f"{key}={text}"))
        return None
    zone = zone_speed(text, country, defaults)
    if zone is not None:
        return Speed(zone[0], zone[1], f"{key}={text}")
    if text.strip().lower() in UNNUMBERED:
        what = "a speed limit without a number (value): the next source is used"
        remarks.append(Remark("speed limit without number", what, f"{key}={text}"))
    else:
        what = "a speed limit (value) that cannot be read: the next source is used"
        remarks.append(Remark("unreadable speed limit", what, f"{key}={text}"))
    return None


def parse_numbers(text: str) -> list[float]:
    """The speeds, m/s, of ``50``, ``30 mph``, ``10 knots``, ``35 mph;40 mph``; empty if none is.

    A value among several that is no number (``50;signals``) is passed over.
    """
    values = []
    for part in re.split("[;|]", text.lower()):
        match = _NUMBER.fullmatch(part.strip())
        if match and match[2] in UNITS:
            values.append(float(match[1].replace(",", ".")) * UNITS[match[2]])
    return values


def zone_speed(text: str, country: str, defaults: Defaults) -> tuple[float, str] | None:
    """Speed (m/s) and source of a zone: ``DE:urban``, ``DE:zone30``, ``urban``, ``walk``, ``none``.

    Without a country in front the zone is that of ``country``. None if it is no zone known.
    """
    name = text.strip().lower()
    match = _ZONE.fullmatch(name)
    place = country
    if match:
        place, name = (match[1] + (match[2] or "")).upper(), match[3]
        number = _ZONE_NUMBER.fullmatch(name)
        if number:
            unit = "mph" if place[:2] in MILES else "km/h"
            speed = float(number[1]) * SPEEDS[unit]
            return (speed, "given") if SLOWEST <= speed <= FASTEST else None
    speed_of_zone = defaults.zone(place, "none" if name == "unlimited" else name)
    return None if speed_of_zone is None else (speed_of_zone, "assumed")

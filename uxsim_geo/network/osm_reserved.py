"""Lanes that are not for cars: what the tags of lanes leave of those that a road has.

``lanes`` counts the lanes of buses too. Of a direction whose number is given,

    car access by lane   motorcar:lanes, motor_vehicle:lanes, vehicle:lanes, access:lanes (the
                         more specific first, lane by lane): lanes closed to cars do not count
    buses by lane        bus:lanes, psv:lanes: those designated do not count, unless car access by
                         lane says otherwise
    number of lanes      lanes:bus, lanes:psv: so many do not count, where no lane is designated

each with :forward or :backward, and on one-way roads without. Lists have lanes of bicycles too,
which ``lanes`` does not count: so no more lanes are left than the list has for cars. Lanes of buses
at some hours (``:conditional``) count. At least one lane is left.
"""

from __future__ import annotations

from uxsim_geo.network.osm_access import CLOSED, KEYS, PRIVATE
from uxsim_geo.network.osm_lanes import Lanes, count_of
from uxsim_geo.network.osm_oneway import Directions
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.osm_tags import Remark, Tags, values

DIRECTIONS = ("forward", "backward")

#: whose lanes are not those of cars
KINDS = ("bus", "psv")

#: values of bus:lanes that make a lane one for buses
DESIGNATED = frozenset({"designated", "official"})


def lanes_of_cars(
    tags: Tags,
    open_to: Directions,
    lanes: tuple[Lanes, Lanes],
    options: OsmOptions,
    remarks: list[Remark],
) -> tuple[Lanes, Lanes]:
    """What of the lanes forward and backward is for cars; assumed ones all are."""
    if not any(_says(key) for key in tags):
        return lanes
    sides = (0 if open_to.forward else 1,) if open_to.oneway else (0, 1)
    buses = (0, 0) if options.bus_lanes == "shared" else _lanes_of_buses(tags, open_to, lanes)
    found, least = list(lanes), 1
    for side in sides:
        count, source = lanes[side].count, lanes[side].source
        if source == "assumed":
            continue
        by_lane = _access_by_lane(_ends(side, open_to), tags, options.private)
        left = count - (buses[side] if by_lane is None else _closed(by_lane, count))
        found[side], least = Lanes(max(left, 1), source), min(left, least)
    _remark(tags, [found[side] != lanes[side] for side in sides], least, remarks)
    return (found[sides[0]], found[sides[-1]])


def _ends(side: int, open_to: Directions) -> tuple[str, ...]:
    """Ends of the keys that speak of the lanes of one direction."""
    own = f":{DIRECTIONS[side]}"
    return (own, "") if open_to.oneway else (own,)


def _access_by_lane(ends: tuple[str, ...], tags: Tags, private: bool) -> list[bool] | None:
    """Whether each lane is open to cars; None where no tag says so."""
    texts = [
        tags[f"{key}:lanes{end}"] for key in KEYS for end in ends if f"{key}:lanes{end}" in tags
    ]
    if not texts:
        return None
    lists = [text.split("|") for text in texts]
    closed = CLOSED if private else CLOSED | PRIVATE
    is_open = []
    for place in range(max(len(entries) for entries in lists)):
        said = next((v for e in lists if place < len(e) and (v := values(e[place]))), [])
        is_open.append(not said or any(value not in closed for value in said))
    return is_open


def _closed(is_open: list[bool], count: int) -> int:
    """How many of ``count`` lanes are closed, where the list may have those of bicycles too."""
    if len(is_open) >= count:
        return max(count - sum(is_open), 0)
    return len(is_open) - sum(is_open)


def _lanes_of_buses(tags: Tags, open_to: Directions, lanes: tuple[Lanes, Lanes]) -> tuple[int, int]:
    """Lanes of buses forward and backward."""
    own = [_of_direction(tags, direction) for direction in DIRECTIONS]
    total = max(_number(tags, f"lanes:{kind}") for kind in KINDS)
    if open_to.oneway:
        number = _on_oneway(tags, 0 if open_to.forward else 1, own, total)
        return number, number
    if total and not any(own):
        # which side an odd one is on is not said: where there are more lanes
        more = 0 if lanes[0].count >= lanes[1].count else 1
        own = [total // 2, total // 2]
        own[more] += total % 2
    return own[0], own[1]


def _on_oneway(tags: Tags, side: int, own: list[int], total: int) -> int:
    """Lanes of buses on a one-way road.

    Those against the traffic are among its lanes, unless the directions' lanes are told apart.
    """
    along = _designated(tags, "") or own[side]
    if any(f"lanes:{direction}" in tags for direction in DIRECTIONS):
        against = _number(tags, f"lanes:{DIRECTIONS[1 - side]}")
        return max(along, total - against)
    return max(along + own[1 - side], total)


def _of_direction(tags: Tags, direction: str) -> int:
    counted = max(_number(tags, f"lanes:{kind}:{direction}") for kind in KINDS)
    return _designated(tags, f":{direction}") or counted


def _designated(tags: Tags, end: str) -> int:
    """Lanes that bus:lanes or psv:lanes gives to buses."""
    lists = [tags.get(f"{kind}:lanes{end}", "").split("|") for kind in KINDS]
    places = range(max(len(entries) for entries in lists))
    return sum(
        any(p < len(e) and DESIGNATED.intersection(values(e[p])) for e in lists) for p in places
    )


def _number(tags: Tags, key: str) -> int:
    return count_of(tags, key, []) or 0


def _remark(tags: Tags, changed: list[bool], least: int, remarks: list[Remark]) -> None:
    """Say what was left out, and that a lane was kept where none would be."""
    if any(changed):
        note = "lanes that are not for cars (value) are left out"
        remarks.append(Remark("reserved lanes", note, _written(tags)))
    if least < 1:
        note = "no lane would be left for cars (value): one is kept"
        remarks.append(Remark("no lane for cars", note, _written(tags)))


def _written(tags: Tags) -> str:
    first = ("lanes", "lanes:forward", "lanes:backward")
    others = (key for key in sorted(tags) if _says(key) and key not in first)
    return " ".join(f"{key}={tags[key]}" for key in (*first, *others) if key in tags)


def _says(key: str) -> bool:
    """Whether a key says whose lanes they are."""
    parts = key.split(":")
    if parts[-1] == "conditional":
        return False
    return "lanes" in parts and not {*KEYS, *KINDS}.isdisjoint(parts)

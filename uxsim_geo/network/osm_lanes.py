"""Lanes of each direction. The tag ``lanes`` counts all of a road, in both directions together.

    one-way     lanes:forward (of a road drawn against the traffic: lanes:backward), else lanes
    two-way     lanes:forward and lanes:backward where both stand there; where one does, the other
                is what is left of lanes less lanes:both_ways; where none does, the count of
                turn:lanes:forward (:backward) stands for it, and otherwise half of what is left

An odd lane belongs to the direction in which the road is drawn. At least one lane is kept in each
direction: where both share the only lane, a remark says so. What no tag says is ``assumed`` from
the table of road classes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from uxsim_geo.network.osm_oneway import Directions
from uxsim_geo.network.osm_tags import Remark, Tags

#: no road has more in one direction
MOST = 20

_COUNT = re.compile(r"[0-9]{1,3}(?:\.[0-9]{1,2})?")


@dataclass(frozen=True)
class Lanes:
    """Lanes of one direction, and whether they are ``given`` or ``assumed``."""

    count: int
    source: str


def lanes_of(
    tags: Tags, open_to: Directions, assumed: int, remarks: list[Remark]
) -> tuple[Lanes, Lanes]:
    """Lanes forward and backward; those of a direction that is not open mean nothing.

    ``assumed`` is what the table says for one direction of this road class.
    """
    if open_to.oneway:
        lanes = _oneway(tags, "forward" if open_to.forward else "backward", assumed, remarks)
        return lanes, lanes
    return _twoway(tags, assumed, remarks)


def _oneway(tags: Tags, direction: str, assumed: int, remarks: list[Remark]) -> Lanes:
    own = count_of(tags, f"lanes:{direction}", remarks)
    total = count_of(tags, "lanes", remarks)
    other = count_of(tags, f"lanes:{_opposite(direction)}", remarks)
    if own is None and total is not None and other is not None and total > other:
        own = total - other  # a lane against the traffic, for buses
    if own is not None and total is not None and own + (other or 0) != total:
        remarks.append(_contradiction(tags))
    found = total if own is None else own
    return Lanes(assumed, "assumed") if found is None else Lanes(max(found, 1), "given")


def _twoway(tags: Tags, assumed: int, remarks: list[Remark]) -> tuple[Lanes, Lanes]:
    total = count_of(tags, "lanes", remarks)
    shared = count_of(tags, "lanes:both_ways", remarks) or 0
    forward = count_of(tags, "lanes:forward", remarks)
    backward = count_of(tags, "lanes:backward", remarks)
    if total is None or (forward is not None and backward is not None):
        known = [count for count in (forward, backward) if count is not None]
        fits = total is None or sum(known) + shared == total
        if not fits or min(known, default=1) < 1:
            remarks.append(_contradiction(tags))
        return _or_assumed(forward, assumed), _or_assumed(backward, assumed)
    return _of_total(tags, (forward, backward), total - shared, remarks)


def _of_total(
    tags: Tags, known: tuple[int | None, int | None], rest: int, remarks: list[Remark]
) -> tuple[Lanes, Lanes]:
    """Lanes of both directions out of ``rest`` in all, where at most one direction's are known."""
    forward, backward = known if known != (None, None) else _from_turns(tags, rest)
    if forward is None and backward is None:
        return _halves(tags, rest, remarks)
    if forward is None:
        forward = rest - (backward or 0)
    else:
        backward = rest - forward
    counts = [forward, backward or 0]
    if min(counts) < 1:
        remarks.append(_contradiction(tags))
    return Lanes(max(counts[0], 1), "given"), Lanes(max(counts[1], 1), "given")


def _or_assumed(count: int | None, assumed: int) -> Lanes:
    return Lanes(assumed, "assumed") if count is None else Lanes(max(count, 1), "given")


def _halves(tags: Tags, rest: int, remarks: list[Remark]) -> tuple[Lanes, Lanes]:
    half = max(rest // 2, 1)
    if rest <= 1:
        note = "one lane (value) for both directions: counted in each"
        remarks.append(Remark("shared lane", note, _written(tags)))
        return Lanes(1, "given"), Lanes(1, "given")
    if rest % 2:
        note = "an odd number of lanes (value) for both directions: the odd one counted forward"
        remarks.append(Remark("odd lanes", note, _written(tags)))
    return Lanes(rest - half, "given"), Lanes(half, "given")


def _from_turns(tags: Tags, rest: int) -> tuple[int | None, int | None]:
    """Lanes counted in turn:lanes:forward or :backward, where they leave the other some."""
    for direction in ("forward", "backward"):
        text = tags.get(f"turn:lanes:{direction}")
        count = 0 if text is None else text.count("|") + 1
        if 0 < count < rest:
            return (count, None) if direction == "forward" else (None, count)
    return None, None


def count_of(tags: Tags, key: str, remarks: list[Remark]) -> int | None:
    """The whole number that a tag holds; of several (``2;3``) the least. None if there is none."""
    text = tags.get(key)
    if text is None:
        return None
    parts = [part.strip() for part in text.split(";")]
    counts = [float(part) for part in parts if _COUNT.fullmatch(part)]
    if not counts or min(counts) > MOST:
        note = "a number of lanes (value) that cannot be meant is passed over"
        remarks.append(Remark("unreadable lanes", note, f"{key}={text}"))
        return None
    if len(parts) > 1 or min(counts) % 1:
        note = "not one whole number of lanes (value): the least, rounded down, is used"
        remarks.append(Remark("several lanes", note, f"{key}={text}"))
    return int(min(counts))


def _contradiction(tags: Tags) -> Remark:
    note = "lanes that contradict one another (value): those of the directions hold, at least one"
    return Remark("contradictory lanes", note, _written(tags))


def _written(tags: Tags) -> str:
    keys = ("lanes", "lanes:forward", "lanes:backward", "lanes:both_ways")
    return " ".join(f"{key}={tags[key]}" for key in keys if key in tags)


def _opposite(direction: str) -> str:
    return "backward" if direction == "forward" else "forward"


def turn_lanes(tags: Tags, direction: str, oneway: bool) -> str | None:
    """What is painted on the lanes of one direction, from left to right: ``left|through``."""
    own = tags.get(f"turn:lanes:{direction}")
    return tags.get("turn:lanes") if own is None and oneway else own

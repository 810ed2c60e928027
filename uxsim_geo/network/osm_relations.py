"""What a turn restriction's relation says, before it is sought on the roads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.osm_file import Ids, Restriction
from uxsim_geo.network.osm_tags import Tags, values

#: tags that say how cars may turn, the most specific first
KEYS = (
    "restriction:motorcar",
    "restriction:motor_vehicle",
    "restriction:vehicle",
    "restriction",
)

#: vehicles in ``except`` that cars are among
CARS = frozenset({"motorcar", "motor_vehicle", "vehicle"})

#: old tags for times
TIMES = ("day_on", "day_off", "hour_on", "hour_off")

BANS = frozenset(
    [
        "no_left_turn",
        "no_right_turn",
        "no_straight_on",
        "no_u_turn",
        "no_entry",
        "no_exit",
        "only_left_turn",
        "only_right_turn",
        "only_straight_on",
        "only_u_turn",
        "only_entry",
        "only_exit",
    ]
)

#: no junction has more ways that one restriction could name
MOST_MEMBERS = 50

#: restrictions that may have several members from, or to
SEVERAL_FROM, SEVERAL_TO = "no_entry", "no_exit"


class RestrictionError(Exception):
    """A restriction that is not applied: ``topic`` says of which kind, the message why."""

    def __init__(self, topic: str, why: str) -> None:
        super().__init__(why)
        self.topic = topic


@dataclass(frozen=True)
class Turn:
    """A restriction understood: from ways over a node or ways to ways, by their ids."""

    kind: str
    from_ways: tuple[int, ...]
    via_node: int | None
    via_ways: tuple[int, ...]
    to_ways: tuple[int, ...]

    @property
    def only(self) -> bool:
        """Whether it bans every other turn."""
        return self.kind.startswith("only_")


def turn_of(relation: Restriction) -> Turn:
    """Understand a relation.

    Raises :class:`RestrictionError` where it bans nothing, or nothing clear.
    """
    kind = _kind(relation.tags)
    members = {
        role: tuple(ref for type_, ref, found in relation.members if (type_, found) == place)
        for role, place in (
            ("from", ("w", "from")),
            ("to", ("w", "to")),
            ("via node", ("n", "via")),
            ("via ways", ("w", "via")),
        )
    }
    _check_members(kind, members)
    nodes = members["via node"]
    return Turn(
        kind, members["from"], nodes[0] if nodes else None, members["via ways"], members["to"]
    )


def _kind(tags: Tags) -> str:
    if tags.get("type") != "restriction":
        raise RestrictionError("restriction of other vehicles", f"type={tags.get('type')}")
    found = next((tags[key].strip().lower() for key in KEYS if tags.get(key, "").strip()), None)
    if any(tags.get(key) for key in TIMES):
        raise RestrictionError("conditional restriction", "holds at times only: not applied")
    if found is None:
        if any(key.startswith("restriction") and key.endswith(":conditional") for key in tags):
            raise RestrictionError(
                "conditional restriction", ""
            )  # said of all that have conditions
        if any(key.startswith("restriction:") for key in tags):
            raise RestrictionError("restriction of other vehicles", "says nothing of cars")
        raise RestrictionError("broken restriction", "does not say what it bans")
    if CARS.intersection(values(tags.get("except", ""))):
        raise RestrictionError("restriction excepts cars", "excepts cars")
    if found not in BANS:
        raise RestrictionError("broken restriction", f"restriction={found} is not known")
    return found


def _check_members(kind: str, members: dict[str, tuple[int, ...]]) -> None:
    number = sum(len(found) for found in members.values())
    if number > MOST_MEMBERS:
        raise RestrictionError("broken restriction", f"has {number} members")
    for role, several in (("from", SEVERAL_FROM), ("to", SEVERAL_TO)):
        number = len(members[role])
        if number == 0:
            raise RestrictionError("broken restriction", f"has no way as {role}")
        if number > 1 and kind != several:
            raise RestrictionError("broken restriction", f"has {number} ways as {role}")
    nodes, ways = len(members["via node"]), len(members["via ways"])
    if nodes + ways == 0:
        raise RestrictionError("broken restriction", "has no node or way as via")
    if nodes > 1 or (nodes and ways):
        raise RestrictionError("broken restriction", f"has {nodes} nodes and {ways} ways as via")


def places_of(relations: Iterable[Restriction]) -> Ids:
    """Ids of the nodes that are places of restrictions, at which ways must be cut."""
    nodes = {
        ref
        for relation in relations
        for type_, ref, role in relation.members
        if (type_, role) == ("n", "via")
    }
    return np.array(sorted(nodes), dtype=np.int64)

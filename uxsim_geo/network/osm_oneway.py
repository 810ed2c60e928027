"""In which directions a road may be driven.

The tags oneway:motorcar, oneway:motor_vehicle, oneway:vehicle and oneway are asked in this
order. Roundabouts (``junction=roundabout`` and ``circular``) and motorways are one-way as they
are drawn where no tag says otherwise; a direction closed to cars (``motor_vehicle:backward=no``)
is left out too. ``reversible`` and ``alternating`` roads stay open in both directions.
"""

from __future__ import annotations

from dataclasses import dataclass

from uxsim_geo.network.osm_access import is_closed
from uxsim_geo.network.osm_tags import Remark, Tags

KEYS = ("oneway:motorcar", "oneway:motor_vehicle", "oneway:vehicle", "oneway")
FORWARD = frozenset({"yes", "true", "1"})
BACKWARD = frozenset({"-1", "reverse"})
BOTH = frozenset({"no", "false", "0"})
CHANGING = frozenset({"reversible", "alternating"})
ROUND = frozenset({"roundabout", "circular"})


@dataclass(frozen=True)
class Directions:
    """Whether a way may be driven as it is drawn, and against that."""

    forward: bool
    backward: bool

    @property
    def oneway(self) -> bool:
        """Whether only one of the two is open."""
        return self.forward != self.backward


def directions(tags: Tags, private: bool, remarks: list[Remark]) -> Directions:
    """The directions open to cars; none is where each is closed by a tag of its own."""
    drawn = _drawn(tags, remarks)
    return Directions(
        drawn.forward and not is_closed(tags, "forward", private),
        drawn.backward and not is_closed(tags, "backward", private),
    )


def _drawn(tags: Tags, remarks: list[Remark]) -> Directions:
    implied = tags.get("junction") in ROUND or tags["highway"] == "motorway"
    for key in KEYS:
        text = tags.get(key)
        if text is None:
            continue
        value = text.strip().lower()
        if value in FORWARD:
            return Directions(True, False)
        if value in BACKWARD:
            return Directions(False, True)
        if value in BOTH:
            return Directions(True, True)
        if value in CHANGING:
            note = "the direction changes with time (value): open in both"
            remarks.append(Remark("changing direction", note, f"{key}={text}"))
            return Directions(True, True)
        note = "a oneway (value) that cannot be read is passed over"
        remarks.append(Remark("unreadable oneway", note, f"{key}={text}"))
    return Directions(True, not implied)

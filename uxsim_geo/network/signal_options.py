"""What is assumed of signals whose place is known, but not their timing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

from uxsim_geo.errors import Faults

Crossings = Literal["ignore", "pedestrians"]

#: how busy a lane of each class is at the peak, beside one of a main road; other classes count 1
CLASS_LOADS: dict[str, float] = {
    "motorway": 1.0,
    "motorway_link": 0.8,
    "trunk": 1.0,
    "trunk_link": 0.8,
    "primary": 1.0,
    "primary_link": 0.8,
    "secondary": 0.8,
    "secondary_link": 0.6,
    "tertiary": 0.6,
    "tertiary_link": 0.5,
    "unclassified": 0.4,
    "road": 0.4,
    "residential": 0.3,
    "living_street": 0.2,
    "service": 0.2,
    "track": 0.1,
}


@dataclass(frozen=True)
class SignalOptions:
    """Choices of the rule that times signals; times in s, angles in degrees.

    Greens are those in which traffic flows at the capacity of its link, from the first second to
    the last. What a real signal loses by starting and by clearing the junction therefore stands
    in ``all_red``: 4 s a phase is the usual value of the Highway Capacity Manual.

    all_red
        after every phase, nobody has green
    min_green
        of every phase, whole s; it takes precedence over ``max_cycle``
    min_cycle, max_cycle
        bounds of every cycle
    cycle_per_phase
        the cycle lasts so long times the number of its phases, where there are no volumes
    same_direction
        links that arrive within this angle of one another are one approach, up to 90
    opposite_within
        approaches share a phase if they miss the opposite direction by no more, up to 90
    look_back
        m: a link arrives in the direction of its last so many metres
    crossings
        at nodes with one or two neighbours, where there is no junction: ``ignore`` the signal,
        or stop all for ``pedestrians``
    pedestrian_green
        of the phase for pedestrians
    reaction_time
        that of the simulation, which gives the capacity of links that are told none
    class_loads
        road class to how busy a lane of it is, see :data:`CLASS_LOADS`
    """

    all_red: float = 4.0
    min_green: int = 8
    min_cycle: float = 40.0
    max_cycle: float = 120.0
    cycle_per_phase: float = 30.0
    same_direction: float = 20.0
    opposite_within: float = 45.0
    look_back: float = 25.0
    crossings: Crossings = "ignore"
    pedestrian_green: float = 15.0
    reaction_time: float = 1.0
    class_loads: Mapping[str, float] = field(default_factory=lambda: dict(CLASS_LOADS))

    def __post_init__(self) -> None:
        faults = Faults("options of the signals")
        for name in ("min_cycle", "max_cycle", "cycle_per_phase", "look_back", "reaction_time"):
            _add_number_fault(faults, name, getattr(self, name))
        _add_number_fault(faults, "pedestrian_green", self.pedestrian_green)
        if not 0 <= self.all_red < math.inf:
            faults.add("must be a finite number of 0 or more", column="all_red", value=self.all_red)
        if not (1 <= self.min_green < math.inf and self.min_green % 1 == 0):
            what = "must be a whole number of 1 or more"
            faults.add(what, column="min_green", value=self.min_green)
        if self.min_cycle > self.max_cycle:
            faults.add("must not be above max_cycle", column="min_cycle", value=self.min_cycle)
        for name in ("same_direction", "opposite_within"):
            if not 0 <= getattr(self, name) <= 90:
                faults.add("must be from 0 to 90", column=name, value=getattr(self, name))
        if self.crossings not in get_args(Crossings):
            what = f"must be {' or '.join(get_args(Crossings))}"
            faults.add(what, column="crossings", value=self.crossings)
        for road_class, load in self.class_loads.items():
            _add_number_fault(faults, f"class_loads of {road_class}", load)
        faults.raise_if_any()


def _add_number_fault(faults: Faults, name: str, value: float) -> None:
    if not 0 < value < math.inf:
        faults.add("must be a finite number above 0", column=name, value=value)

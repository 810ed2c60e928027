"""What an OpenStreetMap file does not say itself, and which of its roads are wanted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from uxsim_geo.errors import Faults
from uxsim_geo.network.driving_side import DrivingSide, side_of

#: barriers that keep cars out cut the road, or no barrier does
Barriers = Literal["obeyed", "ignored"]

#: lanes of buses are not counted as lanes of cars, or they are
BusLanes = Literal["reserved", "shared"]

#: roads that anybody may drive on, the default
PUBLIC_ROADS = (
    "motorway",
    "motorway_link",
    "trunk",
    "trunk_link",
    "primary",
    "primary_link",
    "secondary",
    "secondary_link",
    "tertiary",
    "tertiary_link",
    "unclassified",
    "residential",
    "living_street",
    "road",
)

#: every value of the tag highway that may be asked for
ROAD_CLASSES = (*PUBLIC_ROADS, "service", "track")


@dataclass(frozen=True)
class OsmOptions:
    """Choices of the conversion; the defaults read the public roads of any country.

    road_classes
        values of the tag highway that become links, of :data:`ROAD_CLASSES`
    country
        whose assumed speeds and lanes hold where the file has none: ``default``, or a code as DE
        that the tables know. It also says what a zone without a country (``urban``) means
    driving_side
        right or left, None: that of the country (:mod:`uxsim_geo.network.driving_side`);
        recorded in the notes, the geometry does not depend on it
    private
        True: roads of private access, of residents and for deliveries become links too
    barriers
        ``obeyed``: nobody passes bollards, locked gates and the like
        (:mod:`uxsim_geo.network.osm_barriers`)
    bus_lanes
        ``reserved``: they are left out of the lanes (:mod:`uxsim_geo.network.osm_reserved`)
    class_table, zone_table
        CSV files whose rows take precedence over the shipped tables of what is assumed
        (``osm_road_classes.csv``, ``osm_zone_speeds.csv``, see
        :mod:`uxsim_geo.network.osm_defaults`)
    jam_density
        veh/m of one lane; 0.15 (7 m a vehicle at a standstill) is a usual value in mixed traffic,
        0.2 that of UXsim
    signal_distance
        m: a signal on the approach controls the next junction in its direction within this
        distance
    max_unpacked_mb
        a packed file may unpack to so many MB (10⁶ bytes); None: 100 times its own size, and at
        least 32
    """

    road_classes: tuple[str, ...] = PUBLIC_ROADS
    country: str = "default"
    driving_side: DrivingSide | None = None
    private: bool = False
    barriers: Barriers = "obeyed"
    bus_lanes: BusLanes = "reserved"
    class_table: Path | None = None
    zone_table: Path | None = None
    jam_density: float = 0.2
    signal_distance: float = 50.0
    max_unpacked_mb: float | None = None

    def __post_init__(self) -> None:
        faults = Faults("options of the network")
        if not self.road_classes:
            faults.add("must name at least one road class", column="road_classes")
        for name in self.road_classes:
            if name not in ROAD_CLASSES:
                known = ", ".join(ROAD_CLASSES)
                faults.add(f"must be among {known}", column="road_classes", value=name)
        self._add_choice_faults(faults)
        _add_number_fault(faults, "jam_density", self.jam_density)
        _add_number_fault(faults, "signal_distance", self.signal_distance)
        if self.max_unpacked_mb is not None:
            _add_number_fault(faults, "max_unpacked_mb", self.max_unpacked_mb)
        faults.raise_if_any()

    @property
    def side(self) -> DrivingSide:
        """The side that is driven on: as told, else that of the country."""
        return self.driving_side or side_of(self.country)

    def _add_choice_faults(self, faults: Faults) -> None:
        choices = {"driving_side": DrivingSide, "barriers": Barriers, "bus_lanes": BusLanes}
        for name, known in choices.items():
            value = getattr(self, name)
            if value not in get_args(known) and (name, value) != ("driving_side", None):
                faults.add(f"must be {' or '.join(get_args(known))}", column=name, value=value)


def _add_number_fault(faults: Faults, name: str, value: float) -> None:
    if not 0 < value < math.inf:
        faults.add("must be a finite number above 0", column=name, value=value)

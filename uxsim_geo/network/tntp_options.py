"""What a TNTP net file does not say itself: units, and how to make a dynamic network of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from uxsim_geo.errors import Faults
from uxsim_geo.network.units import Quantity, Unit, parse_unit

FreeSpeedFrom = Literal["time", "speed"]
CapacityFrom = Literal["file", "diagram"]
Connectors = Literal["collapse", "keep"]
Centroids = Literal["auto", "none"]

CHOICES: dict[str, tuple[str, ...]] = {
    "free_speed_from": get_args(FreeSpeedFrom),
    "capacity": get_args(CapacityFrom),
    "connectors": get_args(Connectors),
    "centroids": get_args(Centroids),
}


@dataclass(frozen=True)
class TntpOptions:
    """Units of the files and choices of the conversion. A unit the files do not need may be None.

    length_unit
        of the column length: m, km, ft, mi, also a multiple as ``0.5 km``; always needed
    time_unit
        of the column free_flow_time: s, min, h, day, also ``0.01 h`` or ``3 s``; needed unless
        ``free_speed_from`` is speed
    capacity_unit
        of the column capacity: veh/h, veh/day ..., with ``/lane`` after it if it is that of one
        lane; needed unless ``capacity`` is diagram
    speed_unit
        of the column speed: km/h, mph, m/s, ft/min ...; needed if ``free_speed_from`` is speed
    crs
        of the node coordinates, as ``EPSG:4326``; ``none`` for coordinates of no known system;
        needed with a node file in TNTP form (GeoJSON brings its own)
    free_speed_from
        ``time``: free speed = length / free_flow_time; ``speed``: the column speed
    min_speed, max_speed
        m/s; free speeds outside are moved to the nearer of the two and noted
    capacity
        ``file``: kept exactly; ``diagram``: the column is not read, capacity follows from free
        speed, lanes and jam density, and lanes without a column of their own are 1
    lane_capacity
        veh/h of one lane; lanes = max(1, round(capacity / lane_capacity)) where the file has no
        column lanes
    infinite_capacity
        in ``capacity_unit``, as in the file; capacities from here on mean no limit and make no
        lanes
    jam_density
        veh/m of one lane
    centroids
        ``auto``: nodes below the first thru node; where that is 1, zones whose every link takes
        no time or has infinite capacity. ``none``: every node lets traffic through
    first_thru_node
        in place of the file's tag, where that is missing or wrong; None: the file's
    connectors
        ``collapse``: links at centroids are dropped and trips start and end at the nodes they
        led to; ``keep``: they stay, and centroids let no traffic through
    """

    length_unit: str | None = None
    time_unit: str | None = None
    capacity_unit: str | None = None
    speed_unit: str | None = None
    crs: str | None = None
    free_speed_from: FreeSpeedFrom = "time"
    min_speed: float = 3.0
    max_speed: float = 40.0
    capacity: CapacityFrom = "file"
    lane_capacity: float = 1800.0
    infinite_capacity: float = 45_000.0
    jam_density: float = 0.2
    centroids: Centroids = "auto"
    first_thru_node: int | None = None
    connectors: Connectors = "collapse"

    def __post_init__(self) -> None:
        faults = Faults("options of the network")
        for name, choices in CHOICES.items():
            value = getattr(self, name)
            if value not in choices:
                faults.add(f"must be {' or '.join(choices)}", column=name, value=value)
        for name in ("min_speed", "max_speed", "lane_capacity", "jam_density"):
            _add_number_fault(faults, name, getattr(self, name))
        if not self.infinite_capacity > 0:
            value = self.infinite_capacity
            faults.add("must be above 0", column="infinite_capacity", value=value)
        if self.first_thru_node is not None and self.first_thru_node < 1:
            value = self.first_thru_node
            faults.add("must be a node's number, 1 or more", column="first_thru_node", value=value)
        if self.min_speed > self.max_speed:
            faults.add("must not exceed max_speed", column="min_speed", value=self.min_speed)
        for quantity in ("length", "time", "speed", "capacity"):
            _add_unit_fault(faults, quantity, getattr(self, f"{quantity}_unit"))
        faults.raise_if_any()

    def unit(self, quantity: Quantity) -> Unit | None:
        """The unit stated for a column, None where nothing is stated."""
        text = getattr(self, f"{quantity}_unit")
        return None if text is None else parse_unit(text, quantity)


def _add_number_fault(faults: Faults, name: str, value: float) -> None:
    if not 0 < value < math.inf:
        faults.add("must be a finite number above 0", column=name, value=value)


def _add_unit_fault(faults: Faults, quantity: Quantity, text: str | None) -> None:
    if text is None:
        return
    try:
        parse_unit(text, quantity)
    except ValueError as error:
        faults.add(str(error), column=f"{quantity}_unit", value=text)

"""What GMNS tables do not say themselves: units, and how to make a network for cars of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from uxsim_geo.errors import Faults
from uxsim_geo.network.units import Quantity, parse_unit

LengthFrom = Literal["file", "geometry"]
LengthCheck = Literal["refuse", "warn"]
Turns = Literal["listed", "all"]

CHOICES: dict[str, tuple[str, ...]] = {
    "length_from": get_args(LengthFrom),
    "length_check": get_args(LengthCheck),
    "turns": get_args(Turns),
}

#: uses that mean motor vehicles, in lower case
MOTOR_USES = ("auto", "car", "all", "any", "motor", "motor_vehicle", "vehicle", "drive", "sov")


@dataclass(frozen=True)
class GmnsOptions:
    """Units of the tables and choices of the conversion.

    length_unit, speed_unit
        of the columns length and free_speed: m, km, ft, mi ... and km/h, mph, m/s ...; None: what
        config.csv says, and a fault where that is silent. What is stated here holds, even against
        config.csv
    capacity_unit
        the specification says ``veh/h/lane``; tables made of others often have ``veh/h`` of the
        whole link, or ``veh/day/lane``
    crs
        of the coordinates, as ``EPSG:4326``; ``none``: of no known system; None: what config.csv
        says
    length_from
        ``file``: the column length, and where it is empty the length of the geometry;
        ``geometry``: that of the geometry throughout
    length_check
        what becomes of lengths that would agree with the geometry in another unit
    uses
        links and lanes are read if one of these stands in their allowed_uses, or nothing does
    leave_out
        values of facility_type whose links are left out, whatever their uses
    lanes_where_missing, speed_where_missing
        lanes, and m/s, of links without; None: a missing value is a fault. Capacities that are
        missing are those of the triangular diagram
    turns
        ``listed``: movement.csv, where there is one, names the turns that are allowed at the nodes
        that occur in it, all others there are banned; ``all``: it is not read
    jam_density
        veh/m of one lane, where the links have no column jam_density
    """

    length_unit: str | None = None
    speed_unit: str | None = None
    capacity_unit: str = "veh/h/lane"
    crs: str | None = None
    length_from: LengthFrom = "file"
    length_check: LengthCheck = "refuse"
    uses: tuple[str, ...] = MOTOR_USES
    leave_out: tuple[str, ...] = ()
    lanes_where_missing: int | None = None
    speed_where_missing: float | None = None
    turns: Turns = "listed"
    jam_density: float = 0.2

    def __post_init__(self) -> None:
        faults = Faults("options of the network")
        for name, choices in CHOICES.items():
            value = getattr(self, name)
            if value not in choices:
                faults.add(f"must be {' or '.join(choices)}", column=name, value=value)
        quantities: tuple[Quantity, ...] = ("length", "speed", "capacity")
        for quantity in quantities:
            _add_unit_fault(faults, quantity, getattr(self, f"{quantity}_unit"))
        for name in ("lanes_where_missing", "speed_where_missing", "jam_density"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                faults.add("must be a finite number above 0", column=name, value=value)
        if self.lanes_where_missing is not None and self.lanes_where_missing % 1:
            value = self.lanes_where_missing
            faults.add("must be a whole number", column="lanes_where_missing", value=value)
        for name in ("uses", "leave_out"):
            if isinstance(getattr(self, name), str):
                what = "must be a list of words, not one text"
                faults.add(what, column=name, value=getattr(self, name))
        faults.raise_if_any()


def _add_unit_fault(faults: Faults, quantity: Quantity, text: str | None) -> None:
    if text is None:
        return
    try:
        parse_unit(text, quantity)
    except ValueError as error:
        faults.add(str(error), column=f"{quantity}_unit", value=text)

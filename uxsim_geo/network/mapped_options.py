"""How the columns of any table of lines become those of a network.

ColumnMapping(
    links={
        "link_id": "ID",
        "free_speed": Source("VMAX", unit="km/h"),
        "lanes": Source("LANES", missing=1),
        "capacity": Source("CAP", unit="veh/h/lane"),
    },
    direction=Direction("ONEWAY", forward=("F",), backward=("T",), both=("B",)),
)
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import Any, Literal, get_args

from uxsim_geo.errors import Faults
from uxsim_geo.network.exact import FINEST
from uxsim_geo.network.units import LENGTHS, Quantity, parse_unit

LanesOf = Literal["direction", "road"]

#: columns of links that hold numbers, and what their unit is one of; None: numbers without unit
NUMBERS: dict[str, str | None] = {
    "length": "length",
    "lanes": None,
    "free_speed": "speed",
    "jam_density": "jam density",
    "capacity": "capacity",
    "merge_priority": None,
}

#: columns of links that hold text
TEXTS = ("link_id", "from_node_id", "to_node_id", "road_class", "name")

#: of two-way rows, what the second direction has where it differs from the first
BACKWARD = {f"{name}_backward": name for name in NUMBERS if name != "length"}

NODE_NAMES = ("node_id", "zone_id", "control", "through_traffic")

#: veh/m
JAM_DENSITIES = {f"veh/{way}": 1.0 / length for way, length in LENGTHS.items()}

SI = {"length": "m", "speed": "m/s", "jam density": "veh/m", "capacity": "veh/s"}


@dataclass(frozen=True)
class Source:
    """Where the values of one column of the network come from.

    column
        of the table; or
    constant
        the same in every row
    unit
        of these values, as ``km/h`` or ``veh/h/lane``; a column of lengths, speeds, capacities or
        jam densities must state it, a constant without one is in SI units
    values
        what each value of the column stands for: ``{"primary": 50, "residential": 30}``
    missing
        what an empty cell, or one that ``values`` does not know, stands for; None: it is a fault
        where the network needs a value
    """

    column: str | None = None
    constant: float | str | None = None
    unit: str | None = None
    values: Mapping[str, float | str] = field(default_factory=dict)
    missing: float | str | None = None


@dataclass(frozen=True)
class Direction:
    """Which way the traffic goes on a row, seen along its line: what the values of a column mean.

    Values are compared as text; ``None`` among them stands for an empty cell. Other values are
    faults.
    """

    column: str
    forward: tuple[str | None, ...] = ()
    backward: tuple[str | None, ...] = ()
    both: tuple[str | None, ...] = ()


#: as it may be written: a Source or its fields by name, the name of a column, or a number
Written = Source | Mapping[str, Any] | str | float


@dataclass(frozen=True)
class ColumnMapping:
    """From the columns of a network to those of a table of lines, and of one of points.

    links
        by column of the links: lanes and free_speed are needed. Without link_id rows are
        numbered, without from_node_id and to_node_id ends of lines make nodes, without length it is
        that of the line. ``lanes_backward`` and the like hold for the second direction of two-way
        rows
    nodes
        by column of the nodes, of the table of points: node_id is needed
    direction
        None: every row is one direction, from the first point of its line to the last
    lanes_of
        ``road``: lanes count both directions of a two-way row, each has half of them, rounded up
    tolerance
        m: ends of lines as near as this to one another, or to a node, are at the same node
    crs
        of tables that do not say theirs; ``none``: of no known system, then lengths are needed
    keep
        further columns of the table of lines, kept as ``file_`` and their name
    """

    links: Mapping[str, Written]
    nodes: Mapping[str, Written] = field(default_factory=dict)
    direction: Direction | None = None
    lanes_of: LanesOf = "direction"
    tolerance: float = 1.0
    crs: str | None = None
    keep: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        faults = Faults("column mapping")
        _add_name_faults(faults, self.links, (*TEXTS, *NUMBERS, *BACKWARD))
        _add_name_faults(faults, self.nodes, NODE_NAMES)
        self._add_lack_faults(faults)
        for name, written in [*self.links.items(), *self.nodes.items()]:
            if _is_written_well(faults, name, written):
                _add_source_faults(faults, name, source_of(written))
        if self.lanes_of not in get_args(LanesOf):
            faults.add("must be direction or road", column="lanes_of", value=self.lanes_of)
        if self.lanes_of == "road" and "lanes_backward" in self.links:
            faults.add("counts one direction, lanes_of says road", column="lanes_backward")
        if not 0 <= self.tolerance < math.inf:
            faults.add("must be finite, 0 or more", column="tolerance", value=self.tolerance)
        if self.direction is not None:
            _add_direction_faults(faults, self.direction)
        faults.raise_if_any()

    def _add_lack_faults(self, faults: Faults) -> None:
        """Note what must be mapped and is not."""
        for name in ("lanes", "free_speed"):
            if name not in self.links:
                faults.add("is needed: name a column, or a constant", column=name)
        if ("from_node_id" in self.links) != ("to_node_id" in self.links):
            faults.add("give both from_node_id and to_node_id, or neither", column="from_node_id")
        if self.nodes and "node_id" not in self.nodes:
            faults.add("is needed: name a column of the table of points", column="node_id")

    def source(self, name: str) -> Source | None:
        """Where a column of the links comes from; None: nothing is said of it."""
        written = self.links.get(name)
        return None if written is None else source_of(written)


def source_of(written: Written) -> Source:
    """A name is that of a column, a number a constant, names with values the fields of a Source."""
    if isinstance(written, Source):
        return written
    if isinstance(written, Mapping):
        return Source(**written)
    return Source(written) if isinstance(written, str) else Source(constant=written)


def quantity_of(name: str) -> str | None:
    """What the unit of a column is one of; None: it has none."""
    return NUMBERS.get(BACKWARD.get(name, name))


def factor_of(name: str, source: Source) -> tuple[Fraction, bool]:
    """What one unit of a source is in SI, and whether it is one of each lane."""
    quantity = quantity_of(name)
    if quantity is None or source.unit is None:
        return Fraction(1), False
    if quantity == "jam density":
        return Fraction(JAM_DENSITIES[source.unit]).limit_denominator(FINEST), False
    unit = parse_unit(source.unit, _parsed(quantity))
    return Fraction(unit.factor).limit_denominator(FINEST), unit.per_lane


def _parsed(quantity: str) -> Quantity:
    assert quantity in ("length", "speed", "capacity"), "the others have no parsed unit"
    return quantity  # type: ignore[return-value]


def _add_name_faults(faults: Faults, given: Mapping[str, Written], known: tuple[str, ...]) -> None:
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(str(name), known, n=1)
            hint = f"; did you mean {near[0]}?" if near else f"; known are {', '.join(known)}"
            faults.add(f"is no column that can be mapped{hint}", column=str(name))


def _is_written_well(faults: Faults, name: str, written: Written) -> bool:
    """Whether a source can be made of it: names with values must be those of its fields."""
    known = [one.name for one in fields(Source)]
    if isinstance(written, Mapping):
        for key in [key for key in written if key not in known]:
            near = difflib.get_close_matches(str(key), known, n=1)
            hint = f"; did you mean {near[0]}?" if near else f"; known are {', '.join(known)}"
            faults.add(f"{key} says nothing of a source{hint}", column=name)
        return set(written) <= set(known)
    if isinstance(written, bool) or not isinstance(written, (Source, str, int, float)):
        faults.add("must be a column, a number or a source", column=name, value=written)
        return False
    return True


def _add_source_faults(faults: Faults, name: str, source: Source) -> None:
    if (source.column is None) == (source.constant is None):
        faults.add("must have a column or a constant", column=name)
    if source.constant is not None and (source.values or source.missing is not None):
        faults.add("a constant needs neither values nor missing", column=name)
    quantity = quantity_of(name)
    if quantity is None and source.unit is not None:
        faults.add("has no unit", column=name, value=source.unit)
    elif quantity is not None:
        _add_unit_faults(faults, name, quantity, source)
    if name in NUMBERS or name in BACKWARD:
        for value in (source.constant, source.missing, *source.values.values()):
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if value is not None and not (is_number and 0 < value < math.inf):  # type: ignore[operator]
                faults.add("must be a finite number above 0", column=name, value=value)


def _add_unit_faults(faults: Faults, name: str, quantity: str, source: Source) -> None:
    if source.unit is None:
        if source.column is not None:
            what = f"the unit of the column {source.column} must be stated, as {SI[quantity]}"
            faults.add(what, column=name)
    elif quantity == "jam density":
        if source.unit not in JAM_DENSITIES:
            known = ", ".join(JAM_DENSITIES)
            what = f"is not a unit of jam density of one lane: write one of {known}"
            faults.add(what, column=name, value=source.unit)
    else:
        try:
            parse_unit(source.unit, _parsed(quantity))
        except ValueError as error:
            faults.add(str(error), column=name, value=source.unit)


def _add_direction_faults(faults: Faults, direction: Direction) -> None:
    together = [*direction.forward, *direction.backward, *direction.both]
    if not together:
        what = "says of no value of the column what it means: give forward, backward or both"
        faults.add(what, column="direction")
    for value in dict.fromkeys(one for one in together if together.count(one) > 1):
        faults.add("means two directions", column="direction", value=value)

"""What the library finds wrong with measures, told by the keys and lines that the user wrote."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from pipeline.config import Config, SimulateSection
from pipeline.config_keys import ChosenLinks, Section
from pipeline.yaml_source import Place, YamlSource, place_in_words
from uxsim_geo.demand.demand import DEFAULT_CLASS
from uxsim_geo.errors import Fault
from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM

#: where a configuration holds measures, and classes of drivers
CONTROL: Place = ("simulate", "control")
CLASSES: Place = ("simulate", "classes")

#: units of the library in those of a configuration
_UNITS = {"veh/s": (PER_HOUR, "veh/h"), "veh/m": (PER_KM, "veh/km"), "m/s": (KMH, "km/h")}
_WITH_UNIT = re.compile(r"(?:(?P<number>\d[\d.e+-]*) )?\b(?P<unit>veh/s|veh/m|m/s)\b")


def unknown_classes(config: Config, document: YamlSource) -> list[Fault]:
    """Return the faults of classes of drivers that trips name and nobody describes, and twins."""
    faults = []
    names = [entry.name for entry in config.simulate.classes]
    for number, name in enumerate(names):
        if name in names[:number]:
            place = (*CLASSES, number, "name")
            what = "there is a class of this name above; give each its own"
            faults.append(_fault(what, place, document.origin(place), name))
    known = dict.fromkeys([*names, DEFAULT_CLASS])
    for number, entry in enumerate(config.ingest.trips):
        if entry.driver_class is not None and entry.driver_class not in known:
            place = document.as_written(("ingest", "trips", number, "class"))
            what = f"simulate.classes does not describe it; there are {', '.join(known)}"
            faults.append(_fault(what, place, document.origin(place), entry.driver_class))
    return faults


def as_written(faults: Iterable[Fault], section: SimulateSection) -> list[Fault]:
    """Return faults with keys, units, file and line of the configuration.

    Those of source ``control`` or ``classes`` have the number of the measure, or class, as their
    line (from 1) and its field as their column; others stay as they are.
    """
    return [_as_written(fault, section) for fault in faults]


def _as_written(fault: Fault, section: SimulateSection) -> Fault:
    if fault.line is None or fault.source not in ("control", "classes"):
        return fault
    if fault.source == "control":
        kind, number, entry = list(section.control.entries())[fault.line - 1]
        above, origin = (*CONTROL, kind, number), section.control.origin
        found: Section = entry
    else:
        above, origin = (*CLASSES, fault.line - 1), section.origin
        found = section.classes[fault.line - 1]
    keys = _keys(found, fault.column, fault.value)
    place = (*above, *keys)
    value = _value(found, keys, fault.value)
    return _fault(_in_peoples_units(fault.what), place, origin(place), value)


def _fault(what: str, place: Place, origin: tuple[str, int | None], value: object) -> Fault:
    return Fault(f"{place_in_words(place)}: {what}", *origin, None, value)


def _keys(section: Section, column: object, value: object) -> Place:
    """Return where in a section the field of a measure is written; nothing where it is not."""
    for key in type(section).model_fields:
        if key == column or key.startswith(f"{column}_"):
            return _of_chosen(section, key)
    for key in type(section).model_fields:
        below = getattr(section, key)
        if isinstance(below, Section) and (place := _keys(below, column, value)):
            return (key, *place)
        if isinstance(below, Sequence) and (place := _keys_in_list(below, column, value)):
            return (key, *place)
    return ()


def _keys_in_list(entries: Sequence[object], column: object, value: object) -> Place:
    """Return where in a list of sections: in the first that holds the value at fault."""
    for number, entry in enumerate(entries):
        if isinstance(entry, Section) and (place := _keys(entry, column, value)):
            held = getattr(entry, str(place[-1]), None)
            if held == value or held != held or value is None:
                return (number, *place)
    return ()


def _of_chosen(section: Section, key: str) -> Place:
    """Return the key by which links are chosen, of all that stand for ``links``."""
    if isinstance(section, ChosenLinks) and key == "links" and not section.links:
        return ("polygon",) if section.where is None else ("where",)
    return (key,)


def _value(section: Section, keys: Place, value: object) -> object:
    """Return the number as it is written, where the library was told it in SI."""
    written: object = section
    for key in keys:
        written = written[key] if isinstance(key, int) else getattr(written, key)  # type: ignore[index]
    if isinstance(written, int | float) and not isinstance(written, bool):
        return written
    if isinstance(written, tuple) and written and isinstance(written[0], tuple):
        return [list(pair) for pair in written]
    return value


def _in_peoples_units(what: str) -> str:
    """Turn what is said in SI into the units that configurations are written in."""

    def turn(found: re.Match[str]) -> str:
        factor, unit = _UNITS[found["unit"]]
        number = found["number"]
        return unit if number is None else f"{float(number) * factor:g} {unit}"

    return _WITH_UNIT.sub(turn, what)

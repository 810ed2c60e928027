"""What the library finds wrong with measures, told by the keys and lines that the user wrote."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from pipeline.config import Config, SimulateSection
from pipeline.config_keys import ChosenLinks, Section
from pipeline.yaml_source import Place, YamlSource, place_in_words
from uxsim_geo.control.drivers import DEFAULT
from uxsim_geo.errors import Fault, Faults
from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM

#: where a configuration holds measures, and classes of drivers
CONTROL: Place = ("simulate", "control")
CLASSES: Place = ("simulate", "classes")

#: units of the library in those of a configuration
_UNITS = {"veh/s": (PER_HOUR, "veh/h"), "veh/m": (PER_KM, "veh/km"), "m/s": (KMH, "km/h")}
_WITH_UNIT = re.compile(r"(?:(?P<number>\d[\d.e+-]*) )?\b(?P<unit>veh/s|veh/m|m/s)\b")
#: keys that choose links, the first given stands for all of them
_CHOOSE = ("links", "where", "polygon", "street")
_MEASURE = re.compile(r"\bmeasure (?P<number>\d+)\b")


def class_faults(config: Config, document: YamlSource) -> list[Fault]:
    """Return what is wrong with classes of drivers, as far as that needs no network."""
    section, faults = config.simulate, Faults("classes")
    names = [entry.name for entry in section.classes]
    for number, entry in enumerate(section.classes, start=1):
        own = Faults()
        entry.driver_class().add_faults(own)
        if entry.name in names[: number - 1]:
            what = "there is a class of this name above; give each its own"
            own.add(what, column="name", value=entry.name)
        for fault in own.found:
            faults.add(fault.what, line=number, column=fault.column, value=fault.value)
    return [*as_written(faults.found, section), *_faults_of_trips(config, document)]


def _faults_of_trips(config: Config, document: YamlSource) -> Iterator[Fault]:
    """Yield a fault for every entry of trips whose class nobody describes."""
    known = dict.fromkeys([*(one.name for one in config.simulate.classes), DEFAULT])
    named = {
        "trips": [entry.driver_class for entry in config.ingest.trips],
        "demand": [entry.driver_class for entry in config.ingest.demand],
    }
    for key, names in named.items():
        for number, name in enumerate(names):
            if name is not None and name not in known:
                place = document.as_written(("ingest", key, number, "class"))
                what = f"simulate.classes does not describe it; there are {', '.join(known)}"
                yield _fault(what, place, document.origin(place), name)


def as_written(faults: Iterable[Fault], section: SimulateSection) -> list[Fault]:
    """Return faults with keys, units, file and line of the configuration, in its order.

    Those of source ``control`` or ``classes`` have the number of the measure, or class, as their
    line (from 1) and its field as their column; others stay as they are.
    """
    told = [_as_written(fault, section) for fault in faults]
    # how many more there are stands at no place, and comes last
    return sorted(told, key=lambda fault: (not fault.source, fault.source, fault.line or 0))


def _as_written(fault: Fault, section: SimulateSection) -> Fault:
    if fault.line is None or fault.source not in ("control", "classes"):
        return fault
    entry: Section
    if fault.source == "control":
        above, entry = _measure(fault.line, section)
        origin = section.control.origin
    else:
        above, entry = (*CLASSES, fault.line - 1), section.classes[fault.line - 1]
        origin = section.origin
    keys = _keys(entry, fault.column, fault.value)
    place = (*above, *keys)
    what = _with_places(_in_peoples_units(fault.what), section)
    return _fault(what, place, origin(place), _value(entry, keys, fault.value))


def _measure(number: int, section: SimulateSection) -> tuple[Place, Section]:
    """Return place and entry of a measure by its number, from 1."""
    kind, position, entry = list(section.control.entries())[number - 1]
    return (*CONTROL, kind, position), entry


def _with_places(what: str, section: SimulateSection) -> str:
    """Name other measures by their place and line, where the library numbers them."""

    def name(found: re.Match[str]) -> str:
        place, _ = _measure(int(found["number"]), section)
        _, line = section.control.origin(place)
        return f"{place_in_words(place)}, line {line}" if line else place_in_words(place)

    return _MEASURE.sub(name, what)


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
    if isinstance(section, ChosenLinks) and key == "links":
        return (next((name for name in _CHOOSE if getattr(section, name)), key),)
    return (key,)


def _value(section: Section, keys: Place, value: object) -> object:
    """Return the number as it is written, where the library was told it in SI."""
    written: object = section
    for key in keys:
        written = written[key] if isinstance(key, int) else getattr(written, key)  # type: ignore[index]
    if isinstance(written, int | float):
        return _plain(written)
    if isinstance(written, tuple) and written and isinstance(written[0], tuple):
        return [[_plain(number) for number in pair] for pair in written]
    return value


def _plain(number: float) -> float:
    """Return a whole number as one, as it is written."""
    return int(number) if float(number).is_integer() else number


def _in_peoples_units(what: str) -> str:
    """Turn what is said in SI into the units that configurations are written in."""

    def turn(found: re.Match[str]) -> str:
        factor, unit = _UNITS[found["unit"]]
        number = found["number"]
        return unit if number is None else f"{float(number) * factor:g} {unit}"

    return _WITH_UNIT.sub(turn, what)

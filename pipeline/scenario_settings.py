"""Edits of any keys of a configuration: other values in a copy of its document."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from pathlib import Path

from pipeline.config_file import keys_of_lists
from pipeline.config_keys import Reading
from pipeline.config_paths import rebased
from pipeline.scenario_names import StudyPlace
from pipeline.yaml_source import Place, YamlSource, place_in_words, put_value
from uxsim_geo.errors import Fault, Faults

#: keys that a scenario must not set this way, and what to do in their place
ELSEWHERE = {
    "name": "runs have the names of their scenarios",
    "simulate.seed": "give seeds at the top of the study",
    "simulate.control": "write it as an edit control, close, signal ...",
    "edits": "write them as edits of the scenario",
}


def with_settings(
    base: Reading, edits: Sequence[StudyPlace], study: Reading, faults: list[Fault]
) -> Reading:
    """Return a copy of the base with the values that edits of keys set; faults are noted."""
    document = copy.deepcopy(base.document)
    setters: dict[str, tuple[object, Place]] = {}
    for placed in edits:
        for dotted, place, value in _assignments(placed):
            fault = _contradiction(dotted, value, setters)
            if fault is None:
                setters[dotted] = (value, place)
                own = _put(document, dotted.split("."), (value, study.folder), place, study)
                faults += own
                continue
            faults.append(Fault(f"{place_in_words(place)}: {fault}", *study.document.origin(place)))
    return Reading(document, base.folder)


def _assignments(placed: StudyPlace) -> Iterator[tuple[str, Place, object]]:
    """Yield dotted key, place in the study and value of each key that an edit sets."""
    key, values = placed.edit.only()
    if key in ("simulate", "config"):
        above = "simulate." if key == "simulate" else ""
        for own, value in values.items():
            yield f"{above}{own}", (*placed.place, key, own), value


def _contradiction(
    dotted: str, value: object, setters: dict[str, tuple[object, Place]]
) -> str | None:
    """Say why a key must not be set: elsewhere, or to another value by an edit before."""
    for known, advice in ELSEWHERE.items():
        if dotted == known or (known == "edits" and dotted.startswith("edits.")):
            return advice
    for other, (before, at) in setters.items():
        same = other == dotted and before == value
        overlaps = other == dotted or f"{other}.".startswith(f"{dotted}.")
        if overlaps and not same:
            return f"contradicts {place_in_words(at)}, which sets {other} too; keep one"
    return None


def _put(
    document: YamlSource,
    keys: list[str],
    told: tuple[object, Path],
    place: Place,
    study: Reading,
) -> list[Fault]:
    """Put a value under keys, with where it stands in the study; return what is wrong."""
    value, folder = told
    own = Faults()
    at = put_value(document, keys, rebased(value, keys, folder), own, keys_of_lists())
    if at:
        document.forget_origins(at)
        document.take_origins(study.document, place, at)
    origin = study.document.origin(place)
    return [Fault(f"{place_in_words(place)}: {one.what}", *origin) for one in own.found]

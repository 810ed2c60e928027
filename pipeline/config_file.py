"""Configurations read from YAML files, with every fault at its line, and written out resolved."""

from __future__ import annotations

import difflib
import inspect
import os
import re
import typing
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from pipeline.config import Config
from pipeline.config_keys import Reading, Section, existing_file
from pipeline.control_config import ControlSection
from pipeline.control_config_faults import CONTROL, class_faults
from pipeline.yaml_source import Place, YamlSource, place_in_words, read_yaml, set_value
from uxsim_geo.errors import MOST_FAULTS, Fault, InputError
from uxsim_geo.files import replace_when_complete

_Model = TypeVar("_Model", bound=BaseModel)

#: how the messages of the validator begin
_SHOULD = re.compile(r"^(Input|Number|String|Tuple) should")

#: what to say in place of messages that speak of Python, by their type
_PLAINLY = {
    "model_type": "must be a section (keys and values)",
    "path_type": "must be the path of a file",
    "string_pattern_mismatch": "must not be empty, hold other characters, or begin with - or .",
    "timezone_aware": "must name its zone, as in 2024-05-01T07:00:00+02:00, or with Z for UTC",
    "tuple_type": "must be a list, as [a, b]",
}


def load_config(path: Path, edits: Sequence[str] = ()) -> Config:
    """Read a configuration, with ``key.sub=value`` edits in place of what the file says.

    Raises :class:`uxsim_geo.errors.InputError` with all faults: line, key, value, what to do.
    """
    return config_of(read_config(path, edits))


def read_config(path: Path, edits: Sequence[str] = ()) -> Reading:
    """Read a configuration, which is not checked yet; ``edits`` as for :func:`load_config`."""
    document = read_yaml(path)
    for edit in edits:
        set_value(document, edit, keys_of_lists())
    return Reading(document, path.resolve().parent)


def config_of(reading: Reading) -> Config:
    """Check what was read; raises :class:`uxsim_geo.errors.InputError` as :func:`load_config`."""
    faults: list[Fault] = []
    _take_in_control_file(reading, faults)
    config = validated(Config, reading.document.values, reading, faults)
    if config is not None:
        faults += class_faults(config, reading.document)
    if config is None or faults:
        raise InputError(faults)
    return config


def keys_of_lists() -> list[str]:
    """Return the keys that hold a list of sections, or a single one plainly."""
    return [dotted for dotted, key in iterate_keys() if _one_or_many(key)]


def write_config(config: Config, path: Path) -> None:
    """Write every key with its value; files are named relative to ``path``, so that it runs."""
    values = plain_values(config, path.resolve().parent)
    text = yaml.safe_dump(values, sort_keys=False, allow_unicode=True, width=100)
    with replace_when_complete(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def plain_values(section: Section, folder: Path) -> dict[str, Any]:
    """Return what YAML and JSON can hold; files are named relative to ``folder``."""
    return named_values(section, lambda path: relative_name(path, folder))


def named_values(section: Section, name_of: Callable[[Path], str]) -> dict[str, Any]:
    """Return what YAML and JSON can hold; ``name_of`` says how a file or folder is named."""
    values = section.model_dump(by_alias=True)
    return {name: _plain(value, name_of) for name, value in values.items()}


def relative_name(path: Path, folder: Path) -> str:
    """Return the path from ``folder`` to a file; the absolute one if no path leads there."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return path.as_posix()


def iterate_keys(
    model: type[BaseModel] = Config, above: str = ""
) -> Iterator[tuple[str, FieldInfo]]:
    """Yield every key by its dotted name, sections before what they hold; lists add no name."""
    for field, key in model.model_fields.items():
        dotted = f"{above}{key.alias or field}"
        yield dotted, key
        for section in sections_in(key.annotation):
            yield from iterate_keys(section, f"{dotted}.")


def sections_in(annotation: object) -> Iterator[type[BaseModel]]:
    """Yield the models that the type of a key mentions: its own keys are theirs."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in typing.get_args(annotation):
        yield from sections_in(argument)


@dataclass(frozen=True)
class At:
    """Where in a document keys stand, and what is known of them.

    ``model`` has the keys from ``root`` parts of the place on: of a configuration from the top.
    """

    place: Place = ()
    model: type[BaseModel] = Config
    root: int = 0

    def _dotted(self, place: Place) -> str:
        """Return the name of a key, which is the same in all entries of a list."""
        return ".".join(part for part in place[self.root :] if isinstance(part, str))

    def help(self, place: Place) -> str | None:
        """What the key at a place means; of an entry of pairs what they are."""
        keys, dotted = dict(iterate_keys(self.model)), self._dotted(place)
        while dotted and dotted not in keys:
            dotted = dotted.rpartition(".")[0]
        return keys[dotted].description if dotted else inspect.getdoc(self.model)

    def nearest(self, place: Place) -> str:
        """Say which known key an unknown one may be meant for."""
        section, _, name = self._dotted(place).rpartition(".")
        known = [key for key, _ in iterate_keys(self.model)]
        elsewhere = [key for key in known if key.rpartition(".")[2] == name]
        here = {key.rpartition(".")[2]: key for key in known if key.rpartition(".")[0] == section}
        alike = [here[near] for near in difflib.get_close_matches(name, here, n=1)]
        for key in (*alike, *elsewhere):
            return f"did you mean {key}?"
        return f"known here: {', '.join(here)}"


#: a configuration as a whole
ROOT = At()


def _take_in_control_file(reading: Reading, faults: list[Fault]) -> None:
    """Put what a control file holds in the place of its path; its faults are of its own lines."""
    section = reading.document.values.get("simulate")
    if not isinstance(section, dict) or not isinstance(section.get("control"), str):
        return
    name, section["control"] = section["control"], {}
    try:
        path = existing_file(Path(name), reading.folder)
        read = read_yaml(path)
    except InputError as error:
        faults += error.faults
        return
    except ValueError as error:
        what = f"{place_in_words(CONTROL)}: {error} ({ROOT.help(CONTROL)})"
        faults.append(Fault(what, *reading.document.origin(CONTROL), None, name))
        return
    own = Reading(read.below(CONTROL), path.parent)
    control = validated(ControlSection, read.values, own, faults, At(CONTROL))
    section["control"] = control or {}


def validated(
    model: type[_Model],
    values: object,
    reading: Reading,
    faults: list[Fault],
    at: At = ROOT,
) -> _Model | None:
    """Make a model of plain values that stand somewhere; None and all faults if they are not."""
    try:
        return model.model_validate(values, context=reading)
    except ValidationError as error:
        found = [
            details
            for details in error.errors()
            if not (_follows(details) or _of_another_form(details))
        ]
        found.sort(key=lambda details: _origin(details, at, reading.document)[1] or 0)
        faults += [_fault(details, at, reading.document) for details in found[:MOST_FAULTS]]
        if len(found) > MOST_FAULTS:
            what = f"and {len(found) - MOST_FAULTS:,} more faults"
            faults.append(Fault(what, reading.document.source))
    return None


def _origin(details: ErrorDetails, at: At, document: YamlSource) -> tuple[str, int | None]:
    """Source and line of what is at fault."""
    return document.origin(document.as_written((*at.place, *_keys_alone(details))))


def _one_or_many(key: FieldInfo) -> bool:
    return typing.get_origin(key.annotation) is tuple and any(sections_in(key.annotation))


def _plain(value: object, name_of: Callable[[Path], str]) -> object:
    if isinstance(value, dict):
        return {key: _plain(item, name_of) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, name_of) for item in value]
    if isinstance(value, Path):
        return name_of(value)
    return value.isoformat() if isinstance(value, datetime) else value


def _fault(details: ErrorDetails, at: At, document: YamlSource) -> Fault:
    place = (*at.place, *_keys_alone(details))
    written = document.as_written(place)
    source, line = document.origin(written)
    key = place_in_words(written)
    value = details["input"]
    if details["type"] == "extra_forbidden":
        return Fault(f"unknown key {key}; {at.nearest(written)}", source, line)
    if details["type"] == "missing":
        lacks = ": a value is missing" if isinstance(place[-1], int) else " is missing"
        return Fault(f"{key}{lacks} ({at.help(written)})", source, line)
    said = _SHOULD.sub("must", details["msg"].removeprefix("Value error, "))
    what = _PLAINLY.get(details["type"], said)
    shown = None if isinstance(value, dict | list) else value
    return Fault(f"{key}: {what} ({at.help(written)})", source, line, None, shown)


def _keys_alone(details: ErrorDetails) -> Place:
    """Leave out what pydantic says of the form that was tried, as ``function-after[...]``."""
    return tuple(part for part in details["loc"] if "[" not in str(part))


def _of_another_form(details: ErrorDetails) -> bool:
    """Tell whether a section is only said not to be the word that could stand in its place."""
    forms = [part for part in details["loc"] if str(part).startswith("literal[")]
    return bool(forms) and not isinstance(details["input"], bool)


def _follows(details: ErrorDetails) -> bool:
    """Tell whether a list is only said to be too short because its entries are at fault."""
    return details["type"] == "too_short" and bool(details["input"])

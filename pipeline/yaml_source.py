"""YAML as plain values that remember the line each of them stands on."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import yaml

from uxsim_geo.errors import Faults
from uxsim_geo.network.text import read_lines

#: where a value stands in a document: keys of mappings and positions in lists, from the top
Place = tuple[str | int, ...]


#: of a file; YAML is read slowly
MOST_CHARACTERS = 1_000_000


@dataclass
class YamlSource:
    """A YAML document as plain dicts, lists, texts, numbers, booleans and None.

    lines
        line of the key (in a mapping) or of the item (in a list), by place
    origins
        source and line of what does not come from the file (``--set``, edits of a study), by place
    """

    source: str
    values: dict[str, object] = field(default_factory=dict)
    lines: dict[Place, int] = field(default_factory=dict)
    origins: dict[Place, tuple[str, int | None]] = field(default_factory=dict)

    def origin(self, place: Place) -> tuple[str, int | None]:
        """Return source and line of the value at ``place``, or of what it would stand in."""
        for length in range(len(place), 0, -1):
            if place[:length] in self.origins:
                return self.origins[place[:length]]
            if place[:length] in self.lines:
                return self.source, self.lines[place[:length]]
        return self.source, None

    def as_written(self, place: Place) -> Place:
        """Leave out positions in lists where the document gives a single entry plainly."""
        written: Place = ()
        container: object = self.values
        for part in place:
            if isinstance(part, int) and not isinstance(container, list):
                continue
            written = (*written, part)
            if isinstance(container, dict):
                container = container.get(part)
            elif isinstance(container, list) and isinstance(part, int):
                container = container[part] if part < len(container) else None
        return written

    def take_origins(self, other: YamlSource, from_place: Place, place: Place) -> None:
        """Note that what stands at ``place`` here is what stands at ``from_place`` elsewhere."""
        depth = len(from_place)
        self.origins[place] = other.origin(from_place)
        for own in (*other.lines, *other.origins):
            if own[:depth] == from_place:
                self.origins[(*place, *own[depth:])] = other.origin(own)

    def forget_origins(self, place: Place) -> None:
        """Forget where what stands at ``place`` came from: something else stands there now."""
        depth = len(place)
        self.lines = {own: line for own, line in self.lines.items() if own[:depth] != place}
        self.origins = {own: at for own, at in self.origins.items() if own[:depth] != place}

    def below(self, place: Place) -> YamlSource:
        """Return the document as if it stood at a place of another one, under its own name."""
        values: object = self.values
        for part in reversed(place):
            values = {part: values}
        lines = {(*place, *own): line for own, line in self.lines.items()}
        return YamlSource(self.source, cast("dict[str, object]", values), lines)


def place_in_words(place: Place) -> str:
    """Write a place for people: ``simulate.control.tolls[0].amount``."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in place)
    return "".join(parts).removeprefix(".")


_TAG = "tag:yaml.org,2002:"


class _Loader(yaml.SafeLoader):
    """YAML 1.2's idea of plain scalars: ``no`` is a text, ``1e3`` a number, 12:30 a text."""


_Loader.yaml_implicit_resolvers = {}
for _tag, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", [*"~nN", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    # 19 digits hold every seed; longer ones read as float, which no whole number may be, and so do
    # 007 and +7, which as ids are other texts than 7
    ("int", r"-?(0|[1-9][0-9]{0,18})", "-0123456789"),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"
        r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        "-+.0123456789",
    ),
):
    _Loader.add_implicit_resolver(f"{_TAG}{_tag}", re.compile(f"^(?:{_pattern})$"), list(_first))


def read_yaml(path: Path) -> YamlSource:
    """Read a mapping from a YAML file.

    Raises :class:`uxsim_geo.errors.InputError` for a file that cannot be read, is not text, not
    YAML, empty or no mapping, and for duplicate keys, aliases and tags.
    """
    faults = Faults(str(path))
    text = read_lines(path, faults)
    if text is not None and sum(map(len, text)) > MOST_CHARACTERS:
        faults.add(
            f"has over {MOST_CHARACTERS:,} characters, more than a configuration needs: is it the "
            "right file? Choose many links by where, street or polygon, not by their ids"
        )
    faults.raise_if_any()
    return yaml_of("\n".join(text or []), str(path))


def yaml_of(text: str, source: str) -> YamlSource:
    """Read a mapping from text that comes from ``source``; raises as :func:`read_yaml`."""
    document = YamlSource(source)
    faults = Faults(document.source)
    node = _compose(text, faults)
    faults.raise_if_any()
    if isinstance(node, yaml.MappingNode):
        document.values = _Reader(document, faults).mapping(node, ())
    else:
        what = "holds no key" if node is None else "must hold lines of the form 'key: value'"
        faults.add(f"{what}; start with a copy of a file in configs/")
    faults.raise_if_any()
    return document


def set_value(document: YamlSource, assignment: str, lists: Collection[str] = ()) -> None:
    """Put ``key.sub=value`` in the place of what the document says; lists take positions from 0.

    ``lists`` are the keys that hold a list of mappings, or a single one plainly: that is entry 0.

    Raises :class:`uxsim_geo.errors.InputError` where the assignment cannot be understood.
    """
    dotted, value = read_assignment(assignment)
    faults = Faults(f"--set {assignment}")
    place = put_value(document, dotted.split("."), value, faults, lists)
    faults.raise_if_any()
    document.origins[place] = (faults.source, None)


def read_assignment(assignment: str) -> tuple[str, object]:
    """Read ``key.sub=value``, with the value as in YAML; raises as :func:`set_value`."""
    faults = Faults(f"--set {assignment}")
    dotted, equals, text = assignment.partition("=")
    keys = dotted.strip().split(".")
    if not equals or not all(keys):
        faults.add("must have the form key.sub=value, as in simulate.duration_s=3600")
    node = _compose(text, faults)
    faults.raise_if_any()
    value = None if node is None else _Reader(YamlSource(faults.source), faults).value(node, ())
    faults.raise_if_any()
    return ".".join(keys), value


def put_value(
    document: YamlSource,
    keys: list[str],
    value: object,
    faults: Faults,
    lists: Collection[str] = (),
) -> Place:
    """Put a value under some keys, as :func:`set_value` does; returns its place."""
    before = len(faults.found)
    keys = _as_written(document.values, keys, lists, faults)
    return _assign(document.values, keys, value, faults) if len(faults.found) == before else ()


def _as_written(
    values: dict[str, object], keys: list[str], lists: Collection[str], faults: Faults
) -> list[str]:
    """Leave out position 0 where the document gives the single entry of a list plainly."""
    container: object = values
    for depth, key in enumerate(keys):
        if isinstance(container, dict) and key.isdecimal() and ".".join(keys[:depth]) in lists:
            if int(key) > 0:
                _add_position(faults, keys, depth, 1)
            return keys[:depth] + keys[depth + 1 :]
        container = container.get(key) if isinstance(container, dict) else None
    return keys


def _add_position(faults: Faults, keys: list[str], depth: int, entries: int) -> None:
    rest = keys[depth + 1 :] if keys[depth].isdecimal() else keys[depth:]
    example = ".".join([*keys[:depth], "0", *rest])
    what = "entry" if entries == 1 else "entries"
    faults.add(f"the list has {entries} {what}, counted from 0: write {example} for the first")


def _assign(values: dict[str, object], keys: list[str], value: object, faults: Faults) -> Place:
    """Write ``value`` under ``keys``, making the mappings on the way; return its place."""
    container: Any = values
    place: Place = ()
    for key in keys:
        index: str | int = key
        if isinstance(container, list):
            if not (key.isdecimal() and int(key) < len(container)):
                _add_position(faults, keys, len(place), len(container))
                return place
            index = int(key)
        elif not isinstance(container, dict):
            faults.add(f"{'.'.join(map(str, place))} is a single value, without keys of its own")
            return place
        place = (*place, index)
        if len(place) == len(keys):
            container[index] = value
        elif isinstance(container, dict) and container.get(key) is None:
            container[index] = {}
        container = container[index]
    return place


def _compose(text: str, faults: Faults) -> yaml.Node | None:
    try:
        return yaml.compose(text, _Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        what = f"is not YAML: {error.problem or error.context}"
        line, column = (mark.line + 1, mark.column + 1) if mark else (None, None)
        faults.add(what, line=line, column=column)
    except yaml.YAMLError:
        faults.add("is not YAML: it holds characters that no text has; is it a binary file?")
    except RecursionError:
        faults.add("is nested too deeply to be a configuration")
    return None


class _Reader:
    """Turns YAML nodes into plain values, noting the line of each."""

    def __init__(self, document: YamlSource, faults: Faults) -> None:
        self.document = document
        self.faults = faults
        self.seen: set[int] = set()

    def value(self, node: yaml.Node, place: Place) -> object:
        if id(node) in self.seen:
            self._add("aliases (*name) are not understood here; write the value out", node)
            return None
        self.seen.add(id(node))
        if isinstance(node, yaml.MappingNode):
            return self.mapping(node, place)
        if isinstance(node, yaml.SequenceNode):
            self._check_tag(node, "seq")
            return [self._item(item, (*place, i)) for i, item in enumerate(node.value)]
        return self._scalar(node)

    def mapping(self, node: yaml.MappingNode, place: Place) -> dict[str, object]:
        values: dict[str, object] = {}
        self._check_tag(node, "map")
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                self._add("a key must be a single word", key_node)
                continue
            key = str(key_node.value)
            if key in values:
                first = self.document.lines[(*place, key)]
                self._add(f"the key is given twice, first in line {first}; keep one", key_node)
                continue
            self.document.lines[(*place, key)] = key_node.start_mark.line + 1
            values[key] = self.value(value_node, (*place, key))
        return values

    def _item(self, node: yaml.Node, place: Place) -> object:
        self.document.lines[place] = node.start_mark.line + 1
        return self.value(node, place)

    def _scalar(self, node: yaml.Node) -> object:
        text = str(node.value)
        match node.tag.removeprefix(_TAG):
            case "str":
                return text
            case "null":
                return None
            case "bool":
                return text.lower() == "true"
            case "int":
                return int(text)
            case "float":
                return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
        self._add("tags are not understood here; write a plain value", node)
        return None

    def _check_tag(self, node: yaml.Node, plain: str) -> None:
        """Note a tag of a list or mapping, which would make something else of it."""
        if node.tag != f"{_TAG}{plain}":
            self._add(f"tags are not understood here, as {node.tag}; leave it out", node)

    def _add(self, what: str, node: yaml.Node) -> None:
        shown = node.value if isinstance(node, yaml.ScalarNode) else None
        self.faults.add(what, line=node.start_mark.line + 1, value=shown)

"""What two runs were told differently: keys of their configurations, versions, links of control."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pipeline.config import Config
from pipeline.config_keys import ChosenLinks
from pipeline.runs import Manifest, RunFolder

if TYPE_CHECKING:
    from uxsim_geo.network.network import Network

#: how a key is told that one side lacks
NONE = "–"


class Difference(NamedTuple):
    """A key by its dotted name, entries of lists counted from 0, and both values as text."""

    key: str
    a: str
    b: str

    def __str__(self) -> str:
        return f"{self.key}: {self.a} in A, {self.b} in B"


class Told(NamedTuple):
    """A run: its folder, what its manifest holds, and the configuration in it."""

    folder: RunFolder
    manifest: Manifest
    config: Config


def differences(a: Told, b: Told) -> list[Difference]:
    """Every key whose value differs, but for names; then versions, and whether the program does.

    An entry of a list that one side lacks is one difference.
    """
    sides = [_placed(told.config.model_dump(by_alias=True), told.folder.path) for told in (a, b)]
    for side in sides:
        del side["name"]
    versions = _versions(a.manifest), _versions(b.manifest)
    return [*_unequal(sides[0], sides[1]), *_unequal(*versions)]


def differing_links(a: Told, b: Told, networks: tuple[Network, Network]) -> tuple[str, ...]:
    """The link_ids that a measure of control is about which only one of both runs has."""
    sides = []
    for told in (a, b):
        entries = told.config.simulate.control.entries()
        sides.append({(kind, _as_text(entry.model_dump())): entry for kind, _, entry in entries})
    found: dict[str, None] = {}
    for own, other, network in zip(sides, reversed(sides), networks, strict=True):
        for key, entry in own.items():
            if key not in other and isinstance(entry, ChosenLinks):
                found |= dict.fromkeys(_links_of(entry, network))
    return tuple(found)


def _links_of(entry: ChosenLinks, network: Network) -> list[str]:
    from uxsim_geo.network.selection import select_links

    rows = select_links(network, entry.target())
    return [str(link) for link in network.links["link_id"].iloc[rows]]


def _versions(manifest: Manifest) -> dict[str, str]:
    """Versions of libraries, and the content of the program that simulated."""
    found = {f"versions.{name}": str(value) for name, value in _mapping(manifest.run, "versions")}
    code = manifest.stages["simulate"].settings.get("code", "")
    return found | {"program (SHA-256 of its source)": str(code)[:12]}


def _mapping(run: Mapping[str, Any], name: str) -> Iterator[tuple[str, Any]]:
    value = run.get(name)
    return iter(value.items() if isinstance(value, dict) else ())


def _unequal(a: Any, b: Any, key: str = "") -> Iterator[Difference]:
    """Where two values differ, as deep as both have keys or entries."""
    if isinstance(a, dict) and isinstance(b, dict):
        for name in dict.fromkeys((*a, *b)):
            below = f"{key}.{name}" if key else str(name)
            yield from _unequal(a.get(name, NONE), b.get(name, NONE), below)
    elif _has_sections(a) or _has_sections(b):
        first, second = (dict(enumerate(side)) if isinstance(side, list) else {} for side in (a, b))
        yield from _unequal(first, second, key)
    elif a != b:
        yield Difference(key, _as_text(a), _as_text(b))


def _has_sections(value: object) -> bool:
    return isinstance(value, list) and any(isinstance(one, dict) for one in value)


def _placed(value: Any, folder: Path) -> Any:
    """The same with files named by where they are, wherever the run lies."""
    if isinstance(value, dict):
        return {name: _placed(part, folder) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_placed(part, folder) for part in value]
    return str((folder / value).resolve()) if isinstance(value, Path) else value


def _as_text(value: object) -> str:
    """As it would be written, without the keys of a section that say nothing."""
    if isinstance(value, str):
        return value
    if isinstance(value, dict):
        value = {name: part for name, part in value.items() if part not in (None, [], ())}
    return json.dumps(value, ensure_ascii=False, default=str)

"""The networks of the TNTP collection that are known by name, and what each of their files must be.

The collection is a repository of donated data, Transportation Networks for Research. Its files are
no part of this program: ``tntp_collection.toml`` has their names, sizes and SHA-256 at one commit,
and what of their units is known.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from uxsim_geo.errors import Fault, InputError

#: what a file is; ingestion has a key of this name for each
Role = Literal["net", "nodes", "flow", "trips"]

ROLES: tuple[Role, ...] = get_args(Role)

SHIPPED = Path(__file__).with_name("tntp_collection.toml")


@dataclass(frozen=True)
class KnownFile:
    """A file by its name, size in bytes and SHA-256 (hexadecimal)."""

    name: str
    size: int
    sha256: str


@dataclass(frozen=True)
class KnownNetwork:
    """A network of the collection.

    name
        of its folder there
    about, note
        what it is; what to know before it is used, may be empty
    zones, nodes, links
        as its network file declares them
    keys
        of ingestion, by which its files are understood: units, CRS
    files
        by what they are; net is always there
    """

    name: str
    about: str
    note: str
    zones: int
    nodes: int
    links: int
    keys: Mapping[str, str]
    files: Mapping[Role, KnownFile]

    @property
    def size(self) -> int:
        """Bytes of all files."""
        return sum(file.size for file in self.files.values())


@dataclass(frozen=True)
class Collection:
    """The networks by name, where they come from, and on which terms.

    repository, commit
        where the files are kept, and the version of them
    url
        of the folder that holds the networks' folders
    citation, terms
        whom to name as the source, and what the data may be used for
    credit
        both in one short line, to stand on pictures
    """

    repository: str
    commit: str
    url: str
    citation: str
    terms: str
    credit: str
    networks: Mapping[str, KnownNetwork]

    @property
    def source(self) -> str:
        """The collection, as it wants to be named, with the version."""
        return f"{self.citation}, {self.repository}, commit {self.commit}"

    def url_of(self, network: KnownNetwork, file: KnownFile) -> str:
        """Return where a file is downloaded from."""
        return f"{self.url}/{network.name}/{file.name}"

    def find(self, name: str) -> KnownNetwork:
        """Return a network by its name: case, blanks, - and _ do not matter.

        Raises :class:`uxsim_geo.errors.InputError` with the nearest known name.
        """
        known = {_folded(each): each for each in self.networks}
        if _folded(name) in known:
            return self.networks[known[_folded(name)]]
        near = difflib.get_close_matches(_folded(name), known, n=1)
        hint = f"did you mean {known[near[0]]}? " if near else ""
        what = f"no data set is known by the name {name}; {hint}There are "
        raise InputError([Fault(what + ", ".join(self.networks))])


def read_collection() -> Collection:
    """Return the collection that is shipped with the program."""
    told = tomllib.loads(SHIPPED.read_text(encoding="utf-8"))
    told["url"] = told["url"].format(commit=told["commit"])
    networks = {}
    for name, network in told.pop("networks").items():
        files = network.pop("files")
        known = {role: KnownFile(**files[role]) for role in ROLES if role in files}
        networks[name] = KnownNetwork(name=name, files=known, **network)
    return Collection(networks=networks, **told)


def _folded(name: str) -> str:
    return "".join(filter(str.isalnum, name.casefold()))

"""Files of the TNTP collection: downloaded once, then kept, and believed by their SHA-256 alone.

A file that somebody has put into its place is as good as one that was downloaded.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from uxsim_geo.errors import Faults
from uxsim_geo.files import replace_when_complete, sha256_of
from uxsim_geo.network.bounded_http import Patience, Refusal, Unreachable, get_file
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes, with_notes_in_front
from uxsim_geo.network.tntp_collection import Collection, KnownFile, KnownNetwork, Role

#: of a file in the cache: as it should be, not there, or something else
State = Literal["right", "absent", "other"]


@dataclass(frozen=True)
class Shelf:
    """Where files of a collection are kept: a folder with one for each network."""

    collection: Collection
    folder: Path

    def folder_of(self, network: KnownNetwork) -> Path:
        """Return where the files of a network lie, or will."""
        return self.folder / network.name

    def path_of(self, network: KnownNetwork, role: Role) -> Path:
        """Return where a file lies, or will."""
        return self.folder_of(network) / network.files[role].name

    def state_of(self, network: KnownNetwork, role: Role) -> State:
        """Tell whether a file is there, and is the one that it must be."""
        path, file = self.path_of(network, role), network.files[role]
        try:
            size = path.stat().st_size
            same = size == file.size and sha256_of(path) == file.sha256
        except FileNotFoundError:
            return "absent"
        except OSError:
            return "other"  # it cannot be read, or is no file
        return "right" if same else "other"

    def lacking(self, network: KnownNetwork, roles: Iterable[Role]) -> dict[Role, State]:
        """Return the files that are not as they should be, and what is there instead."""
        states = {role: self.state_of(network, role) for role in roles}
        return {role: state for role, state in states.items() if state != "right"}


def download_network(
    shelf: Shelf,
    network: KnownNetwork,
    roles: Sequence[Role],
    *,
    patience: Patience | None = None,
    say: Callable[[str], None] = lambda _line: None,
) -> dict[Role, Path]:
    """See to it that files of a network are on the shelf; return where they lie.

    Those that are there and right are not asked for. ``say`` is told of every file that is. Raises
    :class:`uxsim_geo.errors.InputError` with how to go on by hand where one cannot be had.
    """
    faults = Faults(network.name)
    try:
        lacking = shelf.lacking(network, roles)
        reasons = _download(shelf, network, lacking, patience or Patience(timeout_s=30.0), say)
        if reasons:
            by_hand = _by_hand(shelf, network, shelf.lacking(network, roles))
            faults.add(f"{'; '.join(reasons)}; {by_hand}")
    except OSError as error:
        what = f"cannot be written to the cache {shelf.folder_of(network)}: {error.strerror}"
        faults.add(what)
    faults.raise_if_any()
    return {role: shelf.path_of(network, role) for role in roles}


def note_source(
    network: Network, shelf: Shelf, known: KnownNetwork, roles: Iterable[Role]
) -> Network:
    """Return the network with notes, in front of its own, of where its files came from."""
    notes, collection = Notes(), shelf.collection
    what = f"{collection.source}; {collection.terms}"
    notes.add("source", what, value=f"{collection.url}/{known.name}")
    for role in roles:
        file = known.files[role]
        notes.add("source", f"SHA-256 of {file.name}", value=file.sha256)
    return with_notes_in_front(network, notes)


def _download(
    shelf: Shelf,
    network: KnownNetwork,
    lacking: dict[Role, State],
    patience: Patience,
    say: Callable[[str], None],
) -> list[str]:
    """Download files; return why some could not be had."""
    reasons: list[str] = []
    for role, state in lacking.items():
        file, path = network.files[role], shelf.path_of(network, role)
        if state == "other":
            say(f"{path} is another file, by its SHA-256; it is downloaded anew")
        try:
            content = _right_content(shelf.collection.url_of(network, file), file, patience)
        except Refusal as refusal:
            reasons.append(str(refusal))
            if isinstance(refusal, Unreachable):
                break  # whoever is not there for one file is not there for the next
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        with replace_when_complete(path) as temporary:
            temporary.write_bytes(content)
        say(f"{path}: {file.size:,} bytes, downloaded")
    return reasons


def _right_content(url: str, file: KnownFile, patience: Patience) -> bytes:
    content = get_file(url, file.size, patience)
    if len(content) < file.size:
        what = f"the answer has {len(content):,} bytes, and the file {file.size:,}"
        raise Refusal(f"{url}: {what}")
    digest = hashlib.sha256(content).hexdigest()
    if digest != file.sha256:
        what = f"the answer is another file: its SHA-256 is {digest}, and should be {file.sha256}"
        raise Refusal(f"{url}: {what}")
    return content


def _by_hand(shelf: Shelf, network: KnownNetwork, lacking: dict[Role, State]) -> str:
    """How to do without the server: which files belong where."""
    place = f"to do without it, put into {shelf.folder_of(network)} by hand"
    lines = [f"{place} what is at"]
    for role, state in lacking.items():
        instead = " (what lies there is another file, by its SHA-256)" if state == "other" else ""
        lines.append(f"{shelf.collection.url_of(network, network.files[role])}{instead}")
    return "\n  ".join(lines)

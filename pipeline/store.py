"""What stages have made, kept by what it was made of: the same work is not done twice.

A folder ``<store>/<first two>/<key>/`` holds the outputs of one stage and ``record.json``. The key
is the SHA-256 over the stage's name, its settings (with that of the program's source) and the
content of its inputs. An entry is built in a folder of its own and renamed, so half an entry is
never found; several processes may work on one store, and the first to finish an entry keeps it.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

from pipeline.runs import (
    FileRecord,
    RunFolder,
    StageRecord,
    is_unchanged,
    of_form,
    read_json,
    stage_record,
)
from uxsim_geo.files import at_work_in, replace_when_complete

RECORD = "record.json"
#: where entries are built and discarded
UNFINISHED = "unfinished"

#: grows whenever entries change their meaning: others are then not found
ENTRY_FORMAT = 1


@dataclass(frozen=True)
class Entry:
    """What a stage made, and what it said of it."""

    record: StageRecord
    words: str
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """An entry whose files are what was kept; or none, and why one that was there is not used."""

    entry: Entry | None
    remark: str = ""


@dataclass(frozen=True)
class Store:
    """``<results>/store``, whether or not it exists yet."""

    path: Path

    def folder_of(self, key: str) -> Path:
        """Where an entry lies, or would."""
        return self.path / key[:2] / key

    def find(self, key: str) -> Found:
        """Read an entry and check every file of it; a damaged one is thrown away, and told."""
        folder = self.folder_of(key)
        if not folder.is_dir():
            return Found(None)
        entry = _read(folder / RECORD)
        if entry is not None and all(
            is_unchanged(record, folder / name) for name, record in entry.record.outputs.items()
        ):
            return Found(entry)
        if self.discard(folder):
            return Found(None, f"the store's entry {key} is damaged; it is made anew")
        return Found(None)  # another process has just removed it

    def hand_out(self, key: str, entry: Entry, folder: RunFolder) -> bool:
        """Put the files of an entry into a run folder; False if the entry is gone meanwhile."""
        try:
            for name in entry.record.outputs:
                place(self.folder_of(key) / name, folder / name)
        except FileNotFoundError:
            return False
        return True

    def keep(self, key: str, entry: Entry, folder: RunFolder) -> None:
        """Take the outputs of a stage from a run folder; where there is such an entry, it stays."""
        target = self.folder_of(key)
        if target.is_dir():
            return
        with self._own_folder() as building:
            for name in entry.record.outputs:
                place(folder / name, building / name)
            data = {"format": ENTRY_FORMAT, **asdict(entry)}
            text = json.dumps(data, indent=1, ensure_ascii=False) + "\n"
            (building / RECORD).write_text(text, encoding="utf-8")
            target.parent.mkdir(exist_ok=True)
            try:
                building.rename(target)
            except OSError:
                # another process was first: its entry has the same content
                if not target.is_dir():
                    raise

    def discard(self, folder: Path) -> bool:
        """Remove an entry, at once for all who look for it; False if it is gone already."""
        with self._own_folder() as bin_folder:
            try:
                folder.rename(bin_folder / folder.name)
            except FileNotFoundError:
                return False
        return True

    def entries(self) -> Iterator[Path]:
        """Yield the folders of all entries, by their keys."""
        for folder in sorted(self.path.glob("[0-9a-f][0-9a-f]/*")):
            if folder.is_dir():
                yield folder

    @contextmanager
    def _own_folder(self) -> Iterator[Path]:
        """Yield a folder that nobody else knows; what is left in it goes at the end."""
        name = f"{socket.gethostname()}-{os.getpid()}-{uuid4().hex}"
        folder = self.path / UNFINISHED / name
        folder.parent.mkdir(parents=True, exist_ok=True)
        with at_work_in(folder.parent, is_left=lambda _path: True):
            folder.mkdir()
            try:
                yield folder
            finally:
                shutil.rmtree(folder, ignore_errors=True)


def key_of(stage: str, settings: Mapping[str, Any], inputs: Mapping[str, FileRecord]) -> str:
    """Return the key of a stage's outputs; files count by their content, wherever they lie."""
    content = {name: [record.sha256, record.size] for name, record in inputs.items()}
    said = {"format": ENTRY_FORMAT, "stage": stage, "settings": settings, "inputs": content}
    text = json.dumps(said, sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


def place(source: Path, target: Path) -> None:
    """Put a file under another name in one move: as a hard link, or a copy where none can be.

    Raises FileNotFoundError if ``source`` is gone.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with replace_when_complete(target) as temporary:
        try:
            os.link(source, temporary)
        except FileNotFoundError:
            raise
        except OSError:  # another file system, or one without links
            shutil.copyfile(source, temporary)


def _read(path: Path) -> Entry | None:
    """Read the record of an entry; None where it cannot be believed."""
    try:
        data = read_json(path)
        if data["format"] != ENTRY_FORMAT:
            return None
        entry: Entry = of_form(Entry, data)
        return replace(entry, record=stage_record(data["record"]))
    except (OSError, ValueError, KeyError, TypeError, OverflowError):
        return None

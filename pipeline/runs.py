"""Run folders: what a run consists of, how it came about, whether its files are still those."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from pipeline.lines import readable
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete, sha256_of

if TYPE_CHECKING:
    from pydantic import TypeAdapter

MANIFEST = "manifest.json"
CONFIG = "config.yaml"
LOG = "run.log"

#: grows whenever a manifest's entries change their meaning
MANIFEST_FORMAT = 1


@dataclass(frozen=True)
class FileRecord:
    """A file as it was read or written: where, SHA-256 of the content (hexadecimal), bytes."""

    path: str
    sha256: str
    size: int


@dataclass(frozen=True)
class StageRecord:
    """What one stage read, was told and wrote.

    settings
        all that the result depends on beside the inputs
    inputs, outputs
        by a name; outputs with their path inside the run folder, which is also their name
    figures
        numbers for later stages that stand in no table
    problems
        why outputs are missing; empty where the stage is complete
    started, wall_s
        when it ran (UTC), and for how many seconds
    key
        of the outputs in a store; empty where they are in none
    versions
        of the libraries that it ran with, by their names
    left
        names of files of earlier runs that are still there, where the stage was not finished
    """

    settings: dict[str, Any] = field(default_factory=dict)
    inputs: dict[str, FileRecord] = field(default_factory=dict)
    outputs: dict[str, FileRecord] = field(default_factory=dict)
    figures: dict[str, Any] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    started: str = ""
    wall_s: float = 0.0
    key: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    left: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Manifest:
    """The history of a run: what was last called, and how each stage went.

    run
        command, resolved configuration, seed and versions of the last call that changed the folder
    """

    run: dict[str, Any] = field(default_factory=dict)
    stages: dict[str, StageRecord] = field(default_factory=dict)


@dataclass(frozen=True)
class RunFolder:
    """``runs/<name>/``, whether or not it exists yet."""

    path: Path

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def create(self) -> None:
        """Make the folder; that this is possible, and files in it, is for the user to see to."""
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError):
            what = "a file is in the way of the run's folder; move it or choose another --out"
            raise InputError([Fault(what, str(self.path))]) from None
        except OSError as error:
            what = f"cannot be the run's folder ({error.strerror}); choose another name or --out"
            raise InputError([Fault(what, str(self.path))]) from None
        if not os.access(self.path, os.W_OK | os.X_OK):
            raise InputError([Fault("cannot be written to; choose another --out", str(self.path))])

    def read_manifest(self) -> Manifest:
        """Return the manifest; an empty one where there is none that can be believed."""
        try:
            data = read_json(self / MANIFEST)
            if data["format"] != MANIFEST_FORMAT:
                return Manifest()
            stages = {name: stage_record(entry) for name, entry in data["stages"].items()}
            of_form(_RunFacts, data["run"])
            return Manifest(data["run"], stages)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError):
            # absent, unreadable or damaged: nothing in it counts, every stage is run again
            return Manifest()

    def write_manifest(self, manifest: Manifest) -> None:
        """Replace the manifest in one move."""
        data = {"format": MANIFEST_FORMAT, **asdict(manifest)}
        with replace_when_complete(self / MANIFEST) as path:
            path.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    def log(self, text: str, name: str = LOG) -> None:
        """Add lines to the run's log, or another one, with the time."""
        self.create()
        now = datetime.now(UTC).isoformat(timespec="seconds")
        with (self / name).open("a", encoding="utf-8") as log:
            log.writelines(f"{now} {readable(line)}\n" for line in text.splitlines())

    def output_records(self, names: Iterable[str]) -> dict[str, FileRecord]:
        """Record files of this folder by their names in it."""
        return {name: record_file(self / name, name) for name in names}


def record_file(path: Path, name: str | None = None) -> FileRecord:
    """Read a file for its SHA-256 and size; ``name`` stands for its path in the record."""
    return FileRecord(name or str(path), sha256_of(path), path.stat().st_size)


def is_unchanged(record: FileRecord, path: Path) -> bool:
    """Tell whether the file is there with the size and content recorded."""
    try:
        # a device or a pipe, which a path in a manifest may well be, would be read for ever
        if not path.is_file() or path.stat().st_size != record.size:
            return False
        return record_file(path).sha256 == record.sha256
    except OSError:
        return False


def stage_record(entry: dict[str, Any]) -> StageRecord:
    """Make a record of what JSON holds; raises ValueError or KeyError if it cannot."""
    record: StageRecord = of_form(StageRecord, entry)
    # outputs are deleted when they are out of date: never one outside the folder
    check_inside((*record.outputs, *record.left))
    if record.started:
        # both are written into the crate again, with the moment of the end
        _ = datetime.fromisoformat(record.started) + timedelta(seconds=record.wall_s)
    return record


def remove_files(folder: Path, names: Iterable[str]) -> None:
    """Remove files of a folder, where they are there: none that links lead to elsewhere."""
    for name in names:
        if lies_in(folder, name):
            (folder / name).unlink(missing_ok=True)


def lies_in(folder: Path, name: str) -> bool:
    """Tell whether a file of this name is in the folder, and not where a link leads to."""
    return (folder / name).parent.resolve().is_relative_to(folder.resolve())


def check_inside(names: Iterable[str]) -> None:
    """Raise ValueError if a name, as a file has it, leads out of the folder it belongs to."""
    for name in names:
        path = PurePath(name)
        if path.is_absolute() or ".." in path.parts or not path.parts or "\0" in name:
            raise ValueError("a name that does not lie in the folder")


def read_json(path: Path) -> Any:
    """Read a JSON file; raises OSError or ValueError, also where it is nested too deeply."""
    from pydantic_core import from_json

    return from_json(path.read_bytes())


def of_form(form: Any, value: object) -> Any:
    """Make a dataclass of what JSON holds; raises ValueError if its values are of other types."""
    return _adapter(form).validate_python(value)


@cache
def _adapter(form: Any) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter

    return TypeAdapter(form)


@dataclass(frozen=True)
class _RunFacts:
    """Of what a manifest says of a run: that which is read again, with its types."""

    config: dict[str, Any] = field(default_factory=dict)
    config_file: FileRecord = FileRecord(CONFIG, "", 0)
    versions: dict[str, str] = field(default_factory=dict)

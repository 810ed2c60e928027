"""The folder of a study: its runs, their figures, and the manifest that tells how they came."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from pipeline.config_file import named_values
from pipeline.ingest_config import IngestSection
from pipeline.runs import (
    MANIFEST,
    FileRecord,
    RunFolder,
    check_inside,
    of_form,
    read_json,
    record_file,
)
from pipeline.store import Store
from pipeline.study_jobs import NAMES, Report
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete

#: the study file as it was given
STUDY = "study.yaml"
FIGURES = "figures.csv"
LOG = "study.log"
LOCK = ".lock"

#: what runs read beside their tables, as areas
INPUTS = "inputs"
#: tables as they were read, before any edit
SOURCES = "sources"
#: the base as it was, with what the study sets
BASE_CONFIG = "base.yaml"

#: beside the studies
STORE = "store"

#: grows whenever entries of the manifest change their meaning
MANIFEST_FORMAT = 1


@dataclass(frozen=True)
class StudyManifest:
    """What a study consists of.

    study
        name, command, seeds, versions, times, whether all was done; and all that it takes to repeat
        it: the study resolved, and its base
    runs
        of each scenario and seed: its folder, status and problems
    outputs
        files of the study itself, by name
    """

    study: dict[str, Any] = field(default_factory=dict)
    runs: list[dict[str, Any]] = field(default_factory=list)
    outputs: dict[str, FileRecord] = field(default_factory=dict)

    @property
    def is_finished(self) -> bool:
        """Whether every run was tried."""
        return bool(self.study.get("finished"))


@dataclass(frozen=True)
class StudyFolder:
    """``<results>/<study>/``, whether or not it exists yet."""

    path: Path

    @property
    def store(self) -> Store:
        """Of all studies beside this one."""
        return Store(self.path.parent / STORE)

    def run(self, scenario: str, seed: int) -> RunFolder:
        """Where a run lies."""
        return RunFolder(self.path / self.run_name(scenario, seed))

    def sources(self, section: IngestSection) -> RunFolder:
        """Where the tables lie that were read as a section says, before any edit."""
        told = json.dumps(named_values(section, Path.as_posix), sort_keys=True)
        name = hashlib.sha256(told.encode()).hexdigest()[:16]
        return RunFolder(self.path / SOURCES / name)

    @staticmethod
    def run_name(scenario: str, seed: int) -> str:
        """Name a run's folder in that of the study."""
        return f"runs/{scenario}/seed_{seed}"

    def log(self, text: str) -> None:
        """Add lines to the study's log, with the time."""
        RunFolder(self.path).log(text, LOG)

    def read_manifest(self) -> StudyManifest:
        """Return the manifest; an empty one where there is none that can be believed."""
        try:
            data = read_json(self.path / MANIFEST)
            if data["format"] != MANIFEST_FORMAT:
                return StudyManifest()
            manifest: StudyManifest = of_form(StudyManifest, data)
            if manifest.study:
                of_form(_StudyFacts, manifest.study)
            for run in manifest.runs:
                of_form(_RunEntry, run)
            check_inside(manifest.outputs)
            check_inside(run["folder"] for run in manifest.runs)
            check_inside(manifest.study.get(SOURCES, ()))
            return manifest
        except (OSError, ValueError, KeyError, TypeError):
            return StudyManifest()

    def write_manifest(self, manifest: StudyManifest) -> None:
        """Replace the manifest in one move."""
        data = {"format": MANIFEST_FORMAT, **asdict(manifest)}
        with replace_when_complete(self.path / MANIFEST) as path:
            path.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    def write_figures(self, reports: Sequence[Report]) -> None:
        """Write a row for each run: scenario, seed, status, and its figures where it has some."""
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        rows.writerow(("scenario", "seed", "status", *NAMES))
        for report in reports:
            figures = (_cell(report.figures.get(name)) for name in NAMES)
            rows.writerow((report.scenario, report.seed, report.status, *figures))
        with replace_when_complete(self.path / FIGURES) as path:
            path.write_text(text.getvalue(), encoding="utf-8")

    def record(self, *names: str) -> dict[str, FileRecord]:
        """Record files of the study itself by their names."""
        return {name: record_file(self.path / name, name) for name in names}

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other processes from working on this study; the system ends it with the process.

        Raises :class:`uxsim_geo.errors.InputError` if one does. Where the system has no such locks
        nobody is kept away: files are still whole, only work may be done twice.
        """
        try:
            import fcntl
        except ImportError:  # not a Unix
            yield
            return
        with (self.path / LOCK).open("w", encoding="utf-8") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                what = "another process works on this study; wait for it, or choose another --out"
                raise InputError([Fault(what, str(self.path))]) from None
            except OSError:  # a file system without locks
                pass
            yield


@dataclass(frozen=True)
class _ComparisonFacts:
    """What it says of the comparison: see :class:`pipeline.study_earlier.Concluded`."""

    key: str = ""
    files: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _StudyFacts:
    """Of what a manifest says of a study: that which is read again, with its types."""

    name: str
    ended: str = ""
    seeds: list[int] = field(default_factory=list)
    scenarios: list[str] = field(default_factory=list)
    edits: dict[str, list[str]] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    code: str = ""
    sources: list[str] = field(default_factory=list)
    comparison: _ComparisonFacts = _ComparisonFacts()
    text: str = ""
    config: dict[str, Any] = field(default_factory=dict)
    folder: str = ""
    base_document: dict[str, Any] = field(default_factory=dict)
    base_folder: str = ""


@dataclass(frozen=True)
class _RunEntry:
    """What a manifest says of each run: :func:`run_entry`."""

    scenario: str
    seed: int
    folder: str
    status: str
    problems: list[str]


def is_study(path: Path) -> bool:
    """Tell whether a folder is one of a study, finished or not."""
    return bool(StudyFolder(path).read_manifest().study)


def run_entry(report: Report) -> dict[str, Any]:
    """What the manifest says of a run."""
    return {
        "scenario": report.scenario,
        "seed": report.seed,
        "folder": StudyFolder.run_name(report.scenario, report.seed),
        "status": report.status,
        "problems": list(report.problems),
    }


def _cell(value: float | None) -> str:
    """Write a number so that it reads back as the same; nothing where there is none."""
    return "" if value is None else repr(value)

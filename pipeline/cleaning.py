"""What studies have left behind: entries of the store without a run, files never finished."""

from __future__ import annotations

import os
import shutil
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pipeline.runs import MANIFEST, RunFolder
from pipeline.store import UNFINISHED, Store
from pipeline.study_folder import SOURCES, STORE, StudyFolder
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import is_unfinished

#: what nobody has touched for so long is nobody's any more, s
A_DAY = 86_400.0


@dataclass(frozen=True)
class LeftOver:
    """A file or folder that can go: how large (bytes), and why."""

    path: Path
    size: int
    why: str


def find_left_over(results: Path) -> list[LeftOver]:
    """Find what can be removed below a folder of results.

    Raises :class:`uxsim_geo.errors.InputError` where there is no such folder.
    """
    if not results.is_dir():
        raise InputError([Fault("is no folder of results; name one by --out", str(results))])
    old_runs = list(_old_runs(results))
    gone = {found.path for found in old_runs}
    return [
        *old_runs,
        *_unused_entries(results, gone),
        *_unfinished(results),
    ]


def remove(found: LeftOver) -> bool:
    """Remove it; False where that was not possible, or it is gone already."""
    if found.path.parent.parent.name == STORE and found.path.parent.name != UNFINISHED:
        # renamed first: a process that looks for the entry finds all of it or nothing
        return Store(found.path.parent.parent).discard(found.path)
    try:
        shutil.rmtree(found.path) if found.path.is_dir() else found.path.unlink()
    except OSError:
        return False
    return True


def _old_runs(results: Path) -> Iterator[LeftOver]:
    """Runs that a study no longer has: of scenarios or seeds that it had before."""
    for path in sorted(results.glob(f"*/{MANIFEST}")):
        manifest = StudyFolder(path.parent).read_manifest()
        if not manifest.is_finished:  # it may be under way
            continue
        known = {run["folder"] for run in manifest.runs}
        for folder in sorted(path.parent.glob("runs/*/seed_*")):
            if folder.relative_to(path.parent).as_posix() not in known:
                yield LeftOver(folder, _size(folder), "the study no longer has this run")
        for folder in sorted((path.parent / SOURCES).glob("*")):
            if folder.name not in manifest.study.get("sources", ()):
                yield LeftOver(folder, _size(folder), "the study no longer reads these sources")


def _unused_entries(results: Path, gone: set[Path]) -> Iterator[LeftOver]:
    """Entries of the store that no run of a study came from or went to."""
    used: set[str] = set()
    of_runs = results.glob(f"*/runs/*/*/{MANIFEST}")
    for path in (*of_runs, *results.glob(f"*/{SOURCES}/*/{MANIFEST}")):
        if path.parent not in gone:
            stages = RunFolder(path.parent).read_manifest().stages.values()
            used |= {record.key for record in stages}
    for folder in Store(results / STORE).entries():
        if folder.name not in used:
            yield LeftOver(folder, _size(folder), "no study refers to it")


def _unfinished(results: Path) -> Iterator[LeftOver]:
    """What processes had begun that have ended since."""
    for folder in sorted((results / STORE / UNFINISHED).glob("*")):
        if _is_of_dead_process(folder.name) or _is_old(folder):
            yield LeftOver(folder, _size(folder), "its process has ended")
    for path in sorted(results.glob("**/.*")):
        if path.is_file() and is_unfinished(path) and _is_old(path):
            yield LeftOver(path, _size(path), "was not finished")


def _is_of_dead_process(name: str) -> bool:
    """Tell whether a folder is of a process of this machine that is no more."""
    host, _, rest = name.rpartition("-")[0].rpartition("-")
    if host != socket.gethostname() or not rest.isdecimal():
        return False
    try:
        os.kill(int(rest), 0)
    except ProcessLookupError:
        return True
    except OSError:
        return False
    return False


def _is_old(path: Path) -> bool:
    try:
        return time.time() - path.stat().st_mtime > A_DAY
    except OSError:
        return False


def _size(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file())

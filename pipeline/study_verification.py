"""Whether a study's files, and those of all its runs, are still those that it wrote."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pipeline.program import versions
from pipeline.ro_crate import METADATA
from pipeline.runs import MANIFEST, RunFolder, is_unchanged
from pipeline.study_earlier import EARLIER
from pipeline.study_folder import INPUTS, LOCK, LOG, SOURCES, StudyFolder, StudyManifest
from pipeline.verification import Verification, difference, verify_run
from uxsim_geo.errors import Fault, InputError

#: what a study's folder holds beside the files that its manifest names
BESIDE = {MANIFEST, METADATA, LOG, LOCK}
FOLDERS = {"runs", SOURCES, INPUTS, EARLIER}

#: runs that are named where several say the same
MOST_NAMED = 3


def verify_study(path: Path) -> Verification:
    """Compare every file of a study, and of its runs, with the manifests.

    Raises :class:`uxsim_geo.errors.InputError` where there is no study.
    """
    folder = StudyFolder(path)
    manifest = folder.read_manifest()
    if not manifest.study:
        what = "holds no readable manifest.json of a study: name its folder, as runs/bridge"
        raise InputError([Fault(what, str(path))])
    changed = [
        f"{name}: {difference(path / name)}"
        for name, record in manifest.outputs.items()
        if not is_unchanged(record, path / name)
    ]
    wrong = ["the study was not finished; call it again"] if not manifest.is_finished else []
    wrong += changed
    checked, remarks = len(manifest.outputs) - len(changed), list(_remarks(folder, manifest))
    told: dict[str, list[str]] = {}
    for name, found in _parts(folder, manifest):
        checked += found.checked
        wrong += [f"{name}: {line}" for line in found.wrong]
        for remark in found.remarks:
            told.setdefault(remark, []).append(name)
    return Verification(checked, wrong, [*remarks, *_together(told)])


def _parts(folder: StudyFolder, manifest: StudyManifest) -> Iterator[tuple[str, Verification]]:
    """Yield what is found of each run, and of the tables as they were read."""
    for run in manifest.runs:
        yield f"{run['scenario']}, seed {run['seed']}", _verify(folder.path / run["folder"], run)
    for name in manifest.study.get(SOURCES, ()):
        path = folder.path / SOURCES / name
        yield f"{SOURCES}/{name}", _verify(path, {"status": "finished"})


def _verify(path: Path, run: Mapping[str, Any]) -> Verification:
    """Verify a run; of one that failed it is wrong that it did, and nothing else is asked."""
    if run["status"] != "finished":
        return Verification(0, [f"failed: {problem}" for problem in run["problems"]], [])
    if not RunFolder(path).read_manifest().stages:
        return Verification(0, [f"holds no readable {MANIFEST}"], [])
    return verify_run(path)


def _remarks(folder: StudyFolder, manifest: StudyManifest) -> Iterator[str]:
    """Yield what does not touch the study's own files."""
    now = versions()
    for name, then in manifest.study.get("versions", {}).items():
        if now.get(name) != then:
            yield f"the study was made with {name} {then} (now {now.get(name, 'none')})"
    for path in sorted(folder.path.rglob("*")):
        name = path.relative_to(folder.path)
        known = name.as_posix() in {*manifest.outputs, *BESIDE} or name.parts[0] in FOLDERS
        if path.is_file() and not known:
            yield f"{name.as_posix()}: the manifest does not know this file"
    runs = {run["folder"] for run in manifest.runs}
    for path in sorted(folder.path.glob("runs/*/seed_*")):
        name = path.relative_to(folder.path)
        if name.as_posix() not in runs:
            yield f"{name.as_posix()}: is no run of the study any more; uxsim-geo clean removes it"


def _together(told: Mapping[str, list[str]]) -> Iterator[str]:
    """Yield every remark once, with the runs of which it holds."""
    for remark, names in told.items():
        yield f"{_named(names)}: {remark}"


def _named(names: Iterable[str]) -> str:
    found = list(names)
    shown, more = found[:MOST_NAMED], len(found) - MOST_NAMED
    return "; ".join(shown) + (f" and {more} more" if more > 0 else "")

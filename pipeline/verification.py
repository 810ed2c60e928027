"""Whether the files of a run are still those that its manifest vouches for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pipeline.program import other_versions
from pipeline.ro_crate import METADATA
from pipeline.runs import CONFIG, LOG, MANIFEST, FileRecord, Manifest, RunFolder, is_unchanged
from uxsim_geo.errors import Fault, InputError


@dataclass(frozen=True)
class Verification:
    """What was checked and what was found.

    checked
        files that are as the manifest says
    wrong
        why the run cannot be relied on, one line each
    remarks
        what does not touch the run's own files: inputs changed since, files of unknown origin,
        other versions of libraries than are installed
    """

    checked: int
    wrong: list[str]
    remarks: list[str]


def verify_run(path: Path) -> Verification:
    """Compare every file of a run with its manifest.

    Raises :class:`uxsim_geo.errors.InputError` where there is no run, or none with a manifest.
    """
    folder = RunFolder(path)
    manifest = folder.read_manifest()
    if not manifest.stages:
        what = "holds no readable manifest.json: name a run's folder, as runs/sioux_falls"
        raise InputError([Fault(what, str(path))])
    records = _files_of_run(manifest)
    changed = [
        f"{name}: {difference(folder / name)}"
        for name, record in records.items()
        if not is_unchanged(record, folder / name)
    ]
    wrong = changed + list(_doubts(manifest))
    remarks = [
        *changed_inputs(folder, manifest),
        *_unknown_files(folder, records),
        *_versions(manifest),
    ]
    return Verification(len(records) - len(changed), wrong, remarks)


def _files_of_run(manifest: Manifest) -> dict[str, FileRecord]:
    records: dict[str, FileRecord] = {}
    if "config_file" in manifest.run:
        records[CONFIG] = FileRecord(**manifest.run["config_file"])
    for stage in manifest.stages.values():
        records |= stage.outputs
    return records


def difference(path: Path) -> str:
    """Say what is wrong with a file that is not as it was recorded."""
    return "is not what the run wrote" if path.exists() else "is missing"


def _doubts(manifest: Manifest) -> Iterator[str]:
    """Stages that broke off, could not write everything, or were fed by another run."""
    for name, stage in manifest.stages.items():
        yield from (f"{name}: {problem}" for problem in stage.problems)
        for record in stage.inputs.values():
            maker = _maker(record.path, manifest)
            made = manifest.stages[maker].outputs[record.path] if maker else record
            if made != record:
                yield f"{name}: was made from another {record.path}"


def _maker(name: str, manifest: Manifest) -> str | None:
    makers = (stage for stage, record in manifest.stages.items() if name in record.outputs)
    return next(makers, None)


def changed_inputs(folder: RunFolder, manifest: Manifest) -> Iterator[str]:
    """Sources of the run that are gone or have changed since."""
    for stage in manifest.stages.values():
        for record in stage.inputs.values():
            path = folder / record.path
            if _maker(record.path, manifest) is None and not is_unchanged(record, path):
                gone = "is gone since: that the run was made from it cannot be checked"
                yield f"{record.path}: {'has changed since' if path.exists() else gone}"


def _versions(manifest: Manifest) -> Iterator[str]:
    """Stages that were made with other versions of libraries than are installed."""
    for name, stage in manifest.stages.items():
        yield from (f"{name}: {what}" for what in other_versions(stage))


def _unknown_files(folder: RunFolder, records: dict[str, FileRecord]) -> Iterator[str]:
    known = {*records, MANIFEST, LOG, METADATA}
    for path in sorted(folder.path.rglob("*")):
        name = path.relative_to(folder.path).as_posix()
        if path.is_file() and name not in known:
            yield f"{name}: the manifest does not know this file"

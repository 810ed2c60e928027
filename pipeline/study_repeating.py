"""A study once more, from its manifest, to see whether the results are the same, file by file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pipeline.program import code_digest, versions
from pipeline.repeating import Repeat, Repetition, compared_files
from pipeline.runs import RunFolder
from pipeline.study import Order, run_study
from pipeline.study_folder import BASE_CONFIG, STUDY, StudyFolder, StudyManifest
from pipeline.study_manifest import study_from
from pipeline.verification import changed_inputs

#: by whom a study is repeated, whoever did it first: the results are the same bytes
SCHEDULERS = ("none", "processes")


def repeat_study(order: Repeat) -> Repetition:
    """Do a study again in another folder, nothing taken from any store, and compare all files.

    Study and base are those of the manifest. Raises :class:`uxsim_geo.errors.InputError` for a file
    that is no manifest of a study, and for inputs that are gone.
    """
    first, file = StudyFolder(order.manifest.parent), study_from(order.manifest)
    manifest = first.read_manifest()
    folder = order.target(file.config.name)
    scheduler = file.config.scheduler if file.config.scheduler in SCHEDULERS else "processes"
    command = ["uxsim-geo", "run", str(order.manifest)]
    again = Order(order.manifest, folder.path.parent, command, scheduler, force=True)
    run_study(again, order.watch)  # what failed is compared like all else
    same, different = _compared(first, manifest, StudyFolder(folder.path))
    remarks = dict.fromkeys([*_changed_inputs(first, manifest), *_changed_programs(manifest.study)])
    return Repetition(folder, same, different, list(remarks))


def _compared(
    first: StudyFolder, manifest: StudyManifest, folder: StudyFolder
) -> tuple[list[str], list[str]]:
    """Return the names of equal files, and a line for every other one."""
    again = folder.read_manifest()
    same, different = _compared_outputs(manifest, again)
    runs = {run["folder"]: run for run in again.runs}
    for run in manifest.runs:
        name = run["folder"]
        status = runs[name]["status"] if name in runs else "not done"
        if status != run["status"]:
            different.append(f"{name}: {run['status']} then, {status} now")
        elif status == "finished":
            one = RunFolder(first.path / name)
            found = compared_files(one, one.read_manifest(), RunFolder(folder.path / name))
            same += [f"{name}/{file}" for file in found[0]]
            different += [f"{name}/{line}" for line in found[1]]
    different += [f"{name}: is new" for name in runs.keys() - {r["folder"] for r in manifest.runs}]
    return same, different


def _compared_outputs(manifest: StudyManifest, again: StudyManifest) -> tuple[list[str], list[str]]:
    """Compare the study's own files, except those with paths in them, which are no results."""
    same: list[str] = []
    different: list[str] = []
    before, after = (_results(one) for one in (manifest, again))
    for name, record in before.items():
        if name not in after:
            different.append(f"{name}: was not made again")
        elif after[name] == record:
            same.append(name)
        else:
            different.append(f"{name}: is not the same")
    return same, [*different, *(f"{name}: is new" for name in after if name not in before)]


def _results(manifest: StudyManifest) -> dict[str, Any]:
    told = (STUDY, BASE_CONFIG)
    return {name: record for name, record in manifest.outputs.items() if name not in told}


def _changed_inputs(first: StudyFolder, manifest: StudyManifest) -> Iterator[str]:
    """Yield the sources of all runs that are gone or have changed since."""
    for run in manifest.runs:
        folder = RunFolder(first.path / run["folder"])
        yield from changed_inputs(folder, folder.read_manifest())


def _changed_programs(study: dict[str, Any]) -> Iterator[str]:
    """Yield what is of another version now than it was then."""
    now = versions()
    for name, then in study["versions"].items():
        if now.get(name) != then:
            yield f"made with {name} {then} (now {now.get(name, 'none')})"
    if study["code"] != code_digest():
        yield "the program itself has changed since"

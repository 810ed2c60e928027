"""A study as an RO-Crate: its own files, and its runs, which are crates themselves, as parts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pipeline.ro_crate import METADATA, PROFILE, Crate, Entity, action, id_of, source, source_id
from pipeline.runs import FileRecord
from pipeline.study_folder import StudyFolder, StudyManifest


def write_study_crate(folder: StudyFolder, manifest: StudyManifest) -> None:
    """Describe a study in its folder; all times are those of the manifest."""
    about = manifest.study
    read = {source_id(r): r for r in (FileRecord(**about[name]) for name in ("file", "base"))}
    runs = [run for run in manifest.runs if run["status"] == "finished"]
    written = [*map(id_of, manifest.outputs), *(_folder_id(run) for run in runs)]
    done = action("study", read, written, list(_problems(manifest)))
    Crate(
        about=about,
        description=f"Study {about['name']}: {len(about['scenarios'])} scenarios with the same "
        f"{len(about['seeds'])} seeds, their runs, and what differs from the base.",
        ended=about["ended"],
        files=manifest.outputs,
        actions=[{**done, "startTime": about["started"], "endTime": about["ended"]}],
        others=[*map(source, read.values()), *(one for run in runs for one in _run(run))],
        parts=[_folder_id(run) for run in runs],
    ).write(folder.path)


def _problems(manifest: StudyManifest) -> Iterator[str]:
    if not manifest.is_finished:
        yield "broke off"
    for run in manifest.runs:
        if run["status"] != "finished":
            yield f"{run['scenario']}, seed {run['seed']}: {'; '.join(run['problems'])}"


def _run(run: Mapping[str, Any]) -> Iterator[Entity]:
    """Describe a run by what its own crate is called."""
    crate = f"{_folder_id(run)}{METADATA}"
    yield {
        "@id": _folder_id(run),
        "@type": "Dataset",
        "name": f"{run['scenario']}, seed {run['seed']}",
        "conformsTo": {"@id": PROFILE},
        "subjectOf": {"@id": crate},
    }
    yield {"@id": crate, "@type": "CreativeWork", "encodingFormat": "application/ld+json"}


def _folder_id(run: Mapping[str, Any]) -> str:
    return id_of(f"{run['folder']}/")

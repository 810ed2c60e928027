"""The comparison of an earlier call of a study: set aside until it is known whether it holds."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.runs import is_unchanged, lies_in, remove_files
from pipeline.study_folder import StudyFolder, StudyManifest

#: in the folder of a study
EARLIER = ".earlier"


@dataclass(frozen=True)
class Concluded:
    """What follows from the runs of a study: a comparison of the scenarios with the base.

    files
        names in the study's folder
    problems
        what could not be written, a line each
    key
        of all that it follows from
    swept
        files of a sweep, which are made anew whenever a study ends
    """

    files: Sequence[str] = ()
    problems: Sequence[str] = ()
    key: str = ""
    swept: Sequence[str] = ()

    def entry(self) -> dict[str, Any]:
        """What the manifest says of it; one that is not complete is never believed."""
        return {"key": "" if self.problems else self.key, "files": list(self.files)}


def set_aside(folder: StudyFolder) -> None:
    """Move the comparison out of sight, and remove all else that the manifest vouches for.

    A study that broke off leaves it where it was put then.
    """
    manifest, place = folder.read_manifest(), folder.path / EARLIER
    files = _files(folder, manifest)
    if files:
        shutil.rmtree(place, ignore_errors=True)
    for name in files:
        if (folder.path / name).is_file():
            _move(folder.path / name, place / name)
    if files:
        StudyFolder(place).write_manifest(manifest)
    remove_files(folder.path, manifest.outputs.keys() - set(files))


def take_back(folder: StudyFolder, key: str) -> Concluded | None:
    """Put a comparison back that was made from just this; None: there is none that holds."""
    place = folder.path / EARLIER
    earlier = StudyFolder(place).read_manifest()
    files = _files(folder, earlier)
    if earlier.study.get("comparison", {}).get("key") != key or not all(
        is_unchanged(earlier.outputs[name], place / name) for name in files
    ):
        return None
    for name in files:
        _move(place / name, folder.path / name)
    return Concluded(files, (), key)


def forget(folder: StudyFolder) -> None:
    """Remove what was set aside."""
    shutil.rmtree(folder.path / EARLIER, ignore_errors=True)


def _files(folder: StudyFolder, manifest: StudyManifest) -> list[str]:
    """Files of a comparison, of those that the manifest vouches for."""
    told = manifest.study.get("comparison", {}).get("files", ())
    return [name for name in told if name in manifest.outputs and lies_in(folder.path, name)]


def _move(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    source.replace(target)

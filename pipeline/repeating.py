"""A run once more, from its manifest, to see whether the results are the same, file by file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pipeline.config_file import config_of
from pipeline.config_keys import Reading
from pipeline.execution import Run
from pipeline.program import code_digest, other_versions
from pipeline.progress import Watch
from pipeline.report import SUMMARY
from pipeline.runs import MANIFEST, Manifest, RunFolder
from pipeline.stages import Stage
from pipeline.verification import changed_inputs
from pipeline.yaml_source import YamlSource
from uxsim_geo.errors import Fault, InputError

#: where a repetition goes, beside the folder of the run, unless another place is named
BESIDE = "repeated"

#: figures of the summary that no two runs share
OF_THE_CLOCK = ("engine_wall_s",)


@dataclass(frozen=True)
class Repetition:
    """A run once more, and how its files compare.

    folder
        of the repetition
    same
        names of the files that are equal, byte by byte (of the summary: all but wall times)
    different
        a line for every file that is not
    remarks
        what has changed since the first run, and can be the reason
    """

    folder: RunFolder
    same: list[str]
    different: list[str]
    remarks: list[str]


@dataclass(frozen=True)
class Repeat:
    """What to repeat, how, and where the results go; ``out`` None: beside the first run.

    Of a run, by ``stages``: all there are.
    """

    manifest: Path
    out: Path | None
    watch: Watch
    stages: tuple[Stage, ...] = ()

    def target(self, name: str) -> RunFolder:
        """Return the folder of the repetition; that of the first run is refused."""
        first = self.manifest.parent
        folder = (first.parent / BESIDE if self.out is None else self.out) / name
        if folder.resolve() == first.resolve():
            what = "the run itself lies there; name another --out, or leave it out"
            raise InputError([Fault(what, str(folder))])
        return RunFolder(folder)


def repeat_run(order: Repeat) -> Repetition:
    """Run again what a manifest describes, in another folder, and compare all files.

    The configuration is that of the manifest, the files of the run are not read. Raises
    :class:`uxsim_geo.errors.InputError` for a file that is no manifest, or of a run without a
    finished stage, and for inputs that are gone.
    """
    first = RunFolder(order.manifest.parent)
    manifest = _manifest_of(order.manifest)
    document = YamlSource(str(order.manifest), manifest.run["config"])
    config = config_of(Reading(document, first.path.resolve()))
    folder = order.target(config.name)
    command = ["uxsim-geo", "run", str(order.manifest)]
    run = Run(config, folder, order.watch, command, order.stages)
    problems = run.execute(_last_stage(order, manifest), force=True)
    same, different = compared_files(first, manifest, folder)
    remarks = [*changed_inputs(first, manifest), *_changed_programs(manifest)]
    return Repetition(folder, same, [*problems, *different], remarks)


def _last_stage(order: Repeat, manifest: Manifest) -> str:
    """Name the stage that the first run had come to."""
    done = [stage.name for stage in order.stages if stage.name in manifest.stages]
    if not done:
        what = "names no stage that this version knows: run the run's config.yaml"
        raise InputError([Fault(what, str(order.manifest))])
    return done[-1]


def _manifest_of(path: Path) -> Manifest:
    manifest = RunFolder(path.parent).read_manifest() if path.name == MANIFEST else Manifest()
    if not manifest.stages or "config" not in manifest.run:
        what = "is no manifest of a run that can be repeated: name runs/NAME/manifest.json"
        raise InputError([Fault(what, str(path))])
    return manifest


def compared_files(
    first: RunFolder, manifest: Manifest, folder: RunFolder
) -> tuple[list[str], list[str]]:
    """Return the names of equal files, and a line for every other one."""
    again = folder.read_manifest().stages
    same: list[str] = []
    different: list[str] = []
    for name, stage in manifest.stages.items():
        made = again[name].outputs if name in again else {}
        for file, record in stage.outputs.items():
            if file not in made:
                different.append(f"{file}: was not made again")
            elif made[file] == record or _equal_but_for_the_clock(first, folder, file):
                same.append(file)
            else:
                different.append(f"{file}: is not the same")
        different += [f"{file}: is new" for file in made if file not in stage.outputs]
    return same, different


def _equal_but_for_the_clock(first: RunFolder, folder: RunFolder, file: str) -> bool:
    """Tell whether two summaries differ in wall times alone."""
    if file != SUMMARY:
        return False
    try:
        figures = [json.loads((one / file).read_text(encoding="utf-8")) for one in (first, folder)]
    except (OSError, ValueError):  # the first run's may be gone, or damaged
        return False
    for one in figures:
        for name in OF_THE_CLOCK:
            one.pop(name, None)
    return bool(figures[0] == figures[1])


def _changed_programs(manifest: Manifest) -> Iterator[str]:
    """Yield what is of another version now than it was for the first run."""
    told = [remark for stage in manifest.stages.values() for remark in other_versions(stage)]
    yield from dict.fromkeys(told)
    if any(stage.settings.get("code") != code_digest() for stage in manifest.stages.values()):
        yield "the program itself has changed since"

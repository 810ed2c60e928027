"""Runs: stages in their order, each only if something it depends on has changed."""

from __future__ import annotations

import shlex
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pipeline.attribution import attribution, licence
from pipeline.config import Config
from pipeline.config_file import named_values, plain_values, relative_name, write_config
from pipeline.program import code_digest, machine, other_versions, versions
from pipeline.progress import Watch
from pipeline.ro_crate import METADATA
from pipeline.run_crate import write_crate
from pipeline.runs import (
    CONFIG,
    FileRecord,
    Manifest,
    RunFolder,
    StageRecord,
    is_unchanged,
    record_file,
    remove_files,
)
from pipeline.stages import Outcome, Stage, Task
from pipeline.store import Entry, Store, key_of, place
from uxsim_geo.errors import Fault, InputError


@dataclass(frozen=True)
class Run:
    """One call of the pipeline on one run folder.

    ``command`` is noted in the manifest; ``stages`` are all there are, in their order; of those
    that can be stored, ``store`` keeps what was made, for every run that would make the same.
    """

    config: Config
    folder: RunFolder
    watch: Watch
    command: Sequence[str]
    stages: Sequence[Stage]
    store: Store | None = None

    def execute(self, last: str, *, force: bool = False) -> list[str]:
        """Run the stages up to ``last`` that are out of date; return what could not be written.

        Raises :class:`uxsim_geo.errors.InputError` where the input is at fault; what was finished
        before stays as it was.
        """
        problems: list[str] = []
        names = [stage.name for stage in self.stages]
        for stage in self.stages[: names.index(last) + 1]:
            gone = [] if force else self._gone_downloads(stage)
            if stage.prepare is not None and not gone:
                stage.prepare(self.config, self.watch)
            if not force and self.is_current(stage):
                remarks = self._remarks(stage, gone)
                self.watch.say("; ".join([f"{stage.name}: up to date", *remarks]))
                continue
            key = self.key_of(stage)
            if force or not self._take_from_store(stage, key):
                problems += self._execute(stage, key)
        self._describe_if_lacking()
        return problems

    def is_current(self, stage: Stage) -> bool:
        """Tell whether the stage would only repeat what is there."""
        return self._is_current(stage, self.folder.read_manifest())

    def _is_current(self, stage: Stage, manifest: Manifest) -> bool:
        record = manifest.stages.get(stage.name)
        if record is None or record.problems or record.settings != self._settings(stage):
            return False
        inputs = stage.inputs(self.config, self.folder)
        return (
            inputs.keys() <= record.inputs.keys()
            and all(self._may_be_gone(stage, name) for name in record.inputs.keys() - inputs.keys())
            and all(is_unchanged(record.inputs[name], path) for name, path in inputs.items())
            and self._has(record)
        )

    def _may_be_gone(self, stage: Stage, name: str) -> bool:
        return name.startswith(stage.downloads(self.config))

    def _gone_downloads(self, stage: Stage) -> list[str]:
        """Downloads that a stage has read and that are gone, where it is up to date without."""
        record = self.folder.read_manifest().stages.get(stage.name)
        if record is None or not stage.downloads(self.config) or not self.is_current(stage):
            return []
        there = stage.inputs(self.config, self.folder)
        return [file.path for name, file in record.inputs.items() if name not in there]

    def _remarks(self, stage: Stage, gone: Sequence[str]) -> Iterator[str]:
        """What to know of a stage that is not run again."""
        if gone:
            yield (
                f"its downloads are gone and could not be checked ({', '.join(gone)}): "
                "the run's own tables are used, --force downloads again"
            )
        yield from other_versions(self.folder.read_manifest().stages[stage.name], "--force repeats")

    def _has(self, record: StageRecord) -> bool:
        """Tell whether the outputs of a stage are in the folder as they were recorded."""
        return all(is_unchanged(file, self.folder / name) for name, file in record.outputs.items())

    def adopt(self, stage: Stage, record: StageRecord, source: RunFolder) -> None:
        """Take a stage over from a run folder beside this one, whose settings are the same.

        Raises :class:`uxsim_geo.errors.InputError` if its files are no longer those recorded.
        """
        before = self.folder.read_manifest().stages.get(stage.name)
        if before == record and self._has(record):
            return
        self._distrust(stage)
        for name in record.outputs if source != self.folder else ():
            place(source / name, self.folder / name)
        if not self._has(record):
            what = f"{stage.name}: files have changed while others rely on them; run it again"
            raise InputError([Fault(what, str(source.path))])
        self._finish(stage, record, before)

    def key_of(self, stage: Stage) -> str:
        """Return the key of the stage's outputs in the store; empty where it is not kept there."""
        if self.store is None or not stage.storable:
            return ""
        inputs = self._inputs(stage)
        paths = stage.inputs(self.config, self.folder)
        contents = {path: inputs[name].sha256 for name, path in paths.items()}

        def by_content(path: Path) -> str:
            return f"{path.name} {contents.get(path, '')}"

        values = named_values(self.config, by_content)
        settings = {key: values[key] for key in stage.keys} | {"code": code_digest()}
        return key_of(stage.name, settings | {"versions": versions()}, inputs)

    def _take_from_store(self, stage: Stage, key: str) -> bool:
        """Put what the store has of this stage into the folder; False: it has to be run."""
        if self.store is None or not key:
            return False
        found = self.store.find(key)
        if found.remark:
            self._tell(f"{stage.name}: {found.remark}")
        if found.entry is None:
            return False
        before = self.folder.read_manifest().stages.get(stage.name)
        self._distrust(stage)
        if not self.store.hand_out(key, found.entry, self.folder):
            return False
        self._finish(stage, self._record_of(stage, found.entry.record, key), before)
        words = f"{stage.name}: {found.entry.words} (from the store)"
        self._tell("\n".join([words, *found.entry.warnings]))
        return True

    def _execute(self, stage: Stage, key: str) -> Sequence[str]:
        started, clock = datetime.now(UTC), time.perf_counter()
        before = self.folder.read_manifest()
        figures = {name: record.figures for name, record in before.stages.items()}
        inputs = self._inputs(stage)
        task = Task(self.config, self.folder, figures, self.watch, lambda: self._distrust(stage))
        outcome = stage.run(task)
        # of an input that has changed meanwhile nobody knows which content was read
        if outcome.problems or self.key_of(stage) != key:
            key = ""
        record = StageRecord(
            settings=self._settings(stage),
            inputs=inputs,
            outputs=self.folder.output_records(outcome.outputs),
            figures=outcome.figures,
            problems=list(outcome.problems),
            started=started.isoformat(timespec="seconds"),
            wall_s=round(time.perf_counter() - clock, 3),
            key=key,
            versions=versions(),
        )
        if self.store is not None and record.key:
            self.store.keep(key, _entry(record, outcome), self.folder)
        self._finish(stage, record, before.stages.get(stage.name))
        words = f"{stage.name}: {outcome.words} ({record.wall_s:.1f} s)"
        called = f"{stage.name}: called by {shlex.join(self.command)}"
        self.folder.log("\n".join([called, words, *outcome.warnings, *outcome.problems]))
        self.watch.say("\n".join([words, *outcome.warnings]))
        return outcome.problems

    def _inputs(self, stage: Stage) -> dict[str, FileRecord]:
        return {
            name: record_file(path, relative_name(path, self.folder.path))
            for name, path in stage.inputs(self.config, self.folder).items()
        }

    def _record_of(self, stage: Stage, kept: StageRecord, key: str) -> StageRecord:
        """The record of a stage whose outputs come from the store, with this folder's names."""
        return replace(kept, settings=self._settings(stage), inputs=self._inputs(stage), key=key)

    def _tell(self, text: str) -> None:
        self.folder.log(text)
        self.watch.say(text)

    def _settings(self, stage: Stage) -> dict[str, Any]:
        values = plain_values(self.config, self.folder.path)
        return {key: values[key] for key in stage.keys} | {"code": code_digest()}

    def _distrust(self, stage: Stage) -> None:
        """Note in the manifest that the stage is not finished: a killed run is never believed."""
        self.folder.create()
        (self.folder / METADATA).unlink(missing_ok=True)
        manifest = self.folder.read_manifest()
        manifest.stages[stage.name] = StageRecord(
            problems=["was not finished; run it again"],
            left=_files_of(manifest.stages.get(stage.name)),
        )
        self.folder.write_manifest(manifest)
        remove_files(self.folder.path, stage.may_leave)

    def _finish(self, stage: Stage, record: StageRecord, before: StageRecord | None) -> None:
        """Vouch for the stage's outputs; remove those of earlier runs that no longer belong."""
        manifest = self.folder.read_manifest()
        if not self._has_config(manifest):
            write_config(self.config, self.folder / CONFIG)
        remove_files(self.folder.path, set(_files_of(before)) - record.outputs.keys())
        manifest = Manifest(self._describe(), manifest.stages)
        manifest.stages[stage.name] = record
        # until all is as the manifest will say, it says that the stage is not finished
        for later in self.stages[self.stages.index(stage) + 1 :]:
            if later.name in manifest.stages and not self._is_current(later, manifest):
                remove_files(self.folder.path, _files_of(manifest.stages.pop(later.name)))
        self.folder.write_manifest(manifest)
        write_crate(self.folder, manifest)

    def _describe_if_lacking(self) -> None:
        """Write what a run lacks that was killed after its last stage."""
        manifest = self.folder.read_manifest()
        if manifest.run and not (self.folder / METADATA).is_file():
            write_crate(self.folder, manifest)

    def _has_config(self, manifest: Manifest) -> bool:
        """Tell whether an earlier stage has written this very configuration."""
        values = plain_values(self.config, self.folder.path)
        if manifest.run.get("config") != values or "config_file" not in manifest.run:
            return False
        return is_unchanged(FileRecord(**manifest.run["config_file"]), self.folder / CONFIG)

    def _describe(self) -> dict[str, Any]:
        config = self.folder / CONFIG
        return {
            "name": self.config.name,
            "command": list(self.command),
            "seed": self.config.simulate.seed,
            "versions": versions(),
            "machine": machine(),
            "attribution": attribution(self.config),
            "licence": licence(self.config),
            "config": plain_values(self.config, self.folder.path),
            "config_file": asdict(record_file(config, CONFIG)),
        }


def _files_of(record: StageRecord | None) -> list[str]:
    """Names of the files that a stage has written, finished or not."""
    return [] if record is None else sorted({*record.outputs, *record.left})


def _entry(record: StageRecord, outcome: Outcome) -> Entry:
    """What the store keeps: nothing of where the run's folder and its inputs lie."""
    return Entry(replace(record, settings={}, inputs={}), outcome.words, tuple(outcome.warnings))

"""Scenarios of a study with their tables, ready for runs in the results folder alone."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline import ingest
from pipeline.config import Config
from pipeline.config_file import named_values
from pipeline.edit_sentences import edits_in_sentences
from pipeline.execution import Run
from pipeline.progress import Prefixed
from pipeline.runs import RunFolder, StageRecord
from pipeline.scenarios import BASE, Scenario, Tables, read_scenarios, resolve
from pipeline.sources import Sources
from pipeline.study_config import StudyFile
from pipeline.study_folder import INPUTS, StudyFolder
from uxsim_geo.files import replace_when_complete, sha256_of

#: sections whose files the stages after ingestion read
READ_BY_RUNS = ("simulate", "measure", "report")


@dataclass(frozen=True)
class Prepared:
    """A scenario whose tables are there, in the folder of its first run.

    config
        whose files after ingestion lie in the study's folder
    edits
        what it changes, a line each
    """

    config: Config
    tables: RunFolder
    ingested: StageRecord
    edits: tuple[str, ...]


@dataclass
class Preparation:
    """Makes scenarios ready: checks all edits against the base, then writes tables of each."""

    file: StudyFile
    folder: StudyFolder
    sources: Sources
    first_seed: int
    copied: dict[Path, Path] = field(default_factory=dict)
    warned: set[str] = field(default_factory=set)

    def scenarios(self) -> tuple[dict[str, Scenario], Tables]:
        """Resolve all scenarios, the base first; return the base's tables as read too.

        Raises :class:`uxsim_geo.errors.InputError` with the faults of all of them.
        """
        told = read_scenarios(self.file.reading)
        tables = Tables(*self.sources(self.sources.base.ingest))
        return resolve(self.file.base, self.file.reading, told, tables), tables

    def prepared(self, scenarios: Mapping[str, Scenario], tables: Tables) -> dict[str, Prepared]:
        """Write the tables of all scenarios, where they are neither there nor in the store.

        ``tables`` are those of the base as read.
        """
        base = scenarios[BASE]
        return {
            name: self._prepare(one, () if one is base else edits_in_sentences(one, base, tables))
            for name, one in scenarios.items()
        }

    def _prepare(self, scenario: Scenario, edits: tuple[str, ...]) -> Prepared:
        name = scenario.name
        folder = self.folder.run(name, self.first_seed)
        config = self._in_folder(with_seed(scenario.config, self.first_seed))
        told = self.sources
        watch, stage = Prefixed(name, told.watch, self.warned), ingest.stage(told)
        run = Run(config, folder, watch, told.command, (stage,), self.folder.store)
        run.execute(stage.name, force=told.force)
        return Prepared(config, folder, folder.read_manifest().stages[stage.name], edits)

    def _in_folder(self, config: Config) -> Config:
        """Copy what runs read into the study's folder, and name the copies."""
        values = absolute_values(config)
        for section in READ_BY_RUNS:
            values[section] = named_values(
                getattr(config, section), lambda path: self._copy_of(path).as_posix()
            )
        return Config.model_validate(values)

    def _copy_of(self, path: Path) -> Path:
        if path not in self.copied:
            digest = sha256_of(path)
            target = self.folder.path / INPUTS / f"{digest[:16]}_{path.name}"
            target.parent.mkdir(parents=True, exist_ok=True)
            if not target.is_file() or sha256_of(target) != digest:
                with replace_when_complete(target) as temporary:
                    shutil.copyfile(path, temporary)
            self.copied[path] = target
        return self.copied[path]


def with_seed(config: Config, seed: int) -> Config:
    """Return a configuration with another seed."""
    return config.model_copy(update={"simulate": config.simulate.model_copy(update={"seed": seed})})


def absolute_values(config: Config) -> dict[str, Any]:
    """Return a configuration as plain values that mean the same in any folder."""
    return named_values(config, lambda path: path.resolve().as_posix())

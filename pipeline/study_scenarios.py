"""Scenarios of a study with their tables, ready for runs in the results folder alone."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pipeline import ingest
from pipeline.config import Config
from pipeline.config_file import config_of, named_values
from pipeline.import_notes import PAGE, write_page
from pipeline.progress import Prefixed, Watch
from pipeline.runs import RunFolder, StageRecord
from pipeline.scenarios import BASE, Scenario, Tables, read_scenarios, resolve
from pipeline.stages import Outcome, Run, Stage, Task
from pipeline.store import place
from pipeline.study_config import StudyFile
from pipeline.study_folder import StudyFolder
from uxsim_geo.files import replace_when_complete, sha256_of

#: in the folder of a study: what runs read beside their tables, as areas
INPUTS = "inputs"

#: sections whose files the stages after ingestion read
READ_BY_RUNS = ("simulate", "report")


@dataclass(frozen=True)
class Prepared:
    """A scenario whose tables are there, in the folder of its first run.

    config
        whose files after ingestion lie in the study's folder
    """

    config: Config
    tables: RunFolder
    ingested: StageRecord


@dataclass
class Preparation:
    """Makes scenarios ready: the sources are read once, for the base; its tables are edited."""

    file: StudyFile
    folder: StudyFolder
    command: Sequence[str]
    watch: Watch
    first_seed: int
    copied: dict[Path, Path] = field(default_factory=dict)

    def base(self) -> tuple[Prepared, Tables]:
        """Ingest the base, unless that has been done; return its tables too."""
        from uxsim_geo.demand.files import read_demand
        from uxsim_geo.network.files import read_network

        prepared = self._prepare(BASE, config_of(self.file.base), ingest.STAGE)
        network = read_network(prepared.tables / ingest.NETWORK)
        return prepared, Tables(network, read_demand(prepared.tables / ingest.DEMAND))

    def scenarios(self, tables: Tables) -> dict[str, Scenario]:
        """Resolve all scenarios; raises InputError with the faults of all of them."""
        told = read_scenarios(self.file.reading)
        return resolve(self.file.base, self.file.reading, told, tables)

    def write(self, scenario: Scenario, base: Prepared, tables: Tables) -> Prepared:
        """Write the tables of a scenario, unless they are there or in the store."""
        stage = ingest.STAGE
        if scenario.tables is not None:
            unchanged = (
                scenario.tables.network is tables.network
                and scenario.tables.demand is tables.demand
            )
            edited = scenario.tables

            def write_stage(task: Task) -> Outcome:
                if unchanged:
                    return _take_from(base, edited, task)
                return ingest.write_tables(task, edited.network, edited.demand)

            stage = replace(stage, run=write_stage)
        return self._prepare(scenario.name, scenario.config, stage)

    def _prepare(self, name: str, config: Config, stage: Stage) -> Prepared:
        folder = self.folder.run(name, self.first_seed)
        config = self._in_folder(with_seed(config, self.first_seed))
        watch = Prefixed(name, self.watch)
        Run(config, folder, watch, self.command, (stage,), self.folder.store).execute(stage.name)
        return Prepared(config, folder, folder.read_manifest().stages[stage.name])

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
            target = (self.folder.path / INPUTS / f"{digest[:16]}_{path.name}").resolve()
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


def _take_from(base: Prepared, tables: Tables, task: Task) -> Outcome:
    """Write the tables of the base, which are those of a scenario: the same files."""
    task.begin_writing()
    names = [name for name in base.ingested.outputs if name != PAGE]
    for name in names:
        place(base.tables / name, task.folder / name)
    write_page(task.config, tables.network, tables.demand, task.folder / PAGE)
    return Outcome([*names, PAGE], "the tables of the base")

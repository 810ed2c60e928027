"""Studies: the scenarios of a base, each with the same seeds, run and told of one by one."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

from pipeline.config import Config
from pipeline.config_file import config_of, write_config
from pipeline.dry_run import dry_run_text, write_changes
from pipeline.execution import Run
from pipeline.program import code_digest, versions
from pipeline.progress import Watch
from pipeline.ro_crate import METADATA
from pipeline.runs import FileRecord, RunFolder, record_file
from pipeline.simulate import STAGE as SIMULATE
from pipeline.sources import Sources
from pipeline.study_comparison import Compared
from pipeline.study_config import StudyFile, UntilSection, read_study
from pipeline.study_crate import write_study_crate
from pipeline.study_dask import Dask
from pipeline.study_earlier import Concluded, forget, set_aside, take_back
from pipeline.study_folder import (
    BASE_CONFIG,
    FIGURES,
    STUDY,
    StudyFolder,
    StudyManifest,
    run_entry,
)
from pipeline.study_jobs import NAMES, Job, Report
from pipeline.study_manifest import facts, study_from
from pipeline.study_processes import Group, Here, Processes
from pipeline.study_scenarios import Preparation, Prepared, absolute_values, with_seed
from pipeline.study_seeds import Seeds, widths
from pipeline.sweep_results import SweepRuns
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete
from uxsim_geo.machine import cores

#: what a dry run writes into the folder of the study
CHANGES = "changes.gpkg"


@dataclass(frozen=True)
class Order:
    """A study that is to be done.

    path
        of its file, or of the manifest of one that is to be repeated
    scheduler, workers, seeds, edits
        in place of what the file says; edits are ``key.sub=value``
    force
        whether what is done is done again
    """

    path: Path
    out: Path
    command: Sequence[str]
    scheduler: str | None = None
    workers: int | None = None
    seeds: int | None = None
    edits: Sequence[str] = ()
    force: bool = False


class Runner(Protocol):
    """One that does runs, here or elsewhere."""

    def run(self, groups: Sequence[Group]) -> Iterator[Report]:
        """Do all runs; yield a report of each when it is done."""


@dataclass(frozen=True)
class Study:
    """A study under way.

    base
        its base, with what the study sets
    files
        the files of the study and its base as they were at the beginning
    reports
        of the runs done, by scenario and seed
    """

    file: StudyFile
    base: Config
    folder: StudyFolder
    command: Sequence[str]
    watch: Watch
    seeds: Seeds
    files: Mapping[str, FileRecord]
    force: bool = False
    reports: dict[tuple[str, int], Report] = field(default_factory=dict)

    @property
    def first_seed(self) -> int:
        """Of the run in whose folder the driver makes a scenario's tables."""
        return self.seeds.all[0]


def run_study(order: Order, watch: Watch) -> list[str]:
    """Do all runs of a study that are not done; return what went wrong, a line each.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong in the study, its base and
    its edits, before any run begins.
    """
    study = _begin(order, watch)
    with study.folder.alone():
        started, clock = datetime.now(UTC), time.perf_counter()
        with _runner(order, study.file) as runner:
            prepared = _prepare(study)
            _clear(study)
            try:
                _run_all(study, runner, prepared)
            except BaseException:
                _write(study, prepared, started, Concluded(), finished=False)
                raise
        compared = replace(_compare(study, prepared), swept=_sweep(study, prepared))
        _write(study, prepared, started, compared, finished=True)
        count = f"{len(study.reports):,} runs in {time.perf_counter() - clock:.1f} s"
        _tell(study, f"study: {count}, figures in {study.folder.path / FIGURES}")
    return [*_problems(in_order(study, prepared)), *compared.problems]


def _problems(reports: Sequence[Report]) -> list[str]:
    found = []
    for report in reports:
        details = f"; {report.words}" if report.status == "failed" else ""
        run = f"{report.scenario}, seed {report.seed}"
        found += [f"{run}: {problem}{details}" for problem in report.problems]
    return found


def dry_run(order: Order, watch: Watch) -> tuple[str, Path]:
    """Tell what each scenario changes, in words and as a map layer, whose path is returned too.

    Raises :class:`uxsim_geo.errors.InputError` as :func:`run_study`.
    """
    study = _begin(order, watch)
    preparation = _preparation(study)
    scenarios, tables = preparation.scenarios()
    path = study.folder.path / CHANGES
    write_changes(path, scenarios, tables)
    return dry_run_text(scenarios, tables), path


def in_order(study: Study, prepared: Mapping[str, Prepared]) -> list[Report]:
    """Return the reports in the order of the scenarios and seeds, whenever they came."""
    keys = [(name, seed) for name in prepared for seed in study.seeds.done]
    return [study.reports[key] for key in keys if key in study.reports]


def _begin(order: Order, watch: Watch) -> Study:
    file = _read(order)
    base = config_of(file.base_copy())
    seeds = Seeds(file.config.seeds, base.simulate.seed)
    if seeds.until is not None and seeds.until.figure not in NAMES:
        what = f"seeds.until.figure: is none of the figures: {', '.join(NAMES)}"
        origin = file.reading.document.origin(("seeds", "until", "figure"))
        raise InputError([Fault(what, *origin, None, seeds.until.figure)])
    folder = StudyFolder((order.out / file.config.name).resolve())
    RunFolder(folder.path).create()
    files = {"file": record_file(file.path.resolve()), "base": record_file(file.config.base)}
    return Study(file, base, folder, order.command, watch, seeds, files, order.force)


def _read(order: Order) -> StudyFile:
    if order.path.suffix == ".json":
        return study_from(order.path)
    return read_study(order.path, order.edits, order.seeds)


def _runner(order: Order, file: StudyFile) -> AbstractContextManager[Runner]:
    scheduler = order.scheduler or file.config.scheduler
    workers = order.workers or file.config.workers or cores()
    if scheduler == "none" or (scheduler == "processes" and workers == 1):
        return Here()
    if scheduler == "processes":
        return Processes(workers)
    return Dask(None if scheduler == "dask" else scheduler, workers)


def _preparation(study: Study) -> Preparation:
    sources = Sources(study.base, study.folder, study.command, study.watch, study.force)
    return Preparation(study.file, study.folder, sources, study.first_seed)


def _prepare(study: Study) -> dict[str, Prepared]:
    """Read the base, check all edits against it, and make the tables of every scenario."""
    preparation = _preparation(study)
    scenarios, tables = preparation.scenarios()
    return preparation.prepared(scenarios, tables)


def _clear(study: Study) -> None:
    """Take away what an earlier call has concluded: until the end nothing vouches for it."""
    folder = study.folder
    set_aside(folder)
    (folder.path / METADATA).unlink(missing_ok=True)
    folder.write_manifest(StudyManifest({"name": study.file.config.name, "finished": False}))


def _run_all(study: Study, runner: Runner, prepared: Mapping[str, Prepared]) -> None:
    """Do all runs, batch by batch."""
    until = study.seeds.until
    for batch in study.seeds.batches():
        groups = _groups(study, prepared, batch)
        total = len(prepared) * len(study.seeds.done)
        for report in runner.run(groups):
            study.reports[(report.scenario, report.seed)] = report
            _tell_of_run(study, report, total)
        if until is not None and _is_enough(study, until, list(prepared)):
            return


def _groups(
    study: Study, prepared: Mapping[str, Prepared], seeds: Sequence[int]
) -> list[list[Job]]:
    """Jobs of a batch; those that would simulate the same are one group, done in turn."""
    groups: dict[str, list[Job]] = {}
    for seed in seeds:
        for name, scenario in prepared.items():
            config = with_seed(scenario.config, seed)
            run = Run(config, scenario.tables, study.watch, (), (), study.folder.store)
            job = Job(
                scenario=name,
                seed=seed,
                folder=study.folder.run(name, seed).path,
                store=study.folder.store.path,
                config=absolute_values(config),
                tables=scenario.tables.path,
                ingested=scenario.ingested,
                command=tuple(study.command),
                code=code_digest(),
                versions=versions(),
                report=_gets_report(study, seed),
                force=study.force,
            )
            groups.setdefault(run.key_of(SIMULATE), []).append(job)
    return list(groups.values())


def _gets_report(study: Study, seed: int) -> bool:
    told = study.file.config.reports
    return told == "all" or (told == "first_seed" and seed == study.first_seed)


def _tell_of_run(study: Study, report: Report, total: int) -> None:
    done = len(study.reports)
    count = f"{done:>{len(str(total))}} of {total}"
    _tell(study, f"{count}: {report.scenario}, seed {report.seed}: {report.words}")
    study.watch.counted(done, total)


def _compare(study: Study, prepared: Mapping[str, Prepared]) -> Concluded:
    """Write the comparison that the study asks for, unless there is one of just these runs."""
    which = study.file.config.comparison
    sweep = study.file.config.sweep
    points = {} if sweep is None else sweep.points()
    scenarios = {name: one for name, one in prepared.items() if name not in points}
    found = Concluded()
    if which != "none" and len(scenarios) > 1:
        reports = [one for one in in_order(study, prepared) if one.scenario in scenarios]
        compared = Compared(study.file.config.name, study.folder, scenarios, reports)
        key = compared.key(which)
        earlier = None if study.force else take_back(study.folder, key)
        state = "up to date" if earlier else "of scenarios with the base"
        study.watch.say(f"comparison: {state}")
        found = earlier or Concluded(*compared.write(which, study.folder.log), key)
    forget(study.folder)
    return found


def _sweep(study: Study, prepared: Mapping[str, Prepared]) -> Sequence[str]:
    """Write what came of the points of a sweep; return the files' names."""
    sweep = study.file.config.sweep
    if sweep is None:
        return ()
    return SweepRuns(sweep, in_order(study, prepared)).write(study.folder.path)


def _is_enough(study: Study, until: UntilSection, scenarios: Sequence[str]) -> bool:
    figures = {
        key: report.figures.get(until.figure)
        for key, report in study.reports.items()
        if report.status == "finished"
    }
    found = widths(until, figures, scenarios, study.seeds.done)
    wide = [width for width in found if not width.is_narrow]
    words = f"after {len(study.seeds.done)} seeds, {until.figure}: {', '.join(map(str, found))}"
    if wide and len(study.seeds.done) == study.seeds.most:
        words = f"warning: {words}; seeds.maximum is reached"
    _tell(study, words)
    return not wide


def _write(
    study: Study,
    prepared: Mapping[str, Prepared],
    started: datetime,
    compared: Concluded,
    *,
    finished: bool,
) -> None:
    """Write the figures and the manifest, of what has been done."""
    folder, reports = study.folder, in_order(study, prepared)
    folder.write_figures(reports)
    with replace_when_complete(folder.path / STUDY) as path:
        path.write_bytes(study.file.text.encode())
    write_config(study.base, folder.path / BASE_CONFIG)
    known = {(report.scenario, report.seed) for report in reports}
    waiting = [
        Report(name, seed, "failed", "", ["was not run"])
        for name in prepared
        for seed in study.seeds.done
        if (name, seed) not in known
    ]
    runs = [run_entry(report) for report in (*reports, *waiting)]
    about = {
        **facts(study, prepared),
        "comparison": compared.entry(),
        "started": started.isoformat(timespec="seconds"),
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
        "finished": finished,
    }
    outputs = folder.record(FIGURES, STUDY, BASE_CONFIG, *compared.files, *compared.swept)
    manifest = StudyManifest(about, runs, outputs)
    folder.write_manifest(manifest)
    write_study_crate(folder, manifest)


def _tell(study: Study, text: str) -> None:
    study.folder.log(text)
    study.watch.say(text)

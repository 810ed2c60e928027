"""One run of a study, as any process can do it that has the results folder."""

from __future__ import annotations

import math
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pipeline import ingest, measure, report, simulate
from pipeline.config import Config
from pipeline.execution import Run
from pipeline.program import code_digest, versions
from pipeline.progress import Silence
from pipeline.runs import LOG, RunFolder, StageRecord
from pipeline.stages import Stage
from pipeline.store import Store
from uxsim_geo.analysis.comparison.quantities import TOTALS
from uxsim_geo.errors import InputError

#: what is done of every run; that its tables are there has been seen to
STAGES: tuple[Stage, ...] = (simulate.STAGE, measure.STAGE)

#: of a run: columns of figures.csv
NAMES = tuple(quantity.name for quantity in TOTALS)


@dataclass(frozen=True)
class Job:
    """A run that is to be done.

    folder, store
        absolute paths
    config
        as plain values, with absolute paths
    tables, ingested
        a run folder with the tables of the scenario, and the record of how they came about
    code, versions
        digest of the program that plans the study, and its libraries: others would make other
        results
    report
        whether the run gets a full report
    force
        whether it is done again though it is done, or in the store
    """

    scenario: str
    seed: int
    folder: Path
    store: Path
    config: Mapping[str, Any]
    tables: Path
    ingested: StageRecord
    command: Sequence[str]
    code: str
    versions: Mapping[str, str]
    report: bool = False
    force: bool = False

    @property
    def name(self) -> str:
        """What the user is told."""
        return f"{self.scenario}, seed {self.seed}"


@dataclass(frozen=True)
class Report:
    """What became of a run: its figures, or why there are none.

    problems
        what went wrong, a line each; a run that is finished may lack outputs of its report
    """

    scenario: str
    seed: int
    status: Literal["finished", "failed"]
    words: str
    problems: Sequence[str] = ()
    figures: Mapping[str, float | None] = field(default_factory=dict)


class _Remembering(Silence):
    """Keeps what was said last of every stage."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def say(self, text: str) -> None:
        self.lines.append(text.splitlines()[0])


def run_job(job: Job) -> Report:
    """Do a run, or find that it is done; whatever goes wrong is in the report, and in its log."""
    folder = RunFolder(job.folder)
    try:
        return _run(job, folder)
    except InputError as error:
        lines = [str(fault) for fault in error.faults]
        return _failed(job, lines, "\n".join(f"error: {line}" for line in lines))
    except Exception as error:  # noqa: BLE001  told in the report, and the study fails by it
        lines = [f"{type(error).__name__}: {error}"]
        return _failed(job, lines, "".join(traceback.format_exception(error)))


def lost(job: Job, why: str) -> Report:
    """Report a run whose process has ended in the middle of it, again and again."""
    what = f"its process ended in the middle of it ({why}), also when nothing else was run"
    return _failed(job, [what], f"error: {what}")


def warm_up() -> None:
    """Load the engine, compiling it if need be: not in several processes at once."""
    import pandas as pd

    from uxsim_geo.control.closures import Closure
    from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
    from uxsim_geo.engine.simulation import simulate as simulate_tables
    from uxsim_geo.network.network import Network
    from uxsim_geo.settings import Settings

    link = {"link_id": "ab", "from_node_id": "a", "to_node_id": "b", "length": 100.0, "lanes": 1}
    link |= {"free_speed": 10.0, "jam_density": 0.2, "capacity": 0.5, "merge_priority": 1.0}
    nodes = pd.DataFrame({"node_id": ["a", "b"], "through_traffic": [True, True]})
    turns = pd.DataFrame(columns=["node_id", "from_link_id", "to_link_id", "via_link_ids"])
    demand = pd.DataFrame([("a", "b", 0.0, 10.0, 5.0)], columns=list(DEMAND_COLUMNS))
    network = Network(nodes, pd.DataFrame([link]), turns.astype("str"))
    closure = Closure(["ab"], begin=30.0)  # control is code of its own
    simulate_tables(network, Demand(demand), Settings(duration=60.0), control=[closure])


def _run(job: Job, folder: RunFolder) -> Report:
    if what := _other_program(job):
        return _failed(job, [what], f"error: {what}")
    watch = _Remembering()
    config = Config.model_validate(job.config)
    stages = (*STAGES, *([report.STAGE] if job.report else []))
    run = Run(config, folder, watch, job.command, (ingest.STAGE, *stages), Store(job.store))
    run.adopt(ingest.STAGE, job.ingested, RunFolder(job.tables))
    run = Run(config, folder, watch, job.command, stages, Store(job.store))
    problems = run.execute(stages[-1].name, force=job.force)
    figures = _figures(folder)
    words = next((line for line in watch.lines if line.startswith("simulate: ")), "")
    words = words.removeprefix("simulate: ")
    return Report(job.scenario, job.seed, "finished", words, problems, figures)


def _other_program(job: Job) -> str:
    """Say what of the program is another here than where the study is planned."""
    here = versions()
    others = [
        f"{name} {here.get(name, 'none')} (the study {version})"
        for name, version in job.versions.items()
        if here.get(name) != version
    ]
    if others:
        return f"the worker has other versions: {', '.join(others)}; install the same"
    if job.code != code_digest():
        return "the worker has another uxsim-geo than the study; install the same"
    return ""


def _figures(folder: RunFolder) -> dict[str, float | None]:
    """Read the figures of a measured run; None where one is undefined."""
    import pandas as pd

    totals = pd.read_parquet(folder / measure.FOLDER / "totals.parquet")
    values = dict(zip(totals["figure"], totals["value"], strict=True))
    return {name: None if math.isnan(value) else float(value) for name, value in values.items()}


def _failed(job: Job, problems: Sequence[str], log: str) -> Report:
    folder = RunFolder(job.folder)
    where = f"details in {folder / LOG}"
    try:
        folder.log(log)
    except (OSError, InputError) as failure:
        where = f"no details, since there is no log: {failure}"
    return Report(job.scenario, job.seed, "failed", f"failed; {where}", problems)

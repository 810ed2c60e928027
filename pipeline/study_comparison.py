"""The end of a study: its scenarios compared with the base, over all seeds that both have."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from pipeline import ingest, measure, simulate
from pipeline.compare import compare_pairs
from pipeline.comparison_files import FOLDER, write_tables, write_views
from pipeline.config_differences import Told, differing_links
from pipeline.config_file import plain_values
from pipeline.finished import read_run
from pipeline.program import code_digest, versions
from pipeline.runs import FileRecord
from pipeline.scenarios import BASE
from pipeline.store import key_of
from pipeline.study_folder import StudyFolder
from pipeline.study_jobs import Report
from pipeline.study_scenarios import Prepared

if TYPE_CHECKING:
    from uxsim_geo.analysis.comparison.comparison import Comparison
    from uxsim_geo.export.comparison.study import Study
    from uxsim_geo.network.network import Network

#: files that a comparison may leave beside its folder
FILES = ("comparison.gpkg", "comparison.html")


@dataclass(frozen=True)
class Compared:
    """A study whose runs are done.

    reports
        of all runs, in the order of scenarios and seeds
    """

    name: str
    folder: StudyFolder
    prepared: Mapping[str, Prepared]
    reports: Sequence[Report]

    def write(
        self, which: Literal["full", "tables"], log: Callable[[str], None]
    ) -> tuple[list[str], list[str]]:
        """Write tables, and layers, page and pictures if ``full``.

        Returns the names of the files in the study's folder, and what could not be written; how it
        came to that is handed to ``log``.
        """
        networks = {name: _network(one) for name, one in self.prepared.items()}
        compared = {name: self._compare(name, networks) for name in self.prepared if name != BASE}
        known = [comparison for comparison in compared.values() if comparison is not None]
        if not known:
            return [], []
        write_tables(known, self.folder.path)
        problems: list[str] = []
        if which == "full":
            problems = write_views(self._study(compared, networks), self.folder.path, log)
        return self._written(), problems

    def key(self, which: str) -> str:
        """Return what the comparison follows from, as a key of a store."""
        settings = {
            "name": self.name,
            "which": which,
            "scenarios": {
                name: [plain_values(one.config, self.folder.path), one.edits]
                for name, one in self.prepared.items()
            },
            "failed": [
                [one.scenario, one.seed, list(one.problems)]
                for one in self.reports
                if one.status == "failed"
            ],
            "code": code_digest(),
            "versions": versions(),
        }
        inputs = {
            f"{one.scenario}, seed {one.seed}: {name}": record
            for one in self.reports
            if one.status == "finished"
            for name, record in self._tables_of(one).items()
        }
        return key_of("comparison", settings, inputs)

    def _tables_of(self, report: Report) -> dict[str, FileRecord]:
        """Return what a run has left, except its report, which nothing follows from."""
        stages = self.folder.run(report.scenario, report.seed).read_manifest().stages
        found: dict[str, FileRecord] = {}
        for stage in (ingest.STAGE, simulate.STAGE, measure.STAGE):
            found |= stages[stage.name].outputs
        return found

    def _compare(self, name: str, networks: Mapping[str, Network]) -> Comparison | None:
        """Compare a scenario with the base; None: there is no seed of which both are done."""
        from uxsim_geo.analysis.comparison.comparison import Facts

        done = {(one.scenario, one.seed) for one in self.reports if one.status == "finished"}
        seeds = [seed for scenario, seed in done if scenario == name and (BASE, seed) in done]
        if not seeds:
            return None
        order = [one.seed for one in self.reports if one.scenario == name and one.seed in seeds]
        told = [self._told(scenario, order[0]) for scenario in (BASE, name)]
        links = differing_links(told[0], told[1], (networks[BASE], networks[name]))
        pairs = ((self.folder.run(BASE, seed), self.folder.run(name, seed)) for seed in order)
        return compare_pairs(pairs, Facts(BASE, name, links))

    def _told(self, name: str, seed: int) -> Told:
        folder = self.folder.run(name, seed)
        return Told(folder, folder.read_manifest(), self.prepared[name].config)

    def _study(
        self, compared: Mapping[str, Comparison | None], networks: Mapping[str, Network]
    ) -> Study:
        from pipeline.results_files import describe
        from uxsim_geo.export.comparison.study import FailedRun, Scenario, Study

        done = next(
            one.seed for one in self.reports if (one.scenario, one.status) == (BASE, "finished")
        )
        base = self.folder.run(BASE, done)
        about = replace(describe(read_run(base, base.read_manifest())), name=self.name)
        scenarios = [
            Scenario(name, self.prepared[name].edits, networks[name], comparison)
            for name, comparison in compared.items()
        ]
        failed = [
            FailedRun(one.scenario, one.seed, "; ".join(one.problems))
            for one in self.reports
            if one.status == "failed"
        ]
        return Study(about, networks[BASE], scenarios, failed)

    def _written(self) -> list[str]:
        root = self.folder.path
        files = [*(root / FOLDER).rglob("*"), *(root / name for name in FILES)]
        return [path.relative_to(root).as_posix() for path in sorted(files) if path.is_file()]


def _network(prepared: Prepared) -> Network:
    from uxsim_geo.network.files import read_network

    return read_network(prepared.tables / ingest.NETWORK)

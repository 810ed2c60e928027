"""What a report and tables are made of: the tables of a run, and what follows from them once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pipeline import ingest, simulate
from pipeline.config import Config
from pipeline.runs import FileRecord
from pipeline.signal_tables import SIGNALS, signals_of
from pipeline.stages import Task
from uxsim_geo.analysis.table_size import MOST_BINS, MOST_STATES, shortest_step
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.analysis.kept_states import LinkStates
    from uxsim_geo.analysis.passages import Passages
    from uxsim_geo.analysis.run_passages import RunPassages
    from uxsim_geo.control.signals import Signal
    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result


@dataclass(frozen=True)
class Material:
    """A simulated run.

    notes
        of the import, network and demand together
    signals
        that held: those of the configuration and of the network's own table
    sources
        what ingestion read, by name, as its manifest records them
    """

    config: Config
    network: Network
    notes: pd.DataFrame
    result: Result
    signals: tuple[Signal, ...]
    sources: Mapping[str, FileRecord] = field(default_factory=dict)

    @cached_property
    def passages(self) -> RunPassages:
        """All link entries, of which as many are in memory as fit."""
        from uxsim_geo.analysis.run_passages import RunPassages

        return RunPassages(self.result, self.network)

    def passages_on(self, links: tuple[str, ...]) -> Passages:
        """Those of some links."""
        from uxsim_geo.analysis.subsets import rows_of_links

        return self.passages.on(rows_of_links(self.network, links))

    @cached_property
    def kept_states(self) -> LinkStates:
        """All links in all time bins of the report, of which tables can be made in parts."""
        from uxsim_geo.analysis.link_states import link_states

        bin_s = self.config.report.bin_s
        return link_states(self.result, self.network, bin_s=bin_s, passages=self.passages.whole)

    @cached_property
    def states(self) -> pd.DataFrame:
        """The whole table of them: on large networks it takes more memory than all else."""
        return self.kept_states.table()

    @cached_property
    def figures(self) -> dict[str, Any]:
        """Of the whole run: :func:`uxsim_geo.analysis.summary.summary`."""
        from uxsim_geo.analysis.summary import summary

        return summary(self.result, self.network)

    @property
    def layer_names(self) -> tuple[str, ...]:
        """Of the layers that are tables of their own."""
        from uxsim_geo.export.run_layers import names_of_layers

        return names_of_layers(self.network, self.config.report.layers)

    @cached_property
    def layers(self) -> dict[str, Any]:
        """What results files hold, by name: :func:`uxsim_geo.export.run_layers.layers_of_run`."""
        from pipeline.results_files import describe
        from uxsim_geo.export.run_layers import Run, layers_of_run
        from uxsim_geo.export.trajectory_layer import Sample

        run = Run(self.network, self.result, self.kept_states, self.passages)
        told = self.config.report.trajectories
        return layers_of_run(
            run, describe(self), self.config.report.layers, Sample(told.trips, told.step_s)
        )

    def states_in(self, bin_s: float, links: tuple[str, ...] | None = None) -> pd.DataFrame:
        """Links, or all, in time bins: :func:`uxsim_geo.analysis.link_states.link_times`."""
        from uxsim_geo.analysis.link_states import link_times

        return link_times(
            self.result, self.network, bin_s=bin_s, links=links, passages=self.passages.whole
        )


def read_material(task: Task) -> Material:
    """Read the tables that ingestion and simulation left in the run's folder.

    Raises :class:`uxsim_geo.errors.InputError` for files that are absent or damaged.
    """
    import pandas as pd

    from uxsim_geo.network.files import read_network
    from uxsim_geo.parquet import read_tables

    network = read_network(task.folder / ingest.NETWORK)
    (demand_notes,) = read_tables(task.folder / ingest.DEMAND_NOTES)
    return Material(
        config=task.config,
        network=network,
        notes=pd.concat([network.notes, demand_notes], ignore_index=True),
        result=simulate.read_result(task, network),
        signals=(
            *(entry.measure() for entry in task.config.simulate.control.signals),
            *signals_of(task.config, task.folder / SIGNALS),
        ),
        sources=task.folder.read_manifest().stages["ingest"].inputs,
    )


def check_bins_of_report(config: Config, links: int) -> None:
    """Refuse time bins of a report, and of its plots, that are too short for so many links."""
    bins = {"report.bin_s": config.report.bin_s}
    for number, entry in enumerate(config.report.plots):
        # the cells of a corridor are counted where they are cut
        if entry.bin_s is not None and entry.plot != "time_space_diagram_state_links":
            bins[f"report.plots[{number}].bin_s"] = entry.bin_s
    faults: list[Fault] = []
    for key, bin_s in bins.items():
        faults += faults_of_bins(key, bin_s, config.simulate.duration_s, links)
    if faults:
        raise InputError(faults)


def faults_of_bins(key: str, bin_s: float, duration: float, links: int) -> Iterator[Fault]:
    """What is wrong with time bins so short that the computer would choke on their number."""
    most = min(MOST_BINS, max(MOST_STATES // max(links, 1), 1))
    if duration / bin_s > most:
        shortest = shortest_step(duration, most)
        yield Fault(
            f"{key}: too short for {links:,} links; take {shortest:g} s or more", value=bin_s
        )

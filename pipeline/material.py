"""What a report is made of: the tables of a run, and what follows from them once for all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pipeline import ingest, simulate
from pipeline.config import Config
from pipeline.stages import Task
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.analysis.passages import Passages
    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result

#: links times time bins; more would take over 10 GB of memory
MOST_STATES = 50_000_000


@dataclass(frozen=True)
class Material:
    """What the outputs are made of.

    notes
        of the import, network and demand together
    """

    config: Config
    network: Network
    notes: pd.DataFrame
    result: Result

    @cached_property
    def passages(self) -> Passages:
        """All link entries."""
        from uxsim_geo.analysis.passages import Passages

        return Passages.of(self.result, self.network)

    @cached_property
    def states(self) -> pd.DataFrame:
        """All links in all time bins of the report."""
        return self.states_in(self.config.report.bin_s)

    @cached_property
    def figures(self) -> dict[str, Any]:
        """Of the whole run: :func:`uxsim_geo.analysis.summary.summary`."""
        from uxsim_geo.analysis.summary import summary

        return summary(self.result, self.network)

    def states_in(self, bin_s: float) -> pd.DataFrame:
        """All links in time bins: :func:`uxsim_geo.analysis.link_states.link_times`."""
        from uxsim_geo.analysis.link_states import link_times

        return link_times(self.result, self.network, bin_s=bin_s, passages=self.passages)


def read_material(task: Task) -> Material:
    """Read the tables that ingestion and simulation left in the run's folder.

    Raises :class:`uxsim_geo.errors.InputError` for time bins that are too short.
    """
    import pandas as pd

    from uxsim_geo.network.files import read_network
    from uxsim_geo.parquet import read_tables

    network = read_network(task.folder / ingest.NETWORK)
    bins = {"report.bin_s": task.config.report.bin_s}
    for number, entry in enumerate(task.config.report.plots):
        if entry.bin_s is not None:
            bins[f"report.plots[{number}].bin_s"] = entry.bin_s
    for key, bin_s in bins.items():
        check_bins(key, bin_s, task.config.simulate.duration_s, len(network.links))
    (demand_notes,) = read_tables(task.folder / ingest.DEMAND_NOTES)
    return Material(
        config=task.config,
        network=network,
        notes=pd.concat([network.notes, demand_notes], ignore_index=True),
        result=simulate.read_result(task, network),
    )


def check_bins(key: str, bin_s: float, duration: float, links: int) -> None:
    """Refuse time bins so short that the computer would choke on their number."""
    shortest = duration * links / MOST_STATES
    if bin_s < shortest:
        what = f"{key}: too short for {links:,} links; take {math.ceil(shortest)} s or more"
        raise InputError([Fault(what, value=bin_s)])

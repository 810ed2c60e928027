"""Ingestion: source files to the network tables and the demand of a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.config import Config, IngestSection
from pipeline.runs import RunFolder
from pipeline.stages import Outcome, Stage, Task
from pipeline.warned import number_in_words, warnings_in
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network

#: where the tables lie in a run folder
NETWORK = "network"
DEMAND = "demand.parquet"
DEMAND_NOTES = "demand_notes.parquet"


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:  # noqa: ARG001
    section = config.ingest
    named = {"net": section.net, "nodes": section.nodes, "flow": section.flow}
    named["overrides"] = section.overrides
    named |= {f"trips.{number}": entry.file for number, entry in enumerate(section.trips)}
    return {name: path for name, path in named.items() if path is not None}


def _run(task: Task) -> Outcome:
    import pandas as pd

    from uxsim_geo.demand.files import write_demand
    from uxsim_geo.network.files import write_network

    network, demand = read_sources(task.config.ingest)
    task.begin_writing()
    paths = write_network(network, task.folder / NETWORK)
    paths += write_demand(demand, task.folder / DEMAND)
    names = [path.relative_to(task.folder.path).as_posix() for path in paths]
    notes = pd.concat([network.notes, demand.notes])
    return Outcome(names, _words(network, demand), warnings=warnings_in(notes))


STAGE = Stage("ingest", ("ingest",), _inputs, _run)


def read_sources(section: IngestSection) -> tuple[Network, Demand]:
    """Read network and demand, corrected by the overrides.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong in the files; what needs
    the network can only be checked once that is right.
    """
    import pandas as pd

    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.demand.tntp import read_tntp_trips
    from uxsim_geo.network.overrides import apply_overrides
    from uxsim_geo.network.tntp import read_tntp_network

    options = section.network_options()
    network = read_tntp_network(section.net, options, nodes=section.nodes, flow=section.flow)
    classes_named = any(entry.driver_class is not None for entry in section.trips)
    faults: list[Fault] = []
    demands: list[Demand] = []
    for entry in section.trips:
        try:
            demand = read_tntp_trips(entry.file, entry.trips_options(), network)
            demands.append(_of_class(demand, entry.driver_class) if classes_named else demand)
        except InputError as error:
            faults += error.faults
    if section.overrides is not None:
        try:
            network = apply_overrides(network, section.overrides)
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    table = pd.concat([demand.table for demand in demands], ignore_index=True)
    notes = pd.concat([demand.notes for demand in demands], ignore_index=True)
    return network, Demand(table, notes)


def _of_class(demand: Demand, name: str | None) -> Demand:
    """Return a demand all of whose rows name a class of drivers."""
    from uxsim_geo.control.drivers import DEFAULT

    return replace(demand, table=demand.table.assign(**{"class": name or DEFAULT}))


def _words(network: Network, demand: Demand) -> str:
    pairs = len(demand.table[["origin", "destination"]].drop_duplicates())
    return (
        f"{len(network.nodes):,} nodes, {len(network.links):,} links, {pairs:,} OD pairs, "
        f"{number_in_words(demand.table['vehicles'].sum())} trips"
    )

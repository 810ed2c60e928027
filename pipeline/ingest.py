"""Ingestion: source files to the network tables and the demand of a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.config import Config
from pipeline.config_keys import named_files
from pipeline.demand_sources import of_class, read_demand_entries
from pipeline.edits import apply_edits, notes_of, placed_edits
from pipeline.import_notes import PAGE, with_doubts, write_page
from pipeline.ingest_config import IngestSection
from pipeline.osm_roads import CACHE, DOWNLOAD, downloaded_files, fetch_roads, roads_of
from pipeline.progress import Watch
from pipeline.runs import RunFolder
from pipeline.signal_tables import SIGNALS, signal_table
from pipeline.stages import Outcome, Stage, Task
from pipeline.tntp_sources import DATASET, dataset_inputs, fetch_dataset, files_of, note_dataset
from pipeline.warned import warnings_in
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.network.note_words import number_in_words
from uxsim_geo.network.rows import count

if TYPE_CHECKING:
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network
    from uxsim_geo.network.telling import Telling

    #: network and demand from the files of a section
    Reader = Callable[[IngestSection, Telling | None], tuple[Network, Demand]]

#: where the tables lie in a run folder
NETWORK = "network"
DEMAND = "demand.parquet"
DEMAND_NOTES = "demand_notes.parquet"
#: only where edits have changed platoons
DEMAND_CHANGES = "demand_changes.parquet"


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:  # noqa: ARG001
    return source_files(config.ingest) | named_files(config.edits, "edits")


def source_files(section: IngestSection) -> dict[str, Path]:
    """Return the files that hold network and demand, downloads among them, by name."""
    # other runs keep their downloads in the same cache: of it, this run's alone is an input
    named = named_files(section).items()
    files = {name: path for name, path in named if not name.startswith(CACHE)}
    return files | downloaded_files(section.osm) | dataset_inputs(section)


def fetch(config: Config, watch: Watch) -> None:
    """Download what is not there yet."""
    if config.ingest.osm is not None:
        fetch_roads(config.ingest.osm, watch.say)
    fetch_dataset(config.ingest, watch.say)


def downloads(config: Config) -> tuple[str, ...]:
    """How names of inputs begin that are downloaded once; those of refresh: true are wanted."""
    osm = config.ingest.osm
    return () if osm is not None and osm.refresh else (DOWNLOAD, DATASET)


def _edit_and_write(task: Task, as_read: Network, demand: Demand) -> Outcome:
    """Make the edits of the configuration, and write what they leave."""
    import pandas as pd

    from uxsim_geo.demand.files import write_demand
    from uxsim_geo.network.files import write_network
    from uxsim_geo.network.note_geometry import placed
    from uxsim_geo.network.signal_table import write_signal_table

    edits = placed_edits(task.config)
    edited = apply_edits(as_read, demand, edits)
    network, demand = edited.network, edited.demand
    notes = notes_of(edits, edited.changes)
    signals = signal_table(task.config.ingest, as_read, edited, notes)
    told = pd.concat([network.notes, notes.table()], ignore_index=True)
    network = replace(network, notes=placed(told, network, as_read))
    task.begin_writing()
    paths = write_network(network, task.folder / NETWORK)
    paths += write_demand(demand, task.folder / DEMAND)
    if signals is not None:
        write_signal_table(signals, task.folder / SIGNALS)
        paths.append(task.folder / SIGNALS)
    paths.append(write_page(task.config, network, demand, task.folder / PAGE))
    names = [path.relative_to(task.folder.path).as_posix() for path in paths]
    told = pd.concat([network.notes, demand.notes])
    return Outcome(names, in_words(network, demand), warnings=warnings_in(told))


def stage(read: Reader | None = None) -> Stage:
    """Return the stage; ``read`` gives the tables as read, as :func:`read_sources` does.

    Runs that differ in their edits alone may share what was read.
    """

    def run(task: Task) -> Outcome:
        return _edit_and_write(task, *(read or read_sources)(task.config.ingest, task.watch.drawn))

    return Stage(
        "ingest",
        ("name", "ingest", "edits"),  # the page of the import is headed by the run's name
        _inputs,
        run,
        fetch,
        downloads,
        may_leave=(SIGNALS, DEMAND_CHANGES),
        storable=True,
    )


STAGE = stage()


def read_sources(section: IngestSection, progress: Telling | None = None) -> tuple[Network, Demand]:
    """Read network and demand, corrected by the overrides; what looks doubtful is in the notes.

    ``progress`` is told what is being done and how far it has come, 0 to 1. Raises
    :class:`uxsim_geo.errors.InputError` with all that is wrong in the files; what needs the network
    can only be checked once that is right.
    """
    import pandas as pd

    from uxsim_geo.control.drivers import DEFAULT
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.overrides import apply_overrides

    network = as_read = NETWORKS[section.format](section, progress)
    if section.steps is not None:
        from uxsim_geo.network.ready import make_ready

        side = section.osm.side() if section.osm is not None else "right"
        network = make_ready(network, section.steps.options(side), progress=progress)
    faults: list[Fault] = []
    demands: list[Demand] = []
    for read in (_tntp_trips, _demand_beside, _other_demand):
        try:
            demands += read(section, network)
        except InputError as error:
            faults += error.faults
    if section.overrides is not None:
        try:
            network = apply_overrides(network, section.overrides)
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    if not demands:
        what = "ingest: there are no trips in these files; describe some under ingest.demand"
        raise InputError([Fault(what)])
    table = pd.concat([demand.table for demand in demands], ignore_index=True)
    if "class" in table:
        table["class"] = table["class"].fillna(DEFAULT)
    notes = pd.concat([demand.notes for demand in demands], ignore_index=True)
    return with_doubts(network, as_read), Demand(table, notes)


def _tntp_network(section: IngestSection, progress: Telling | None) -> Network:  # noqa: ARG001
    from uxsim_geo.network.tntp import read_tntp_network

    files, options = files_of(section), section.network_options()
    network = read_tntp_network(
        files["net"], options, nodes=files.get("nodes"), flow=files.get("flow")
    )
    return note_dataset(network, section)


def _osm_network(section: IngestSection, progress: Telling | None) -> Network:
    from uxsim_geo.network.osm import read_osm_network

    assert section.osm is not None
    options = section.osm.options(section.jam_density)
    if section.osm.file is not None:
        return read_osm_network(section.osm.file, options, progress=progress)
    from uxsim_geo.network.osm_download import note_download

    roads = roads_of(section.osm)
    return note_download(read_osm_network(roads.path, options, progress=progress), roads)


def _gmns_network(section: IngestSection, progress: Telling | None) -> Network:  # noqa: ARG001
    from uxsim_geo.network.gmns import read_gmns_network

    assert section.gmns is not None
    return read_gmns_network(section.gmns.folder, section.gmns.options(section.jam_density))


def _csv_network(section: IngestSection, progress: Telling | None) -> Network:  # noqa: ARG001
    return _csv_tables(section)[0]


def _csv_tables(section: IngestSection) -> tuple[Network, Demand]:
    from uxsim_geo.demand.uxsim_csv import read_uxsim_csv
    from uxsim_geo.network.uxsim_tables import UxsimCsvOptions

    assert section.csv is not None
    files = section.csv.nodes, section.csv.links, section.csv.demand
    return read_uxsim_csv(*files, UxsimCsvOptions(section.csv.crs))


def _tables_network(section: IngestSection, progress: Telling | None) -> Network:  # noqa: ARG001
    from uxsim_geo.network.mapped import read_mapped_network

    told = section.tables
    assert told is not None
    return read_mapped_network(
        told.links,
        told.mapping(),
        nodes_file=told.nodes,
        links_layer=told.links_layer,
        nodes_layer=told.nodes_layer,
    )


#: one reader a format
NETWORKS: dict[str, Callable[[IngestSection, Telling | None], Network]] = {
    "tntp": _tntp_network,
    "osm": _osm_network,
    "gmns": _gmns_network,
    "csv": _csv_network,
    "tables": _tables_network,
}


def _tntp_trips(section: IngestSection, network: Network) -> list[Demand]:
    from uxsim_geo.demand.tntp import read_tntp_trips

    faults: list[Fault] = []
    demands: list[Demand] = []
    files = files_of(section)
    for entry in section.trips:
        file = files["trips"] if entry.file is None else entry.file
        try:
            demand = read_tntp_trips(file, entry.trips_options(), network)
            demands.append(of_class(demand, entry.driver_class))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    return demands


def _demand_beside(section: IngestSection, network: Network) -> list[Demand]:
    """The demand that the files of the network's format bring along."""
    if section.csv is not None and section.csv.demand is not None:
        return [_csv_tables(section)[1]]
    told = section.gmns
    if told is None or not told.demand or not (told.folder / "demand.csv").is_file():
        return []
    from uxsim_geo.demand.gmns import read_gmns_demand

    options, unknown = told.trips_options(), told.unknown_zones
    return [read_gmns_demand(told.folder, network, options, unknown_zones=unknown)]


def _other_demand(section: IngestSection, network: Network) -> list[Demand]:
    return read_demand_entries(section.demand, network)


def in_words(network: Network, demand: Demand) -> str:
    """Say how much was read."""
    from uxsim_geo.demand.driven import driven

    demand = driven(demand)
    pairs = len(demand.table[["origin", "destination"]].drop_duplicates())
    doubts = int((network.notes["severity"] == "doubt").sum())
    return (
        f"{len(network.nodes):,} nodes, {len(network.links):,} links, {pairs:,} OD pairs, "
        f"{number_in_words(demand.table['vehicles'].sum())} trips"
        + (f"; {count(doubts, 'doubtful spot')}, see {PAGE}" if doubts else "")
    )

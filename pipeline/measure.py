"""The stage that reduces a run to what it is compared by."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import ingest, simulate
from pipeline.config import Config
from pipeline.material import faults_of_bins
from pipeline.measure_config import MeasureSection
from pipeline.runs import RunFolder
from pipeline.stages import Outcome, Stage, Task
from uxsim_geo.errors import InputError

if TYPE_CHECKING:
    from uxsim_geo.analysis.areas import Areas
    from uxsim_geo.analysis.comparison.corridors import Corridors
    from uxsim_geo.analysis.comparison.measured import Measured
    from uxsim_geo.analysis.comparison.measuring import MeasureOptions
    from uxsim_geo.network.network import Network

#: in a run's folder
FOLDER = "measures"


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:
    tables = (f"{ingest.NETWORK}/{table}.parquet" for table in ("nodes", "links"))
    files = {name: folder / name for name in (*tables, *simulate.tables_of(folder))}
    return files if config.measure.zones is None else files | {"zones": config.measure.zones}


def _run(task: Task) -> Outcome:
    from uxsim_geo.analysis.comparison.measured import write_measured
    from uxsim_geo.analysis.comparison.measuring import measure
    from uxsim_geo.network.files import read_network

    network = read_network(task.folder / ingest.NETWORK)
    warnings: list[str] = []
    options = measure_options(task.config, network, warnings)
    measured = measure(simulate.read_result(task, network), network, options)
    task.begin_writing()
    names = write_measured(measured, task.folder / FOLDER)
    words = f"figures of {len(measured.links):,} links and {len(measured.trips):,} trips"
    return Outcome([f"{FOLDER}/{name}" for name in names], words, warnings=warnings)


# the settings of the simulation are those with which its tables are read
STAGE = Stage("measure", ("simulate", "measure"), _inputs, _run, storable=True)


def read_measures(folder: RunFolder) -> Measured:
    """Read what the stage has left in a run's folder.

    Raises :class:`uxsim_geo.errors.InputError` for files that are absent or damaged.
    """
    from uxsim_geo.analysis.comparison.measured import read_measured

    return read_measured(folder / FOLDER)


def measure_options(config: Config, network: Network, warnings: list[str]) -> MeasureOptions:
    """What the configuration asks of a network; what that lacks goes into ``warnings``.

    A scenario may take away a link of a corridor, or all nodes of a zone.

    Raises :class:`uxsim_geo.errors.InputError` for time bins that are too short, corridors that are
    no paths, and zones that cannot be read or laid over the network.
    """
    from uxsim_geo.analysis.comparison.measuring import MeasureOptions

    told = config.measure
    duration, links = config.simulate.duration_s, len(network.links)
    if faults := list(faults_of_bins("measure.bin_s", told.bin_s, duration, links)):
        raise InputError(faults)
    corridors = _corridors(told, network, warnings)
    return MeasureOptions(told.bin_s, corridors, _zones(told, network, warnings))


def _corridors(told: MeasureSection, network: Network, warnings: list[str]) -> Corridors:
    from uxsim_geo.analysis.comparison.corridors import check_corridors
    from uxsim_geo.analysis.comparison.streets import street_paths

    known = set(network.links["link_id"].astype(str))
    found: dict[str, list[str]] = {}
    for entry in told.corridors:
        if entry.street is not None:
            paths = street_paths(network, entry.street)
            if not paths:
                warnings.append(f"warning: corridor: no link is called {entry.street}; left out")
            found |= paths
        elif lost := [link for link in entry.links if link not in known]:
            lacks = f"the network has no link {', '.join(lost)}; left out"
            warnings.append(f"warning: corridor {entry.title}: {lacks}")
        else:
            found[entry.title] = list(entry.links)
    check_corridors(found, network)
    return found


def _zones(told: MeasureSection, network: Network, warnings: list[str]) -> Areas | None:
    if told.zones is None:
        return None
    from pipeline.polygons import PolygonFile, areas_in
    from uxsim_geo.analysis.areas import nodes_in_polygons

    file = PolygonFile("measure.zones", told.zones, told.zone_name)
    filled, empty = areas_in(network, file, nodes_in_polygons, "node")
    if empty:
        warnings.append(f"warning: measure.zones: no node lies in {', '.join(empty)}")
    return filled

"""Tables of a finished run as files: what analysts take on to other programs."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pipeline.runs import Manifest, RunFolder, StageRecord, is_unchanged
from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.files import replace_when_complete

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.config import Config
    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result

#: in a run's folder: where tables go unless told otherwise, and the only place for them there
FOLDER = "tables"


@dataclass(frozen=True)
class Order:
    """What somebody asks for.

    run
        folder of a run
    table
        a name in :data:`TABLES`
    out
        file to write; None: by the table's name, in the run's folder
    format
        a name in :data:`FORMATS`; None: that of ``out``, or CSV
    bin_s
        length of the time bins, s; None: as the table has them unasked
    """

    run: Path
    table: str
    out: Path | None = None
    format: str | None = None
    bin_s: float | None = None


class Written(NamedTuple):
    """The file that was made, and how large its table is."""

    path: Path
    rows: int
    columns: int


@dataclass(frozen=True)
class FinishedRun:
    """What tables are made of; ``bin_s_asked`` is None where nobody asked for bins."""

    config: Config
    network: Network
    result: Result
    bin_s_asked: float | None

    @property
    def bin_s(self) -> float:
        """Time bins of a table that cannot be without, s: as asked, else those of the report."""
        return self.config.report.bin_s if self.bin_s_asked is None else self.bin_s_asked


def export_table(order: Order) -> Written:
    """Make a table of a finished run and write it; the file appears when it is complete.

    Raises :class:`uxsim_geo.errors.InputError`, with all that is wrong with the order and the run:
    names that are not known, a place that is not for tables, no run, or one whose files are not
    those that its manifest vouches for.
    """
    folder = RunFolder(order.run)
    manifest = folder.read_manifest()
    faults = Faults()
    _check_table(order, faults)
    _check_place(order, manifest, faults)
    _check_run(folder, manifest, faults)
    faults.raise_if_any()
    form = order.format or (order.out.suffix.lower()[1:] if order.out else "csv")
    table = TABLES[order.table].make(_read_run(folder, manifest, order.bin_s))
    path = order.out or folder / FOLDER / f"{order.table}.{form}"
    try:
        if order.out is None:
            path.parent.mkdir(exist_ok=True)
        FORMATS[form](table, path)
    except (PermissionError, FileExistsError, NotADirectoryError) as error:
        what = f"cannot be written ({error.strerror}); choose another --out"
        raise InputError([Fault(what, str(path))]) from None
    return Written(path, *table.shape)


def _check_table(order: Order, faults: Faults) -> None:
    if order.table not in TABLES:
        near = difflib.get_close_matches(order.table, TABLES, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        what = f"--table: there is none of this name; {hint}There are {', '.join(TABLES)}"
        faults.add(what, value=order.table)
    elif order.bin_s is not None and not TABLES[order.table].has_bins:
        faults.add(f"--bin-s: {order.table} has no time bins; leave it out", value=order.bin_s)


def _check_place(order: Order, manifest: Manifest, faults: Faults) -> None:
    """See that a file is meant whose name tells its format, and none that a run lives on."""
    if order.out is None:
        return
    form, place, run = order.out.suffix.lower()[1:], order.out.resolve(), order.run.resolve()
    sources = (
        run / record.path for stage in manifest.stages.values() for record in stage.inputs.values()
    )
    if form not in FORMATS:
        endings = " or ".join(f".{name}" for name in FORMATS)
        faults.add(f"--out: must end in {endings}", value=order.out)
    elif order.format not in (None, form):
        faults.add(f"--out: must end in .{order.format}, as --format says", value=order.out)
    if place.is_dir():
        faults.add("--out: is a folder; name a file in it", value=order.out)
    elif not place.parent.is_dir():
        faults.add("--out: there is no such folder; make it first", value=order.out.parent)
    if place.is_relative_to(run) and not place.is_relative_to(run / FOLDER):
        faults.add(f"--out: in a run's folder only {FOLDER}/ is for tables", value=order.out)
    elif place in {source.resolve() for source in sources}:
        faults.add("--out: the run was made from this file; name another", value=order.out)


def _check_run(folder: RunFolder, manifest: Manifest, faults: Faults) -> None:
    """See that the run has been simulated, and that tables come from just those files."""
    own = Faults(str(folder.path))
    stages = manifest.stages
    if not stages:
        own.add("is no run: it holds no readable manifest.json; name one, as runs/sioux_falls")
    elif not {"ingest", "simulate"} <= stages.keys():
        own.add("has not been simulated: uxsim-geo simulate with its configuration does that")
    else:
        for problem in (*stages["ingest"].problems, *stages["simulate"].problems):
            own.add(problem)
        _check_files(folder, stages, own)
    faults.extend(own)


def _check_files(folder: RunFolder, stages: dict[str, StageRecord], faults: Faults) -> None:
    """Compare the tables of ingestion, as the simulation read them, and what it wrote."""
    from pipeline.simulate import tables_of

    records = stages["ingest"].outputs | stages["simulate"].outputs
    read = stages["simulate"].inputs.values()
    records |= {record.path: record for record in read if record.path in records}
    for name in sorted({*records, *tables_of(folder)}):
        if name not in records or not is_unchanged(records[name], folder / name):
            wrong = "is not what the run wrote" if (folder / name).exists() else "is missing"
            faults.add(f"{name} {wrong}; run it again")


def _read_run(folder: RunFolder, manifest: Manifest, bin_s: float | None) -> FinishedRun:
    from pydantic import ValidationError

    from pipeline import ingest, simulate
    from pipeline.config import Config
    from pipeline.progress import Silence
    from pipeline.stages import Task
    from uxsim_geo.network.files import read_network

    try:
        # not from config.yaml, whose source files may be elsewhere by now
        config = Config.model_validate(manifest.run["config"])
    except (KeyError, ValidationError):
        what = "was made by another version of uxsim-geo, or its manifest is damaged; run it again"
        raise InputError([Fault(what, str(folder.path))]) from None
    figures = {name: stage.figures for name, stage in manifest.stages.items()}
    task = Task(config, folder, figures, Silence(), lambda: None)
    network = read_network(folder / ingest.NETWORK)
    return FinishedRun(config, network, simulate.read_result(task), bin_s)


def _od(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.od import od_table

    return od_table(run.result, run.network, bin_s=run.bin_s_asked)


def _trips(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.trips import trip_summary

    return trip_summary(run.result, run.network)


def _trip_routes(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.trips import trip_routes

    return trip_routes(run.result)


def _turning_counts(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.turns import turning_counts

    return turning_counts(run.result, run.network, bin_s=run.bin_s_asked)


def _link_times(run: FinishedRun) -> pd.DataFrame:
    """As the layer of that name, with times in seconds after the start."""
    from uxsim_geo.export.layers import link_times_layer

    states = _states(run)
    table = link_times_layer(run.network, states, run.config.report.start)
    table.insert(1, "begin_s", states["begin_s"])
    table.insert(2, "end_s", states["end_s"])
    return table.drop(columns=["begin", "end"])


def _vehicles_over_time(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.bins import bin_edges
    from uxsim_geo.analysis.vehicles_over_time import vehicles_over_time

    return vehicles_over_time(run.result, bin_edges(run.result.settings.duration, run.bin_s))


def _skims(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.skims import skims

    return skims(run.result, run.network, bin_s=run.bin_s, states=_states(run))


def _cumulative(run: FinishedRun) -> pd.DataFrame:
    """The curves of all links, one link after the other, at the edges of the bins."""
    import numpy as np
    import pandas as pd

    from uxsim_geo.analysis.bins import bin_edges
    from uxsim_geo.analysis.cumulative import curves_of_passages
    from uxsim_geo.analysis.passages import Passages

    _check_bins(run)
    passages, links = Passages.of(run.result, run.network), len(run.network.links)
    duration = run.result.settings.duration
    edges = bin_edges(duration, run.bin_s)
    curves = [curves_of_passages(passages, link, edges) for link in range(links)]
    table = pd.concat(curves, ignore_index=True)
    ids = run.network.links["link_id"].astype(str).to_numpy()
    table.insert(0, "link_id", np.repeat(ids, len(edges)))
    return table


def _states(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.link_states import link_times

    _check_bins(run)
    return link_times(run.result, run.network, bin_s=run.bin_s)


def _check_bins(run: FinishedRun) -> None:
    """Refuse a table of all links in all bins that would have too many rows."""
    from pipeline.report import MOST_STATES

    links = len(run.network.links)
    shortest = run.result.settings.duration * links / MOST_STATES
    if run.bin_s < shortest:
        what = f"--bin-s: too short for {links:,} links; take {math.ceil(shortest)} s or more"
        raise InputError([Fault(what, value=run.bin_s)])


class Table(NamedTuple):
    """The function that makes a table of a run, and whether it may have time bins."""

    make: Callable[[FinishedRun], pd.DataFrame]
    has_bins: bool


#: by the name that a user gives
TABLES = {
    "od": Table(_od, has_bins=True),
    "trips": Table(_trips, has_bins=False),
    "trip_routes": Table(_trip_routes, has_bins=False),
    "turning_counts": Table(_turning_counts, has_bins=True),
    "link_times": Table(_link_times, has_bins=True),
    "vehicles_over_time": Table(_vehicles_over_time, has_bins=True),
    "skims": Table(_skims, has_bins=True),
    "cumulative": Table(_cumulative, has_bins=True),
}


def _write_csv(table: pd.DataFrame, path: Path) -> None:
    with replace_when_complete(path) as temporary:
        table.to_csv(
            temporary,
            index=False,
            encoding="utf-8",
            lineterminator="\n",
            float_format=plain_decimal,
        )


def _write_parquet(table: pd.DataFrame, path: Path) -> None:
    from uxsim_geo.parquet import write_table

    write_table(table, path)


#: by the ending of the file
FORMATS: dict[str, Callable[[pd.DataFrame, Path], None]] = {
    "csv": _write_csv,
    "parquet": _write_parquet,
}


def plain_decimal(number: object) -> str:
    """The shortest decimal that reads back as the same floating number, without an exponent."""
    text = str(number)
    return f"{Decimal(text):f}" if "e" in text else text

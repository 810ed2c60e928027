"""Tables of a finished run as files: what analysts take on to other programs."""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from pipeline.finished import check_run, read_run
from pipeline.runs import Manifest, RunFolder
from pipeline.table_formats import FORMATS
from pipeline.table_makers import TABLES, FinishedRun
from pipeline.table_options import FLAGS, TableOptions
from uxsim_geo.errors import Fault, Faults, InputError

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
    options
        what the table is to be about
    """

    run: Path
    table: str
    out: Path | None = None
    format: str | None = None
    options: TableOptions = field(default_factory=TableOptions)


class Written(NamedTuple):
    """The file that was made, how large its table is, and what to know of it."""

    path: Path
    rows: int
    columns: int
    notes: tuple[str, ...]


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
    check_run(folder, manifest, faults)
    faults.raise_if_any()
    form = order.format or (order.out.suffix.lower()[1:] if order.out else "csv")
    run = FinishedRun(read_run(folder, manifest), order.options)
    table = TABLES[order.table].make(run)
    path = order.out or folder / FOLDER / f"{order.table}.{form}"
    try:
        if order.out is None:
            path.parent.mkdir(exist_ok=True)
        FORMATS[form](table, path)
    except (PermissionError, FileExistsError, NotADirectoryError) as error:
        what = f"cannot be written ({error.strerror}); choose another --out"
        raise InputError([Fault(what, str(path))]) from None
    return Written(path, *table.shape, tuple(run.notes))


def _check_table(order: Order, faults: Faults) -> None:
    if order.table not in TABLES:
        near = difflib.get_close_matches(order.table, TABLES, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        what = f"--table: there is none of this name; {hint}There are {', '.join(TABLES)}"
        faults.add(what, value=order.table)
        return
    table, given = TABLES[order.table], order.options.given()
    for name in (name for name in given if name not in table.takes):
        what = f"{FLAGS[name]}: {order.table} does not go by it; leave it out"
        faults.add(what, value=order.options.as_written(name))
    for name in (name for name in table.needs if name not in given):
        faults.add(f"{FLAGS[name]}: {order.table} needs it")


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

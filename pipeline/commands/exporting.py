"""``export``: a table of a finished run as a file."""

from __future__ import annotations

import argparse
import sys
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands.arguments import above_0, names
from pipeline.commands.status import DONE
from pipeline.lines import show
from pipeline.table_formats import FORMATS
from pipeline.table_makers import TABLES
from pipeline.table_options import TableOptions

if TYPE_CHECKING:
    from pipeline.commands.arguments import Commands


def add_commands(commands: Commands) -> None:
    """Add the command that exports."""
    text = "write a table of a finished run to a file"
    command = commands.add_parser("export", help=text, description=text)
    command.set_defaults(command=_export)
    _add_options(command)


def _add_options(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("path", type=Path, metavar="RUN", help="folder of a run")
    add("--table", required=True, metavar="NAME", help=f"one of {', '.join(TABLES)}")
    add("--format", choices=FORMATS, help="default: as the file is named, or csv")
    add("--out", type=Path, metavar="FILE", help="default: RUN/tables/NAME.csv")
    text = "length of the time bins, s; default: report.bin_s of the run, and for od and "
    add("--bin-s", type=above_0, metavar="N", help=f"{text}turning_counts the whole run in one")
    add("--step-s", type=above_0, metavar="N", help="between moments of trajectories, s; 10")
    add("--cell-m", type=above_0, metavar="N", help="longest part of a link in cells, m; 100")
    add("--links", type=names, metavar="A,B", help="link_ids that a table is about")
    add("--zones", type=names, metavar="A,B", help="zones that a table is about")
    text = "polygons with a column name, GeoPackage or GeoJSON"
    add("--areas", type=Path, metavar="FILE", help=text)
    text = "counts or travel times to compare with, CSV (docs/results.md)"
    add("--observed", type=Path, metavar="FILE", help=text)


def _export(options: argparse.Namespace) -> int:
    from pipeline.tables import Order, export_table

    asked = TableOptions(**{key.name: getattr(options, key.name) for key in fields(TableOptions)})
    order = Order(options.path, options.table, options.out, options.format, asked)
    written = export_table(order)
    for note in written.notes:
        show(f"note: {note}", sys.stderr)
    show(f"{written.path}: {written.rows:,} rows, {written.columns} columns", sys.stdout)
    return DONE

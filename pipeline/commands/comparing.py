"""``compare``: what differs between two finished runs."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands.arguments import above_0
from pipeline.commands.status import DONE, FAILED
from pipeline.lines import show

if TYPE_CHECKING:
    from pipeline.commands.arguments import Commands


def add_commands(commands: Commands) -> None:
    """Add the command that compares."""
    text = "compare two finished runs: what they were told, and what came of it"
    command = commands.add_parser("compare", help=text, description=text)
    command.set_defaults(command=_compare)
    add = command.add_argument
    add("a", type=Path, metavar="RUN_A", help="folder of the run that is compared with")
    add("b", type=Path, metavar="RUN_B", help="folder of the run whose differences are told")
    text = "folder to write; default: beside RUN_A, as B_against_A"
    add("--out", type=Path, metavar="DIR", help=text)
    text = "length of the time bins, s; default: measure.bin_s of RUN_A"
    add("--bin-s", type=above_0, metavar="N", help=text)
    text = "tables and sentences alone, without layers, page and pictures"
    add("--tables-alone", action="store_true", help=text)


def _compare(options: argparse.Namespace) -> int:
    from pipeline.compare import compare_runs, place_of, write_compared_runs
    from pipeline.comparison_files import sentences

    place = place_of(options.a, options.b, options.out)
    compared = compare_runs(options.a, options.b, options.bin_s)
    problems = write_compared_runs(compared, place, tables_alone=options.tables_alone)
    for warning in compared.warnings:
        show(warning, sys.stderr)
    for difference in compared.differences:
        show(str(difference), sys.stdout)
    if not compared.differences:
        show("Both runs were told the same.", sys.stdout)
    show(f"\n{sentences(compared.comparison)}\n\n{place}", sys.stdout)
    for problem in problems:
        show(f"error: {problem}", sys.stderr)
    return FAILED if problems else DONE

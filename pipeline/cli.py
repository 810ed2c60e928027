"""The command line: ``uxsim-geo``."""

from __future__ import annotations

import argparse
import csv
import math
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.lines import show
from pipeline.table_formats import FORMATS
from pipeline.table_makers import TABLES
from pipeline.table_options import TableOptions
from pipeline.tables import Order, export_table
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.version import __version__

if TYPE_CHECKING:
    from pipeline.runs import RunFolder

DONE = 0
FAILED = 1
INPUT_AT_FAULT = 2

#: where run folders go
OUT = Path("runs")

STAGE_COMMANDS = {
    "run": "ingest, simulate and report; what has not changed is not done again",
    "ingest": "read the source files into the tables of a run",
    "simulate": "simulate, after ingesting if that is out of date",
    "report": "figures, layers and pictures, after whatever is out of date",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; return the exit status: 0 done, 2 input at fault, 1 anything else."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    options = _parser().parse_args(given)
    options.arguments, options.folder = given, None
    try:
        status: int = options.command(options)
        return status
    except InputError as error:
        for fault in error.faults:
            show(f"error: {fault}", sys.stderr)
        _log_faults(error, options.folder)
        return INPUT_AT_FAULT
    except KeyboardInterrupt:
        show("error: interrupted; what was finished before stays", sys.stderr)
        return FAILED
    except Exception as error:  # noqa: BLE001  the last place where it can be told
        _report_failure(error, options.folder)
        return FAILED


def _log_faults(error: InputError, folder: RunFolder | None) -> None:
    """Note the faults in the log of a run that is there; faulty input makes no folder."""
    # they have been shown: a log that cannot be written adds nothing to them
    with suppress(OSError, InputError):
        if folder is not None and folder.path.is_dir():
            folder.log("\n".join(f"error: {fault}" for fault in error.faults))


def _report_failure(error: Exception, folder: RunFolder | None) -> None:
    """Say in a line what went wrong; how it came to that goes to the run's log, if there is one."""
    what = f"error: {type(error).__name__}: {error}"
    if folder is not None:
        from pipeline.runs import LOG

        try:
            folder.log("".join(traceback.format_exception(error)))
            what = f"{what}; details in {folder / LOG}"
        except (OSError, InputError) as failure:
            what = f"{what}; no details, since there is no log: {failure}"
    show(what, sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="uxsim-geo", description="Dynamic traffic simulation from network files to maps."
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name, text in STAGE_COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(command=_run, last="report" if name == "run" else name)
        _add_run_options(command, repeats=name == "run")
    text = "show what is in a run, a network, a results file or a table"
    command = commands.add_parser("inspect", help=text, description=text)
    command.set_defaults(command=_inspect)
    command.add_argument("path", type=Path, metavar="PATH")
    text = "check the files of a run against its manifest"
    command = commands.add_parser("verify", help=text, description=text)
    command.set_defaults(command=_verify)
    command.add_argument("path", type=Path, metavar="RUN", help="folder of a run")
    text = "write a table of a finished run to a file"
    command = commands.add_parser("export", help=text, description=text)
    command.set_defaults(command=_export)
    _add_export_options(command)
    text = "download open data by name into the cache, and show a configuration that uses them"
    command = commands.add_parser("fetch", help=text, description=text)
    command.set_defaults(command=_fetch)
    command.add_argument("name", nargs="?", metavar="NAME", help="as SiouxFalls; none: list all")
    command.add_argument("--list", action="store_true", help="list all that is known by name")
    return parser


def _add_run_options(command: argparse.ArgumentParser, *, repeats: bool) -> None:
    add = command.add_argument
    text = "configuration, a YAML file"
    if repeats:
        text += "; or manifest.json of a run: it is repeated, and the files are compared"
    add("config", type=Path, metavar="CONFIG", help=text)
    add("--out", type=_folder, metavar="DIR", help=f"default: {OUT}")
    add(
        "--set",
        action="append",
        default=[],
        metavar="KEY.SUB=VALUE",
        help="in place of what the configuration says; may be given several times",
    )
    add("--seed", metavar="N", help="short for --set simulate.seed=N")
    add("--force", action="store_true", help="also repeat stages that are up to date")
    add("--quiet", action="store_true", help="show neither progress nor results")


def _add_export_options(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("path", type=Path, metavar="RUN", help="folder of a run")
    add("--table", required=True, metavar="NAME", help=f"one of {', '.join(TABLES)}")
    add("--format", choices=FORMATS, help="default: as the file is named, or csv")
    add("--out", type=Path, metavar="FILE", help="default: RUN/tables/NAME.csv")
    text = "length of the time bins, s; default: report.bin_s of the run, and for od and "
    add("--bin-s", type=_above_0, metavar="N", help=f"{text}turning_counts the whole run in one")
    add("--step-s", type=_above_0, metavar="N", help="between moments of trajectories, s; 10")
    add("--cell-m", type=_above_0, metavar="N", help="longest part of a link in cells, m; 100")
    add("--links", type=_names, metavar="A,B", help="link_ids that a table is about")
    add("--zones", type=_names, metavar="A,B", help="zones that a table is about")
    text = "polygons with a column name, GeoPackage or GeoJSON"
    add("--areas", type=Path, metavar="FILE", help=text)
    text = "counts or travel times to compare with, CSV (docs/results.md)"
    add("--observed", type=Path, metavar="FILE", help=text)


def _above_0(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"must be a finite number above 0 (found {text!r})")
    return number


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in next(csv.reader([text]), []))
    if not names or "" in names:
        what = "names nothing between commas; write A,B, and a name with a comma in quotes"
        raise argparse.ArgumentTypeError(f"{what} (found {text!r})")
    return names


def _folder(text: str) -> Path:
    if not text.strip():
        raise argparse.ArgumentTypeError("is empty; name a folder, as runs, or . for this one")
    return Path(text)


def _repeat(options: argparse.Namespace) -> int:
    from pipeline import ingest, report, simulate
    from pipeline.progress import watching
    from pipeline.repeating import Repeat, repeat_run

    if options.set or options.seed is not None:
        what = "a manifest is repeated as it is; to change something, run its config.yaml"
        raise InputError([Fault(what, str(options.config))])
    with watching(quiet=options.quiet) as watch:
        stages = (ingest.STAGE, simulate.STAGE, report.STAGE)
        found = repeat_run(Repeat(options.config, options.out, watch, stages))
    for remark in found.remarks:
        show(f"note: {remark}", sys.stdout)
    for line in found.different:
        show(f"different: {line}", sys.stderr)
    files = f"{len(found.same)} of {len(found.same) + len(found.different)} files"
    verdict = "the same result" if not found.different else "another result"
    show(f"{found.folder.path}: {verdict}; {files} are equal", sys.stdout)
    return FAILED if found.different else DONE


def _run(options: argparse.Namespace) -> int:
    if options.config.suffix == ".json" and options.last == "report":
        return _repeat(options)
    from pipeline import ingest, report, simulate
    from pipeline.config_file import load_config
    from pipeline.progress import watching
    from pipeline.results import show_results
    from pipeline.runs import RunFolder
    from pipeline.stages import Run

    seed = [] if options.seed is None else [f"simulate.seed={options.seed}"]
    config = load_config(options.config, [*options.set, *seed])
    folder = RunFolder((options.out or OUT) / config.name)
    stages = (ingest.STAGE, simulate.STAGE, report.STAGE)
    options.folder = folder
    with watching(quiet=options.quiet) as watch:
        run = Run(config, folder, watch, ["uxsim-geo", *options.arguments], stages)
        problems = run.execute(options.last, force=options.force)
    for problem in problems:
        show(f"error: {problem}", sys.stderr)
    if not options.quiet:
        show_results(folder)
    return FAILED if problems else DONE


def _inspect(options: argparse.Namespace) -> int:
    from pipeline.inspection import inspect_path

    show(inspect_path(options.path), sys.stdout)
    return DONE


def _verify(options: argparse.Namespace) -> int:
    from pipeline.verification import verify_run

    found = verify_run(options.path)
    for remark in found.remarks:
        show(f"note: {remark}", sys.stdout)
    for line in found.wrong:
        show(f"error: {line}", sys.stderr)
    if found.wrong:
        return FAILED
    show(f"{options.path}: all {found.checked} files are what the run wrote", sys.stdout)
    return DONE


def _export(options: argparse.Namespace) -> int:
    asked = TableOptions(**{key.name: getattr(options, key.name) for key in fields(TableOptions)})
    order = Order(options.path, options.table, options.out, options.format, asked)
    written = export_table(order)
    for note in written.notes:
        show(f"note: {note}", sys.stderr)
    show(f"{written.path}: {written.rows:,} rows, {written.columns} columns", sys.stdout)
    return DONE


def _fetch(options: argparse.Namespace) -> int:
    from pipeline.open_data import fetch_data, known_data

    if options.list or options.name is None:
        show(known_data(), sys.stdout)
        return DONE
    show(fetch_data(options.name, lambda line: show(line, sys.stderr)), sys.stdout)
    return DONE

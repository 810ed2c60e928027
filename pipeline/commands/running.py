"""``run`` and its parts: ``ingest``, ``simulate``, ``report``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands.arguments import add_changed_values, add_folder_of_results
from pipeline.commands.status import DONE, FAILED
from pipeline.lines import show

if TYPE_CHECKING:
    from pipeline.commands.arguments import Commands

STAGE_COMMANDS = {
    "run": "ingest, simulate and report; what has not changed is not done again",
    "ingest": "read the source files into the tables of a run",
    "simulate": "simulate, after ingesting if that is out of date",
    "report": "figures, layers and pictures, after whatever is out of date",
}


def add_commands(commands: Commands) -> None:
    """Add the commands that run stages."""
    for name, text in STAGE_COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(command=_run, last="report" if name == "run" else name)
        _add_options(command)


def _add_options(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("config", type=Path, metavar="CONFIG", help="configuration, a YAML file")
    add_folder_of_results(command)
    add_changed_values(command)
    add("--seed", metavar="N", help="short for --set simulate.seed=N")
    add("--force", action="store_true", help="also repeat stages that are up to date")
    add("--quiet", action="store_true", help="show neither progress nor results")


def _run(options: argparse.Namespace) -> int:
    from pipeline import ingest, report, simulate
    from pipeline.config_file import load_config
    from pipeline.progress import watching
    from pipeline.results import show_results
    from pipeline.runs import RunFolder
    from pipeline.stages import Run

    seed = [] if options.seed is None else [f"simulate.seed={options.seed}"]
    config = load_config(options.config, [*options.set, *seed])
    folder = RunFolder(options.out / config.name)
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

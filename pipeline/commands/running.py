"""``run`` and its parts: ``ingest``, ``simulate``, ``report``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands.arguments import RESULTS, add_changed_values, add_folder_of_results
from pipeline.commands.status import DONE, FAILED
from pipeline.lines import show
from uxsim_geo.errors import Fault, InputError

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
        _add_options(command, repeats=name == "run")


def _add_options(command: argparse.ArgumentParser, *, repeats: bool) -> None:
    add = command.add_argument
    text = "configuration, a YAML file"
    if repeats:
        text += "; or manifest.json of a run or study: it is repeated, and the files are compared"
    add("config", type=Path, metavar="CONFIG", help=text)
    add_folder_of_results(command, default=None)
    add_changed_values(command)
    add("--seed", metavar="N", help="short for --set simulate.seed=N")
    add("--force", action="store_true", help="also repeat stages that are up to date")
    add("--quiet", action="store_true", help="show neither progress nor results")


def _repeat(options: argparse.Namespace) -> int:
    from pipeline import ingest, report, simulate
    from pipeline.progress import watching
    from pipeline.repeating import Repeat, repeat_run
    from pipeline.study_folder import is_study
    from pipeline.study_repeating import repeat_study

    if options.set or options.seed is not None:
        what = "a manifest is repeated as it is; to change something, run its config.yaml"
        raise InputError([Fault(what, str(options.config))])
    with watching(quiet=options.quiet) as watch:
        if is_study(options.config.parent):
            found = repeat_study(Repeat(options.config, options.out, watch))
        else:
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
    from pipeline.execution import Run
    from pipeline.progress import watching
    from pipeline.results import show_results
    from pipeline.runs import RunFolder

    seed = [] if options.seed is None else [f"simulate.seed={options.seed}"]
    config = load_config(options.config, [*options.set, *seed])
    folder = RunFolder((options.out or RESULTS) / config.name)
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

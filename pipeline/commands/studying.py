"""``study``: scenarios of a base, with the same seeds; and ``clean``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands.arguments import add_changed_values, add_folder_of_results, whole_above_0
from pipeline.commands.status import DONE, FAILED
from pipeline.lines import show

if TYPE_CHECKING:
    from pipeline.commands.arguments import Commands


def add_commands(commands: Commands) -> None:
    """Add the commands for studies."""
    text = "run the scenarios of a study; what has been done is not done again"
    command = commands.add_parser("study", help=text, description=text)
    command.set_defaults(command=_study)
    _add_study_options(command)
    text = "show, or remove, what studies have left behind and none refers to"
    command = commands.add_parser("clean", help=text, description=text)
    command.set_defaults(command=_clean)
    add_folder_of_results(command)
    command.add_argument("--remove", action="store_true", help="remove it; default: show it")


def _add_study_options(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("study", type=Path, metavar="STUDY", help="study, a YAML file")
    add_folder_of_results(command)
    add_changed_values(command)
    text = "so many seeds, in place of what the study says"
    add("--seeds", type=whole_above_0, metavar="N", help=text)
    add("--force", action="store_true", help="also repeat what is up to date or in the store")
    text = "processes, none, dask, or the address of a Dask scheduler; default: as the study says"
    add("--dry-run", action="store_true", help="only show what each scenario changes")
    add("--scheduler", metavar="NAME", help=text)
    add("--workers", type=whole_above_0, metavar="N", help="processes on this machine")
    add("--quiet", action="store_true", help="show nothing but failures")


def _study(options: argparse.Namespace) -> int:
    from pipeline.progress import watching
    from pipeline.study import Order, dry_run, run_study

    command = ["uxsim-geo", *options.arguments]
    order = Order(
        path=options.study,
        out=options.out,
        command=command,
        scheduler=options.scheduler,
        workers=options.workers,
        seeds=options.seeds,
        edits=options.set,
        force=options.force,
    )
    with watching(quiet=options.quiet) as watch:
        if options.dry_run:
            text, path = dry_run(order, watch)
            show(f"{text}\n\n{path}", sys.stdout)
            return DONE
        problems = run_study(order, watch)
    for problem in problems:
        show(f"error: {problem}", sys.stderr)
    return FAILED if problems else DONE


def _clean(options: argparse.Namespace) -> int:
    from pipeline.cleaning import find_left_over, remove
    from pipeline.results import size_in_words

    found = find_left_over(options.out)
    if options.remove:
        found = [one for one in found if remove(one)]
    for one in found:
        show(f"{one.path}  {size_in_words(one.size)}  {one.why}", sys.stdout)
    total = size_in_words(sum(one.size for one in found))
    done = "removed" if options.remove else "would be removed by --remove"
    show(f"{len(found):,} left over, {total}: {done}" if found else "nothing left over", sys.stdout)
    return DONE

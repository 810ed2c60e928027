"""``inspect`` and ``verify``: what is in a run, and whether it is what was written."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands.status import DONE, FAILED
from pipeline.lines import show

if TYPE_CHECKING:
    from pipeline.commands.arguments import Commands


def add_commands(commands: Commands) -> None:
    """Add the commands that look at what there is."""
    text = "show what is in a run, a study, a network, a results file or a table"
    command = commands.add_parser("inspect", help=text, description=text)
    command.set_defaults(command=_inspect)
    command.add_argument("path", type=Path, metavar="PATH")
    text = "check the files of a run, or of a study with all its runs, against the manifests"
    command = commands.add_parser("verify", help=text, description=text)
    command.set_defaults(command=_verify)
    command.add_argument("path", type=Path, metavar="RUN", help="folder of a run or study")


def _inspect(options: argparse.Namespace) -> int:
    from pipeline.inspection import inspect_path

    show(inspect_path(options.path), sys.stdout)
    return DONE


def _verify(options: argparse.Namespace) -> int:
    from pipeline.study_folder import is_study
    from pipeline.study_verification import verify_study
    from pipeline.verification import verify_run

    found = verify_study(options.path) if is_study(options.path) else verify_run(options.path)
    for remark in found.remarks:
        show(f"note: {remark}", sys.stdout)
    for line in found.wrong:
        show(f"error: {line}", sys.stderr)
    if found.wrong:
        return FAILED
    show(f"{options.path}: all {found.checked} files are as they were written", sys.stdout)
    return DONE

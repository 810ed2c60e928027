"""``examples``: configurations to start from, with their data."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands.status import DONE
from pipeline.lines import show

if TYPE_CHECKING:
    from pipeline.commands.arguments import Commands

#: where they are copied, unless another folder is named
PLACE = Path("uxsim-geo-examples")


def add_commands(commands: Commands) -> None:
    """Add the command that copies the examples."""
    text = "copy the examples, configurations with their data, to run and to change"
    command = commands.add_parser("examples", help=text, description=text)
    command.set_defaults(command=_examples)
    command.add_argument(
        "place", nargs="?", type=Path, default=PLACE, metavar="DIR", help=f"default: {PLACE}"
    )


def _examples(options: argparse.Namespace) -> int:
    from pipeline.examples import copy_examples

    for path in copy_examples(options.place):
        what = "study" if path.name.startswith("study_") else "run"
        show(f"uxsim-geo {what} {path}", sys.stdout)
    return DONE

"""``fetch``: open data by name."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from pipeline.commands.status import DONE
from pipeline.lines import show

if TYPE_CHECKING:
    from pipeline.commands.arguments import Commands


def add_commands(commands: Commands) -> None:
    """Add the command that downloads."""
    text = "download open data by name into the cache, and show a configuration that uses them"
    command = commands.add_parser("fetch", help=text, description=text)
    command.set_defaults(command=_fetch)
    command.add_argument("name", nargs="?", metavar="NAME", help="as SiouxFalls; none: list all")
    command.add_argument("--list", action="store_true", help="list all that is known by name")


def _fetch(options: argparse.Namespace) -> int:
    from pipeline.open_data import fetch_data, known_data

    if options.list or options.name is None:
        show(known_data(), sys.stdout)
        return DONE
    show(fetch_data(options.name, lambda line: show(line, sys.stderr)), sys.stdout)
    return DONE

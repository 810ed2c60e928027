"""What several commands are told, and how it is read from the command line."""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    #: to which a module adds its commands
    Commands: TypeAlias = argparse._SubParsersAction[argparse.ArgumentParser]


#: below which the folders of runs and studies lie, unless another is named
RESULTS = Path("runs")


def add_folder_of_results(
    command: argparse.ArgumentParser, *, default: Path | None = RESULTS
) -> None:
    """Add ``--out``; ``default`` None leaves it open, for a command that then has its own."""
    text = f"default: {RESULTS}"
    command.add_argument("--out", type=_folder, default=default, metavar="DIR", help=text)


def add_changed_values(command: argparse.ArgumentParser) -> None:
    """Add ``--set``."""
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY.SUB=VALUE",
        help="in place of what the configuration says; may be given several times",
    )


def above_0(text: str) -> float:
    """Read a finite number above 0."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"must be a finite number above 0 (found {text!r})")
    return number


def whole_above_0(text: str) -> int:
    """Read a whole number above 0."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"must be a whole number above 0 (found {text!r})")
    return int(text)


def names(text: str) -> tuple[str, ...]:
    """Read names with commas between them, one with a comma in quotes."""
    found = tuple(name.strip() for name in next(csv.reader([text]), []))
    if not found or "" in found:
        what = "names nothing between commas; write A,B, and a name with a comma in quotes"
        raise argparse.ArgumentTypeError(f"{what} (found {text!r})")
    return found


def _folder(text: str) -> Path:
    if not text.strip():
        raise argparse.ArgumentTypeError("is empty; name a folder, as runs, or . for this one")
    return Path(text)

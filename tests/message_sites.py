"""Where in the program a user's errors come from, and which of these places have been reached."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from conftest import REPOSITORY

from uxsim_geo.errors import Fault, Faults

PACKAGES = (REPOSITORY / "uxsim_geo", REPOSITORY / "pipeline")

#: a line of a file of the program
Line = tuple[str, int]

#: functions that note faults of rows, which are told what is wrong
_ADDERS = ("add_rows", "add_of_rows", "add_cell_faults", "add_value_faults", "damage_as_fault")

#: what objects are called on which ``add`` notes a fault
_HOLDERS = ("fault", "own", "told")


def sites() -> dict[Line, range]:
    """Every call that words a user's error, by file and first line, with all lines it covers."""
    found = {}
    for package in PACKAGES:
        for path in sorted(package.rglob("*.py")):
            name = path.relative_to(REPOSITORY).as_posix()
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and _words(node.func):
                    last = node.end_lineno or node.lineno
                    found[name, node.lineno] = range(node.lineno, last + 1)
    return found


def _words(function: ast.expr) -> bool:
    if isinstance(function, ast.Name):
        return function.id == "Fault" or function.id in _ADDERS
    if isinstance(function, ast.Attribute) and function.attr == "add":
        holder = ast.unparse(function.value).lower()
        return any(word in holder for word in _HOLDERS)
    return False


@contextmanager
def recording() -> Iterator[set[Line]]:
    """Collect the lines of the program that run whenever a fault is noted."""
    reached: set[Line] = set()
    add, make = Faults.add, Fault.__init__

    def note() -> None:
        frame: Any = sys._getframe(2)
        while frame is not None:
            path = Path(frame.f_code.co_filename)
            if path.is_relative_to(PACKAGES[0]) or path.is_relative_to(PACKAGES[1]):
                reached.add((path.relative_to(REPOSITORY).as_posix(), frame.f_lineno))
            frame = frame.f_back

    def noted_add(*arguments: Any, **others: Any) -> None:
        note()
        add(*arguments, **others)

    def noted_make(*arguments: Any, **others: Any) -> None:
        note()
        make(*arguments, **others)

    with patch.object(Faults, "add", noted_add), patch.object(Fault, "__init__", noted_make):
        yield reached


def reached_sites(reached: set[Line]) -> set[Line]:
    """The places of :func:`sites` that some lines belong to."""
    by_file: dict[str, set[int]] = {}
    for name, line in reached:
        by_file.setdefault(name, set()).add(line)
    return {
        site for site, lines in sites().items() if by_file.get(site[0], set()).intersection(lines)
    }

"""Cases: one file, or several in one text with a line ``=== NAME`` before each."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

_NAME = re.compile(rb"^=== (\S+)\r?\n", re.MULTILINE)


def parts_of(data: bytes, names: Iterable[str], main: str) -> dict[str, bytes]:
    """The files of a case by their names; what stands before the first name is the file ``main``.

    Other names than ``names`` are none: such a line is content.
    """
    known = {name.encode() for name in names}
    marks = [mark for mark in _NAME.finditer(data) if mark[1] in known]
    if not marks:
        return {main: data}
    found = {} if marks[0].start() == 0 else {main: data[: marks[0].start()]}
    ends = [mark.start() for mark in marks[1:]] + [len(data)]
    for mark, end in zip(marks, ends, strict=True):
        found[mark[1].decode()] = data[mark.end() : end]
    return found


def write_parts(folder: Path, parts: dict[str, bytes]) -> None:
    """Write the files of a case."""
    for name, content in parts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)

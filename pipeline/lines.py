"""Lines for the user, for as long as there is one who reads them."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TextIO

#: control characters, by which a terminal is made to do things, and marks that turn letters round
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def readable(text: str) -> str:
    """Return text whose control characters, which names in a file may hold, are written out."""
    return _CONTROLS.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def show(text: str, stream: TextIO) -> None:
    """Write a line at once; where the reader has closed the pipe, this and all later ones go.

    A run whose lines nobody reads any more, as in ``run ... | head -1``, still makes its files.
    """
    try:
        print(readable(text), file=stream, flush=True)
    except BrokenPipeError:
        # what is left in the buffer would fail once more when the interpreter ends
        with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
            os.dup2(nowhere.fileno(), stream.fileno())

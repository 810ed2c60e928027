"""Lines for the user, for as long as there is one who reads them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TextIO


def show(text: str, stream: TextIO) -> None:
    """Write a line at once; where the reader has closed the pipe, this and all later ones go.

    A run whose lines nobody reads any more, as in ``run ... | head -1``, still makes its files.
    """
    try:
        print(text, file=stream, flush=True)
    except BrokenPipeError:
        # what is left in the buffer would fail once more when the interpreter ends
        with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
            os.dup2(nowhere.fileno(), stream.fileno())

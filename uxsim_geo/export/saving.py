"""Figures as files: the ending of the name chooses the format, and equal figures equal bytes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 150  # of PNG files, and of what SVG and PDF hold as pixels

#: by ending: metadata that matplotlib writes unless told not to, which differ from day to day
METADATA: dict[str, dict[str, None]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": None},
    ".pdf": {"CreationDate": None, "ModDate": None, "Creator": None, "Producer": None},
}

#: SVG names its parts by hashes, salted with chance unless told otherwise
HASH_SALT = "uxsim-geo"


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG, SVG or PDF, by the ending of ``path``: no program name and no date.

    The file depends on nothing but the figure. Raises :class:`uxsim_geo.errors.InputError` for
    another ending.
    """
    ending = checked_ending(path, tuple(METADATA), "a figure")
    import matplotlib as mpl

    take_as_written(figure)
    salted = mpl.rc_context({"svg.hashsalt": HASH_SALT})
    with replace_when_complete(path) as temporary, salted:
        figure.savefig(temporary, format=ending[1:], dpi=DPI, metadata=METADATA[ending])


def take_as_written(figure: Figure) -> None:
    """Let all texts of a figure stand for themselves: names with two $ would be read as formulas.

    To be called when all texts but those of ticks are there, and none has been drawn.
    """
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_parse_math(False)


def checked_ending(path: Path, endings: tuple[str, ...], what: str) -> str:
    """Return the ending of a file's name, in small letters; raises InputError for another one."""
    ending = path.suffix.lower()
    if ending not in endings:
        known = f"{', '.join(endings[:-1])} or {endings[-1]}"
        raise InputError([Fault(f"{what} is saved as {known}: name it so", value=path.name)])
    return ending

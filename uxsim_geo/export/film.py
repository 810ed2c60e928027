"""Moving maps: what stands still is drawn once, and each picture goes to the file when it is drawn.

Memory does not grow with the number of pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from uxsim_geo.errors import Fault, InputError
from uxsim_geo.export.gif import Picture, write_gif
from uxsim_geo.export.map_sheet import MapSheet
from uxsim_geo.export.mp4 import ffmpeg, write_mp4
from uxsim_geo.export.saving import checked_ending, take_as_written
from uxsim_geo.files import replace_when_complete

if TYPE_CHECKING:
    from matplotlib.artist import Artist

ENDINGS = (".gif", ".mp4")
DPI = 100
MOST_PICTURES = 5_000  # over eight minutes of 100 ms each; of a city half an hour and more to draw

#: told which share of the pictures is done, 0 to 1
Progress = Callable[[float], None]


@dataclass(frozen=True)
class MovingMap:
    """A map of which some artists change from picture to picture, in the order of drawing.

    ``draw(k)`` sets the artists to picture k; pictures are asked for one after the other.
    """

    sheet: MapSheet
    artists: Sequence[Artist]
    draw: Callable[[int], None]
    pictures: int


def write_film(
    film: MovingMap, path: Path, frame_ms: float, progress: Progress | None = None
) -> None:
    """Write a GIF or MP4, by the ending of ``path``; a picture lasts ``frame_ms``.

    Raises what :func:`check_film` does.
    """
    check_film(path, frame_ms)
    shown = _drawn(film, progress)
    with replace_when_complete(path) as temporary:
        if path.suffix.lower() == ".mp4":
            write_mp4(temporary, shown, frame_ms)
            return
        with temporary.open("wb") as file:
            write_gif(file, shown, frame_ms)


def check_pictures(pictures: float, column: str, value: float | None) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` for more pictures than a film may have.

    ``column`` and ``value`` are what they follow from.
    """
    if pictures > MOST_PICTURES:
        what = f"makes {pictures:,.0f} pictures, of at most {MOST_PICTURES:,}: take a longer one"
        raise InputError([Fault(what, column=column, value=value)])


def check_film(path: Path, frame_ms: float) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` if such a film cannot be written.

    The name must end in .gif or .mp4, the latter needs the extra ``video`` installed, and a
    picture must last a finite time above 0.
    """
    if checked_ending(path, ENDINGS, "a moving map") == ".mp4":
        ffmpeg()
    if not 0 < frame_ms < float("inf"):
        what = "must be a finite number of milliseconds above 0"
        raise InputError([Fault(what, column="frame_ms", value=frame_ms)])


def add_time(sheet: MapSheet) -> Any:
    """Add a text above the right end of the map, for the time."""
    style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 13, "family": "monospace"}
    return sheet.axes.text(1.0, 1.01, "", transform=sheet.axes.transAxes, **style)


def _drawn(film: MovingMap, progress: Progress | None) -> Iterator[Picture]:
    """Give picture after picture: the background is copied, and what moves drawn on it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = film.sheet.figure
    figure.set_dpi(DPI)
    take_as_written(figure)
    canvas: Any = FigureCanvasAgg(figure)  # its methods are not typed
    for artist in film.artists:  # not a part of the background
        artist.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for number in range(film.pictures):
        film.draw(number)
        canvas.restore_region(background)
        for artist in film.artists:
            film.sheet.axes.draw_artist(artist)
        yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
        if progress is not None:
            progress((number + 1) / film.pictures)

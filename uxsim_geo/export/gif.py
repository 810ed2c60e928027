"""GIF files written frame by frame, with one palette for all frames.

A palette for each frame would let colours flicker, and all frames in memory would be too much for
a long film. Only what has changed since the frame before is stored; the rest is transparent.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.export.colours import NEUTRAL, SPEED_CLASSES

#: what a picture holds: rows, columns, red, green and blue
Picture = npt.NDArray[np.uint8]
#: rows of red, green and blue
Colours = npt.NDArray[np.uint8]
#: numbers of colours
Indices = npt.NDArray[np.uint8]

UNCHANGED = 255  # index of the transparent colour
SHORTEST = 2  # hundredths of a second; viewers slow down what is shorter


def write_gif(file: IO[bytes], pictures: Iterable[Picture], frame_ms: float) -> None:
    """Write pictures of one size as a film that begins again at its end.

    A frame lasts a whole number of hundredths of a second, at least two; they are dealt so that
    the film as a whole has the right length.
    """
    palette = _palette()
    nearest = _nearest(palette)
    before: Indices | None = None
    for picture, hundredths in zip(pictures, _durations(frame_ms), strict=False):
        now = _indices(picture, nearest)
        if before is None:
            file.write(_header(now.shape, palette))
        file.writelines(_frame(now, before, hundredths))
        before = now
    file.write(b";")


def _durations(frame_ms: float) -> Iterator[int]:
    """Hundredths of a second of each frame, for ever."""
    frame, shown = 0, 0
    while True:
        frame += 1
        until = max(int(frame * frame_ms / 10 + 0.5), shown + SHORTEST)
        yield until - shown
        shown = until


def _header(shape: tuple[int, ...], palette: Colours) -> bytes:
    """GIF89a with a global table of 256 colours, and that the film is repeated for ever."""
    height, width = shape
    screen = b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0)
    colours = palette.tobytes().ljust(768, b"\0")
    return screen + colours + b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"


def _nearest(palette: Colours) -> Indices:
    """The index of the nearest colour for each of 64 x 64 x 64 colours, blue first."""
    from scipy.spatial import KDTree

    steps = np.rint(np.linspace(0, 255, 64))
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    nearest: Indices = KDTree(palette).query(grid)[1].astype(np.uint8)
    return nearest


def _indices(picture: Picture, nearest: Indices) -> Indices:
    red, green, blue = (picture[:, :, colour].astype(np.int32) >> 2 for colour in range(3))
    indices: Indices = nearest[red << 12 | green << 6 | blue]
    return indices


def _frame(now: Indices, before: Indices | None, hundredths: int) -> list[bytes]:
    """The rectangle that holds all changes, what has not changed in it transparent."""
    from PIL import GifImagePlugin, Image

    left, top = 0, 0
    if before is not None:
        changed = now != before
        left, top, right, bottom = _box(changed)
        part = (slice(top, bottom), slice(left, right))
        now = np.where(changed[part], now[part], UNCHANGED).astype(np.uint8)
    shown: dict[str, int] = {"duration": 10 * hundredths, "transparency": UNCHANGED, "disposal": 1}
    image = Image.fromarray(now)
    return GifImagePlugin.getdata(image, (left, top), **shown)


def _box(changed: npt.NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of what has changed; one point where nothing has."""
    rows, columns = (np.flatnonzero(changed.any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return 0, 0, 1, 1
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _palette() -> Colours:
    """The colours of moving maps, and the mixtures that occur there; at most 255.

    They have few colours: those of the speeds and of roads, on white paper and upon one another,
    and black. Fading and the smooth edges of lines mix two of them.
    """
    from matplotlib.colors import to_rgb

    named = [to_rgb(colour) for colour in (*(speed.colour for speed in SPEED_CLASSES), NEUTRAL)]
    white, black = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
    mixtures = [_mixed(white, black, 20)]
    mixtures += [_mixed(colour, white, 18) for colour in named]
    mixtures += [_mixed(*pair, 10)[1:-1] for pair in combinations(named, 2)]
    return np.unique(np.rint(255 * np.concatenate(mixtures)).astype(np.uint8), axis=0)


def _mixed(one: Any, other: Any, steps: int) -> npt.NDArray[np.float64]:
    share = np.linspace(0.0, 1.0, steps)[:, None]
    mixed: npt.NDArray[np.float64] = (1 - share) * np.array(one) + share * np.array(other)
    return mixed

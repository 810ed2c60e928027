"""MP4 files (H.264), encoded by the ffmpeg that the package imageio-ffmpeg brings along."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import IO

import numpy as np

from uxsim_geo.errors import Fault, InputError
from uxsim_geo.export.gif import Picture

#: one thread, and no name or version of the program: the same film gives the same bytes
ENCODING = (
    *("-c:v", "libx264", "-preset", "fast", "-crf", "20", "-threads", "1"),
    *("-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"),
    *("-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact"),
)


class EncodingError(RuntimeError):
    """The film could not be encoded, for the reason that ffmpeg gave."""


def ffmpeg() -> str:
    """Path of ffmpeg; raises :class:`uxsim_geo.errors.InputError` where it is not installed."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):  # the package, or a program in it for this system
        what = (
            "MP4 files need an encoder: install the extra video (pip install 'uxsim-geo[video]'), "
            "or choose a name that ends in .gif"
        )
        raise InputError([Fault(what)]) from None


def write_mp4(path: Path, pictures: Iterable[Picture], frame_ms: float) -> None:
    """Write pictures of one size, without sound; raises :class:`EncodingError` if it fails.

    Sides become even, as the format wants them, by one more row or column.
    """
    program, rest = ffmpeg(), iter(pictures)
    first = _even(next(rest))
    with tempfile.TemporaryFile() as messages:
        command = [program, *_arguments(path, first, frame_ms)]
        encoder = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=messages)
        try:
            _send(encoder, chain([first], map(_even, rest)))
        except BrokenPipeError:
            pass  # it has ended early: its status and its messages say why
        except BaseException:
            encoder.kill()
            raise
        finally:
            status = encoder.wait()
        if status:
            raise EncodingError(_last_line(messages))


def _send(encoder: subprocess.Popen[bytes], pictures: Iterable[Picture]) -> None:
    assert encoder.stdin is not None
    with encoder.stdin as pipe:
        for picture in pictures:
            pipe.write(picture.tobytes())


def _even(picture: Picture) -> Picture:
    """Repeat the last row and column where their number is odd."""
    height, width = picture.shape[:2]
    return np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")


def _last_line(messages: IO[bytes]) -> str:
    messages.seek(0)
    lines = messages.read().decode("utf-8", "replace").strip().splitlines()
    return lines[-1] if lines else "the encoder ended without a message"


def _arguments(path: Path, picture: Picture, frame_ms: float) -> list[str]:
    height, width = picture.shape[:2]
    rate = f"1000000/{max(round(1000 * frame_ms), 1)}"
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-framerate", rate)
    quiet = ("-y", "-nostdin", "-hide_banner", "-loglevel", "error")
    # file: else a name with a colon would be taken for an address
    return [*quiet, *raw, "-i", "pipe:0", *ENCODING, f"file:{path}"]

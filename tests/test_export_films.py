"""Films: pictures in their order, for as long as they should, and the same bytes each time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mapped_network import two_way_road
from matplotlib.colors import to_rgb
from PIL import Image

from uxsim_geo.errors import InputError
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.colours import NEUTRAL, SPEED_CLASSES
from uxsim_geo.export.film import MovingMap, add_time, write_film
from uxsim_geo.export.gif import Picture, write_gif
from uxsim_geo.export.map_sheet import MapSheet
from uxsim_geo.export.mp4 import EncodingError, write_mp4

COLOURS = np.rint(
    [[255 * part for part in to_rgb(c)] for c in (*(s.colour for s in SPEED_CLASSES), NEUTRAL)]
).astype(np.uint8)


def pictures(count: int, shape: tuple[int, int] = (30, 41)) -> list[Picture]:
    """Boxes in the colours of speeds on white paper, in places that a seed chooses."""
    random = np.random.default_rng(7)
    drawn = []
    for _ in range(count):
        picture = np.full((*shape, 3), 255, np.uint8)
        for colour in COLOURS:
            row, column = random.integers(0, 20, 2)
            picture[row : row + 8, column : column + 9] = colour
        drawn.append(picture)
    return drawn


def gif_of(path: Path, drawn: list[Picture], frame_ms: float = 100.0) -> Image.Image:
    with path.open("wb") as file:
        write_gif(file, iter(drawn), frame_ms)
    return Image.open(path)


def frames_of(film: Image.Image) -> tuple[list[Picture], list[int]]:
    shown, durations = [], []
    for number in range(film.n_frames):
        film.seek(number)
        durations.append(film.info["duration"])
        shown.append(np.asarray(film.convert("RGB")))
    return shown, durations


def test_a_gif_shows_what_was_drawn_in_exact_colours(tmp_path: Path) -> None:
    drawn = pictures(6)
    drawn.insert(3, drawn[2])  # nothing has changed, and yet it is a picture
    film = gif_of(tmp_path / "film.gif", drawn)
    shown, durations = frames_of(film)
    assert film.info["loop"] == 0
    assert durations == [100] * 7
    assert len(shown) == 7
    for expected, found in zip(drawn, shown, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_mixed_colours_come_near(tmp_path: Path) -> None:
    share = np.linspace(0, 1, 64)[None, :, None]
    mixed = np.concatenate([255 * (1 - share) + share * c for c in COLOURS], axis=0)
    picture = np.rint(mixed).astype(np.uint8)
    (shown,), _ = frames_of(gif_of(tmp_path / "film.gif", [picture]))
    assert np.abs(shown.astype(int) - picture).max() <= 12


@pytest.mark.parametrize(
    ("frame_ms", "durations"),
    [(25.0, [30, 20, 30, 20]), (33.0, [30, 40, 30, 30]), (1.0, [20, 20, 20, 20])],
)
def test_a_gif_lasts_as_long_as_it_should(
    frame_ms: float, durations: list[int], tmp_path: Path
) -> None:
    assert frames_of(gif_of(tmp_path / "film.gif", pictures(4), frame_ms))[1] == durations


def test_pictures_go_to_the_file_as_they_come(tmp_path: Path) -> None:
    written = []
    with (tmp_path / "film.gif").open("wb") as file:

        def come() -> Iterator[Picture]:
            for picture in pictures(5):
                written.append(file.tell())
                yield picture

        write_gif(file, come(), 100.0)
    assert (np.diff(written) > 0).all()


def test_an_mp4_has_all_pictures_and_begins_with_its_index(tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    paths = [tmp_path / "one.mp4", tmp_path / "two.mp4"]
    for path in paths:
        write_mp4(path, iter(pictures(12)), 125.0)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(paths[0]))
    assert (frames, seconds) == (12, pytest.approx(1.5))
    reader = imageio_ffmpeg.read_frames(str(paths[0]))
    about = next(reader)
    assert about["size"] == (42, 30)  # 41 is odd
    assert about["pix_fmt"].startswith("yuv420p")
    first = np.frombuffer(next(reader), np.uint8).reshape(30, 42, 3).astype(int)
    assert np.abs(first[:, :41] - pictures(1)[0]).mean() < 12
    reader.close()
    made = paths[0].read_bytes()
    assert made == paths[1].read_bytes()
    assert made.index(b"moov") < made.index(b"mdat")


def test_what_the_encoder_says_is_passed_on(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(EncodingError, match="No such file"):
        write_mp4(tmp_path / "absent" / "film.mp4", iter(pictures(3)), 40.0)


def moving_map(count: int, fail_at: int = -1) -> MovingMap:
    sheet = MapSheet.of(two_way_road(), "")
    time = add_time(sheet)

    def draw(number: int) -> None:
        if number == fail_at:
            raise RuntimeError("stopped")
        time.set_text(Clock().text(60.0 * number))

    return MovingMap(sheet, (time,), draw, count)


@pytest.mark.parametrize("ending", [".gif", ".mp4"])
def test_a_film_is_written_whole_and_tells_how_far_it_is(ending: str, tmp_path: Path) -> None:
    if ending == ".mp4":
        pytest.importorskip("imageio_ffmpeg")
    done: list[float] = []
    for name in ("one", "two"):
        write_film(moving_map(4), tmp_path / f"{name}{ending}", 80.0, done.append)
    assert done == [0.25, 0.5, 0.75, 1.0] * 2
    files = sorted(tmp_path.iterdir())
    assert [file.name for file in files] == [f"one{ending}", f"two{ending}"]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_what_moves_leaves_nothing_behind(tmp_path: Path) -> None:
    write_film(moving_map(3), tmp_path / "film.gif", 80.0)
    write_film(moving_map(1), tmp_path / "first.gif", 80.0)
    film = moving_map(3)
    write_film(
        MovingMap(film.sheet, film.artists, lambda _: film.draw(2), 1), tmp_path / "b.gif", 9
    )
    (first,), _ = frames_of(Image.open(tmp_path / "first.gif"))
    (last,), _ = frames_of(Image.open(tmp_path / "b.gif"))
    shown, _ = frames_of(Image.open(tmp_path / "film.gif"))
    np.testing.assert_array_equal(shown[0], first)
    np.testing.assert_array_equal(shown[2], last)
    assert (shown[0] != shown[2]).any()


def test_a_film_that_fails_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="stopped"):
        write_film(moving_map(4, fail_at=2), path, 80.0)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_mp4_that_fails_leaves_nothing(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(RuntimeError, match="stopped"):
        write_film(moving_map(4, fail_at=2), tmp_path / "film.mp4", 80.0)
    assert not list(tmp_path.iterdir())


def test_films_of_other_kinds_and_lengths_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.gif or \.mp4"):
        write_film(moving_map(1), tmp_path / "film.avi", 80.0)
    for frame_ms in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="milliseconds above 0"):
            write_film(moving_map(1), tmp_path / "film.gif", frame_ms)


def test_where_no_encoder_is_installed_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"uxsim-geo\[video\]"):
        write_film(moving_map(1), tmp_path / "film.mp4", 80.0)

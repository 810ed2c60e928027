"""The section report.space_time: its files by their names, and wishes in vain."""

from __future__ import annotations

import typing
from pathlib import Path

import pytest
from small_run import CONFIG, run_small, write_small_run

from pipeline.config_file import load_config
from pipeline.space_time_config import Camera, Form, Part
from uxsim_geo.errors import InputError
from uxsim_geo.export.space_time import drawing, look
from uxsim_geo.export.space_time.camera import DIRECTIONS

SLOW = "slow links in space and time"
SECTION = CONFIG.replace("[geopackage]", "[space_time]") + "  space_time: {{{}}}\n"


def test_the_configuration_knows_what_the_export_does() -> None:
    assert typing.get_args(Camera) == ("auto", *DIRECTIONS)
    assert typing.get_args(Camera) == typing.get_args(look.Camera)
    assert typing.get_args(Part) == typing.get_args(look.Part)


def test_every_form_is_written_under_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn = {}

    def still(path: Path, scene: dict, shown: look.Look, camera: str) -> None:
        drawn[path.name] = (camera, shown.size, shown.colour, "trajectories.lines" in scene)
        path.write_bytes(b"picture")

    def film(path: Path, scene: dict, shown: look.Look, **how: typing.Any) -> None:
        drawn[path.name] = (how["motion"], how["pictures"], shown.size, str(scene["title"]))
        how["progress"](1.0)
        path.write_bytes(b"film")

    monkeypatch.setattr(drawing, "write_still", still)
    monkeypatch.setattr(drawing, "write_film", film)
    forms = ", ".join(typing.get_args(Form))
    wishes = (
        f"forms: [{forms}], cameras: [north, above], colour: density, pictures: 9, "
        "width_px: 800, height_px: 600, show: [ribbons, trajectories, time_plane]"
    )
    write_small_run(tmp_path, SECTION.format(wishes))
    assert run_small(tmp_path) == 0
    run = tmp_path / "runs/small"
    assert {path.name for path in run.glob("space_time*")} == {
        "space_time.png",
        "space_time_above.png",
        "space_time.html",
        "space_time_orbit.mp4",
        "space_time_sweep.mp4",
        "space_time_surface.png",
        "space_time.vtp",
        "space_time.vtkhdf",
    }
    assert drawn["space_time.png"] == ("north", (800, 600), "density", True)
    assert drawn["space_time_above.png"][0] == "above"
    assert drawn["space_time_surface.png"][0] == "north"
    assert drawn["space_time_orbit.mp4"] == ("orbit", 9, (600, 450), f"small: {SLOW}")
    assert "space_time_sweep.mp4: 100 %" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("forms: [gif]", r"space_time.forms\[0\]: must be"),
        ("forms: [png, png]", "forms: says something twice"),
        ("cameras: []", "cameras"),
        ("slower_than: 0", "slower_than"),
        ("width_px: 20", "width_px"),
        ("colours: speed", "colour"),
    ],
)
def test_wrong_keys_are_told_before_anything_runs(tmp_path: Path, keys: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_config(write_small_run(tmp_path, SECTION.format(keys)))


def test_a_time_plane_after_the_end_is_told_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_small_run(tmp_path, SECTION.format("time_s: 5000, forms: [html]"))
    assert run_small(tmp_path) == 2
    assert "time_s: is after the end of the simulation, 1200 s" in capsys.readouterr().err
    assert not list((tmp_path / "runs/small").glob("space_time*"))

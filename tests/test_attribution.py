"""Whose data are shown: worked out in one place, and named on all that shows them."""

from __future__ import annotations

import io
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista as pv
from conftest import REPOSITORY
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.figure import Figure
from PIL import Image
from small_run import CONFIG, run_small, write_small_run

from pipeline.attribution import attribution
from pipeline.config_file import load_config
from uxsim_geo.analysis.link_states import link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.export.attribution import add_attribution
from uxsim_geo.export.moving_links import animate_links
from uxsim_geo.export.plots import mfd_figure, network_state_figure
from uxsim_geo.export.space_time import drawing

OWNER = "© Müller & <Söhne>, $5 to $6"

FILES = "  net: net.tntp\n  nodes: nodes.tntp\n  trips:\n    file: trips.tntp\n"


def dataset(*own: str) -> str:
    """The small configuration with a data set in place of files, but for its ``own``."""
    kept = "".join(f"  {line}\n" for line in own)
    named = f"  dataset: SiouxFalls\n{kept}  trips:\n"
    if "trips" in own:
        named = f"  dataset: SiouxFalls\n{kept}".replace(
            "  trips\n", "  trips:\n    file: trips.tntp\n"
        )
    units = "  crs: none\n  length_unit: m\n  time_unit: s\n  capacity_unit: veh/h\n"
    return CONFIG.replace(FILES, named).replace(units, "")


def test_open_data_known_by_name_name_their_owners(tmp_path: Path) -> None:
    roads = load_config(REPOSITORY / "configs" / "osm_place.yaml")
    assert attribution(roads) == "© OpenStreetMap contributors, ODbL"
    town = attribution(load_config(write_small_run(tmp_path, dataset())))
    assert town.startswith("SiouxFalls: Transportation Networks for Research")
    assert "academic research only" in town
    assert len(town) < 150  # a line at the foot of a picture


def test_own_files_name_nobody_and_a_configuration_whom_it_likes(tmp_path: Path) -> None:
    assert attribution(load_config(write_small_run(tmp_path))) == ""
    told = CONFIG + f"  attribution: {json.dumps(OWNER)}\n"
    assert attribution(load_config(write_small_run(tmp_path, told))) == OWNER
    silent = dataset() + "  attribution: ''\n"
    assert attribution(load_config(write_small_run(tmp_path, silent))) == ""


def texts_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.texts]


def pixels(figure: Figure) -> Any:
    file = io.BytesIO()
    figure.savefig(file, dpi=80)
    return np.asarray(Image.open(file).convert("L"))


@pytest.mark.parametrize("kind", ["map", "diagram"])
def test_a_figure_grows_at_its_foot_and_stays_as_it_was_above(kind: str) -> None:
    network = two_way_road()
    states = states_with_a_queue(network)

    def drawn() -> Figure:
        if kind == "map":
            return network_state_figure(network, link_totals(states), "t")
        return mfd_figure(network_states(states, network), "t")

    plain, named, twice = drawn(), drawn(), drawn()
    add_attribution(plain, "")
    assert texts_of(plain) == []
    add_attribution(named, OWNER)
    assert texts_of(named) == [OWNER]
    add_attribution(twice, "word " * 60)
    (lines,) = (text.count("\n") + 1 for text in texts_of(twice))
    heights = [figure.get_size_inches()[1] for figure in (plain, named, twice)]
    assert lines > 1
    line = (heights[2] - heights[1]) / (lines - 1)
    assert 0.05 < line < heights[1] - heights[0] < 0.3  # inches
    before, after, longer = pixels(plain), pixels(named), pixels(twice)
    for more in (after, longer):
        foot = more.shape[0] - before.shape[0]
        # all that was there is there, but for what rounding to pixels may move
        assert np.abs(more[:-foot].mean() - before.mean()) < 1.0
        assert (more[-foot:] < 160).any()  # and below stand letters
        inside = more[-foot:] < 200
        assert not inside[:, :1].any()
        assert not inside[:, -1:].any()


def test_a_moving_map_names_them_in_every_picture(tmp_path: Path) -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    for name, owner in (("plain", ""), ("named", "Somebody")):
        animate_links(network, states, tmp_path / f"{name}.gif", frame_ms=100, attribution=owner)
    with Image.open(tmp_path / "plain.gif") as plain, Image.open(tmp_path / "named.gif") as named:
        assert named.height > plain.height
        for number in range(2):
            named.seek(number)
            foot = np.asarray(named.convert("L"))[-12:]
            assert (foot < 160).any()


def test_a_run_names_them_in_every_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: dict[str, str] = {}

    def still(path: Path, scene: dict[str, Any], *_: object) -> None:
        drawn[path.name] = str(scene["attribution"])
        path.write_bytes(b"picture")

    def film(path: Path, scene: dict[str, Any], *_: object, **__: object) -> None:
        still(path, scene)

    monkeypatch.setattr(drawing, "write_still", still)
    monkeypatch.setattr(drawing, "write_film", film)
    forms = "png, html, orbit, sweep, surface, vtp"
    section = "report:\n  outputs: [geopackage, page, space_time]\n"
    section += f"  space_time: {{forms: [{forms}]}}\n  attribution: {json.dumps(OWNER)}\n"
    section += (
        "  plots: [{plot: network_average, format: svg}, {plot: travel_times, format: svg}]\n"
    )
    write_small_run(tmp_path, CONFIG.partition("report:")[0] + section)
    assert run_small(tmp_path) == 0
    run = tmp_path / "runs/small"
    assert drawn == dict.fromkeys(
        (f"space_time{one}" for one in (".png", "_orbit.mp4", "_sweep.mp4", "_surface.png")), OWNER
    )
    escaped = "© Müller &amp; &lt;Söhne&gt;, $5 to $6"
    for page in ("space_time.html", "report.html"):
        assert escaped in (run / page).read_text(encoding="utf-8")
    for plot in ("network_average", "travel_times"):
        assert escaped in (run / f"plots/{plot}.svg").read_text(encoding="utf-8")
    with closing(sqlite3.connect(run / "results.gpkg")) as database:
        told = database.execute("SELECT value FROM run_info WHERE item = 'attribution'").fetchall()
        assert told == [(OWNER,)]
        (items,) = database.execute("SELECT metadata FROM gpkg_metadata ORDER BY id").fetchone()
        assert f">{escaped}<" in items
    told = pv.read(run / "space_time.vtp").GetFieldData().GetAbstractArray("attribution")
    assert told.GetValue(0) == OWNER

"""Plots and 3D pictures of a study: what is drawn, and of what nothing is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shown_study import EVIL, START, study, without_map

from uxsim_geo.export.comparison.changes import shown_of_links
from uxsim_geo.export.comparison.files import study_writers
from uxsim_geo.export.comparison.plots import (
    difference_map_figure,
    intervals_figure,
)
from uxsim_geo.export.comparison.space_time import STEPS, difference_scene
from uxsim_geo.export.comparison.winners_plot import winners_figure
from uxsim_geo.export.saving import save_figure
from uxsim_geo.export.space_time.look import Look

LOOK = Look(start=START)

pytestmark = pytest.mark.filterwarnings("ignore:Glyph .* missing")


def texts(figure: object) -> list[str]:
    from matplotlib.text import Text

    return [text.get_text() for text in figure.findobj(Text)]  # type: ignore[attr-defined]


def test_intervals_are_drawn_from_end_to_end() -> None:
    shown = study()
    figure = intervals_figure(shown)
    totals = shown.compared[0].comparison.totals.set_index("figure").loc["total_delay_veh_h"]
    ends = [100 * totals[name] / totals["base"] for name in ("low", "high")]
    lines = [list(line.get_xdata()) for line in figure.axes[0].lines]
    assert any(np.allclose(line, ends) for line in lines if len(line) == 2)
    assert "nothing" in texts(figure)


@pytest.mark.parametrize("seeds", [1, 2])
def test_pictures_of_hostile_names_are_written(tmp_path: Path, seeds: int) -> None:
    shown = study(seeds)
    figures = [intervals_figure(shown)]
    for entry in shown.compared:
        figures.append(winners_figure(entry))
        figures += [
            difference_map_figure(shown, entry, one)
            for one in shown_of_links(shown, relative=False)
        ]
    for number, figure in enumerate(figures):
        save_figure(figure, tmp_path / f"{number}.svg")
        assert (tmp_path / f"{number}.svg").stat().st_size > 1000


def test_a_map_says_which_links_one_network_has_alone() -> None:
    shown = study()
    delay = shown_of_links(shown, relative=False)[0]
    told = " ".join(texts(difference_map_figure(shown, shown.compared[0], delay)))
    assert "removed by the" in told
    assert "added by the" in told
    told = " ".join(texts(difference_map_figure(shown, shown.compared[1], delay)))
    assert "removed by the" not in told
    assert "added by the" not in told


def test_without_a_map_there_is_none_to_draw() -> None:
    shown = without_map(study(2))
    delay = shown_of_links(shown, relative=False)[0]
    with pytest.raises(ValueError, match="no geometry"):
        difference_map_figure(shown, shown.compared[0], delay)


def test_walls_stand_where_and_when_the_change_is_sure() -> None:
    shown = study()
    scene = difference_scene(shown, shown.compared[0], LOOK)
    table = shown.compared[0].comparison.link_times
    sure = (table["delay_veh_h_low"] > 0) | (table["delay_veh_h_high"] < 0)
    assert sure.any()
    # a box has six faces; links of one straight piece, and equal bins stand as one
    boxes = len(scene["ribbons.faces"]) / 6
    assert 0 < boxes <= sure.sum()
    assert len(scene["scale_labels"]) == 2 * STEPS + 1
    assert float(scene["scale_labels"][STEPS]) == 0.0
    assert scene["title"].startswith(EVIL[0])
    # the link that is gone and the one that is new lie on the ground, in different colours
    assert len(scene["slow.lines"]) == 2
    assert len(np.unique(scene["slow.rgb"], axis=0)) == 2


def test_nothing_makes_no_walls() -> None:
    shown = study(2)
    scene = difference_scene(shown, shown.compared[1], LOOK)
    assert len(scene["ribbons.faces"]) == 0
    assert len(scene["slow.lines"]) == 0
    assert scene["notes"].tolist() == []


def test_files_are_named_by_their_scenario_and_there_if_they_can_be(tmp_path: Path) -> None:
    shown = study(2)
    writers = study_writers(shown, ending="svg")
    assert {"comparison.gpkg", "comparison.html", "comparison/intervals.svg"} <= set(writers)
    assert "comparison/delay_nothing.svg" in writers
    assert "comparison/space_time_speed_nothing.png" in writers
    assert not [name for name in study_writers(without_map(shown)) if "space_time" in name]
    empty = study_writers(replace(shown, scenarios=shown.scenarios[2:]))
    assert set(empty) == {"comparison.gpkg", "comparison.html"}
    (tmp_path / "comparison").mkdir()
    for name in ("comparison/winners_nothing.svg", "comparison/delay_nothing.svg"):
        writers[name](tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000

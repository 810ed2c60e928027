"""All files that show a study: what each is called, and how it is written."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from uxsim_geo.export.attribution import add_attribution
from uxsim_geo.export.comparison.changes import Shown, shown_of_links
from uxsim_geo.export.comparison.geopackage import write_comparison_geopackage
from uxsim_geo.export.comparison.page import write_comparison_page
from uxsim_geo.export.comparison.plots import (
    difference_map_figure,
    intervals_figure,
    winners_figure,
)
from uxsim_geo.export.comparison.space_time import Changing, difference_scene
from uxsim_geo.export.comparison.study import Scenario, Study, short_names
from uxsim_geo.export.saving import save_figure
from uxsim_geo.export.space_time.drawing import write_still
from uxsim_geo.export.space_time.look import Look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Writer = Callable[[Path], None]

#: folder of the pictures, beside page and GeoPackage
PICTURES = "comparison"

#: changes that have a map each, by the first part of their files' names
MAPPED = {"delay": "delay_veh_h", "volume": "volume_veh", "speed": "speed_kmh"}

#: how the names of pictures in space and time begin
IN_SPACE_AND_TIME = "space_time"

#: changes that are drawn in them
IN_SPACE_TIME: dict[str, Changing] = {"delay": "delay_veh_h", "speed": "speed_kmh"}


def study_writers(study: Study, *, ending: str = "png") -> dict[str, Writer]:
    """Writers by the names of their files, relative to the folder of the study.

    ``ending`` of the plots: png, svg or pdf. Maps and pictures in space and time are there where
    the base has geometry; the latter may raise
    :class:`uxsim_geo.export.space_time.drawing.RenderError`, on a machine that cannot draw them.
    """
    writers: dict[str, Writer] = {
        "comparison.gpkg": partial(write_comparison_geopackage, study=study),
        "comparison.html": partial(write_comparison_page, study=study),
    }
    if not study.compared:
        return writers
    owner = study.about.attribution
    writers[f"{PICTURES}/intervals.{ending}"] = _saved(partial(intervals_figure, study), owner)
    maps = shown_of_links(study, relative=False) if "geometry" in study.base.links else []
    names = short_names(entry.name for entry in study.compared)
    for entry, short in zip(study.compared, names, strict=True):
        winners = _saved(partial(winners_figure, entry), owner)
        writers[f"{PICTURES}/winners_{short}.{ending}"] = winners
        for name, shown in _mapped(maps):
            figure = partial(difference_map_figure, study, entry, shown)
            writers[f"{PICTURES}/{name}_{short}.{ending}"] = _saved(figure, owner)
        for name, changing in IN_SPACE_TIME.items() if maps else ():
            still = partial(_write_still, study=study, entry=entry, changing=changing)
            writers[f"{PICTURES}/{IN_SPACE_AND_TIME}_{name}_{short}.png"] = still
    return writers


def is_drawn_apart(name: str) -> bool:
    """Tell whether another process draws a file, so that several can be made at a time."""
    return name.startswith(f"{PICTURES}/{IN_SPACE_AND_TIME}")


def _mapped(maps: list[Shown]) -> list[tuple[str, Shown]]:
    by_name = {shown.quantity.name: shown for shown in maps}
    return [(name, by_name[column]) for name, column in MAPPED.items() if column in by_name]


def _saved(make: Callable[[], Figure], attribution: str) -> Writer:
    def write(path: Path) -> None:
        figure = make()
        if attribution:
            add_attribution(figure, attribution)
        save_figure(figure, path)

    return write


def _write_still(path: Path, study: Study, entry: Scenario, changing: Changing) -> None:
    about = study.about
    look = Look(start=about.start, driving_side=about.driving_side, attribution=about.attribution)
    write_still(path, difference_scene(study, entry, look, changing), look)

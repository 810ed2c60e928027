"""The pictures, films and files in space and time of a report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pipeline.attribution import attribution
from pipeline.config import Config
from pipeline.material import Material
from pipeline.results_files import driving_side
from pipeline.space_time_config import SpaceTimeSection
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    from uxsim_geo.analysis.types import Floats
    from uxsim_geo.export.space_time.look import Look

NAME = "space_time"

#: told which share of a film is done, 0 to 1, by its file's name
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class SpaceTime:
    """A run, and what its pictures are made of, each made once and only if it is needed."""

    material: Material
    progress: Progress

    @property
    def wishes(self) -> SpaceTimeSection:
        """The section of the configuration."""
        return self.material.config.report.space_time

    @cached_property
    def look(self) -> Look:
        """How everything looks."""
        from uxsim_geo.export.space_time.look import Look

        wishes, report = self.wishes, self.material.config.report
        return Look(
            title=self.material.config.name,
            start=report.start,
            colour=wishes.colour,
            show=wishes.show,
            slower_than=wishes.slower_than,
            most_links=wishes.most_links,
            time=wishes.time_s,
            size=(wishes.width_px, wishes.height_px),
            driving_side=driving_side(self.material.config),
            attribution=attribution(self.material.config),
        )

    @cached_property
    def ways(self) -> list[Floats]:
        """Of a sample of vehicles, if they are asked for."""
        from uxsim_geo.export.space_time.ways import sampled_ways

        if "trajectories" not in self.wishes.show:
            return []
        most = self.wishes.most_trajectories
        return sampled_ways(self.material.network, self.material.passages, most)

    @cached_property
    def scene(self) -> dict[str, Any]:
        """What is drawn."""
        from uxsim_geo.export.space_time.scene import space_time_scene

        return space_time_scene(
            self.material.network, self.material.kept_states, self.look, self.ways
        )


def check_space_time(config: Config) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` for a time plane after the end."""
    time, duration = config.report.space_time.time_s, config.simulate.duration_s
    if "space_time" in config.report.outputs and time is not None and time > duration:
        place = ("report", "space_time", "time_s")
        what = f"report.space_time.time_s: is after the end of the simulation, {duration:g} s"
        raise InputError([Fault(what, *config.report.origin(place), value=time)])


def space_time_writers(material: Material, progress: Progress) -> dict[str, Callable[[Path], None]]:
    """By the name of each file, the function that writes it to a path."""
    run = SpaceTime(material, progress)
    writers: dict[str, Callable[[Path], None]] = {}
    for form in run.wishes.forms:
        if form == "png":
            for number, camera in enumerate(run.wishes.cameras):
                name = f"{NAME}.png" if number == 0 else f"{NAME}_{camera}.png"
                writers[name] = partial(_write_still, run, camera)
        elif form in ("orbit", "sweep"):
            writers[f"{NAME}_{form}.mp4"] = partial(_write_film, run, form)
        elif form == "surface":
            writers[f"{NAME}_surface.png"] = partial(_write_surface, run)
        elif form == "html":
            writers[f"{NAME}.html"] = partial(_write_page, run)
        else:
            writers[f"{NAME}.{form}"] = partial(_write_vtk, run)
    return writers


def _write_still(run: SpaceTime, camera: Any, path: Path) -> None:
    from uxsim_geo.export.space_time.drawing import write_still

    write_still(path, run.scene, run.look, camera)


def _write_surface(run: SpaceTime, path: Path) -> None:
    from uxsim_geo.export.space_time.drawing import write_still
    from uxsim_geo.export.space_time.surface import surface_scene

    scene = surface_scene(run.material.network, run.material.kept_states, run.look)
    write_still(path, scene, replace(run.look, show=()), run.wishes.cameras[0])


def _write_film(run: SpaceTime, motion: Literal["orbit", "sweep"], path: Path) -> None:
    from uxsim_geo.export.space_time.drawing import write_film

    across, up = run.look.size
    look = replace(run.look, size=(across * 3 // 4, up * 3 // 4))
    write_film(
        path,
        run.scene,
        look,
        motion=motion,
        camera=run.wishes.cameras[0],
        pictures=run.wishes.pictures,
        frame_ms=run.wishes.frame_ms,
        progress=partial(run.progress, path.name),
    )


def _write_page(run: SpaceTime, path: Path) -> None:
    from uxsim_geo.export.space_time.page import write_page

    write_page(path, run.scene, run.look)


def _write_vtk(run: SpaceTime, path: Path) -> None:
    from uxsim_geo.export.space_time.vtk import write_vtk

    write_vtk(path, run.material.network, run.material.states, run.ways, run.look.attribution)

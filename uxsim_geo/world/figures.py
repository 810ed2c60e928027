"""The figures of ``W.analyzer``: drawn by the export, saved and shown as the world says."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.link_states import link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.errors import Faults
from uxsim_geo.world import pictures, values
from uxsim_geo.world.links import Link
from uxsim_geo.world.sight import AnyLink, Sight

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure

    from uxsim_geo.export.space_time_states import State


class Look(NamedTuple):
    """How a time-space diagram is cut (s, m), and whether red signals are marked."""

    plot_signal: bool = True
    xlim: tuple[float, float] | None = None
    ylim: tuple[float, float] | None = None


#: of states, in names of files
SHORT = {"density": "k", "flow": "q", "speed": "v"}


class Figures(Sight):
    """Figures of what a world has simulated so far.

    They are returned, saved to the folder ``out<name>`` where ``save_mode`` says so, and shown in
    notebooks where ``show_mode`` does. Animations are files: the path is returned.
    """

    def time_space_diagram_traj(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (12, 4),
        **look: Any,
    ) -> list[Figure]:
        """Draw the trajectories on each of some links, or of all."""
        return self._routes([[link] for link in self._links(links, least=1)], figsize, Look(**look))

    def time_space_diagram_traj_links(
        self,
        linkslist: Sequence[AnyLink] | Sequence[Sequence[AnyLink]],
        figsize: tuple[float, float] = (12, 4),
        **look: Any,
    ) -> list[Figure]:
        """Draw the trajectories along links that follow one another; several such rows if given.

        As to all time-space diagrams, ``plot_signal`` (True) marks red at the ends of links, and
        ``xlim`` (s) and ``ylim`` (m) cut the picture.
        """
        return self._routes(self._rows_of_links(linkslist), figsize, Look(**look))

    def time_space_diagram_density(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (12, 4),
        **look: Any,
    ) -> list[Figure]:
        """Draw the density by time and place of each of some links, or of all."""
        routes = [[link] for link in self._links(links, least=1)]
        return self._states_of_routes(routes, "density", figsize, Look(**look))

    def time_space_diagram_flow(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (12, 4),
        **look: Any,
    ) -> list[Figure]:
        """Draw the flow by time and place of each of some links, or of all."""
        routes = [[link] for link in self._links(links, least=1)]
        return self._states_of_routes(routes, "flow", figsize, Look(**look))

    def time_space_diagram_speed(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (12, 4),
        **look: Any,
    ) -> list[Figure]:
        """Draw the speed by time and place of each of some links, or of all."""
        routes = [[link] for link in self._links(links, least=1)]
        return self._states_of_routes(routes, "speed", figsize, Look(**look))

    def time_space_diagram_state_links(
        self,
        linkslist: Sequence[AnyLink] | Sequence[Sequence[AnyLink]],
        state: State = "density",
        figsize: tuple[float, float] = (12, 4),
        **look: Any,
    ) -> list[Figure]:
        """Draw density, flow or speed along links that follow one another; rows of them too."""
        routes = self._rows_of_links(linkslist)
        return self._states_of_routes(routes, state, figsize, Look(**look))

    def cumulative_curves(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (6, 4),
    ) -> list[Figure]:
        """Draw how many vehicles have entered and left each of some links, or of all."""
        from uxsim_geo.export.cumulative import cumulative_figure

        duration = self._result.settings.duration
        return [
            pictures.finish(
                self.W,
                cumulative_figure(self._network, self._passages, link.name, duration, figsize),
                f"cumulative_curves_{link.name}",
            )
            for link in self._links(links, least=1)
        ]

    def macroscopic_fundamental_diagram(
        self,
        kappa: float | None = None,  # noqa: ARG002
        qmax: float | None = None,  # noqa: ARG002
        figtitle: str = "",
        links: Iterable[AnyLink] | None = None,
        fname: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw flow against density of the network, or of some links; axes fit by themselves."""
        from uxsim_geo.export.plots import mfd_figure

        title = figtitle or f"{self.W.name or 'network'}: fundamental diagram"
        figure = mfd_figure(network_states(self._states_of_links(links), self._network), title)
        if figsize is not None:
            figure.set_size_inches(figsize)
        return pictures.finish(self.W, figure, f"mfd{fname}")

    def network(self, t: float | None = None, detailed: int = 1, **looks: Any) -> Figure:
        """Draw a map of the time bin in which ``t`` (s) lies; None: of where it stands now.

        Links are drawn as a whole; ``detailed`` makes part of the file's name alone.
        """
        from uxsim_geo.export.plots import network_at_time_figure

        pictures.check_looks(looks)
        end = self._result.settings.duration
        time = end if t is None else _checked("t", t, most=end)
        title = self.W.name or "network"
        figure = network_at_time_figure(self._network, self._states, time, title)
        return pictures.finish(self.W, figure, f"network{detailed}_{time:g}")

    def network_average(self, **looks: Any) -> Figure:
        """Draw a map of the whole run: volumes, and speeds."""
        from uxsim_geo.export.plots import network_state_figure

        pictures.check_looks(looks)
        totals = link_totals(self._states)
        title = f"{self.W.name or 'network'}: 0 to {self._result.settings.duration:,.0f} s"
        return pictures.finish(
            self.W, network_state_figure(self._network, totals, title), "network_average"
        )

    def plot_vehicle_log(self, vehname: str | int) -> Figure:
        """Draw the speed of a platoon over time and the links it drove.

        ``vehname`` is its row of the trips, or the name of a vehicle that was added by itself.
        """
        from uxsim_geo.export.one_vehicle import vehicle_figure

        row, duration = self._row_of_vehicle(vehname), self._result.settings.duration
        figure = vehicle_figure(self._network, self._passages, self._samples, row, duration)
        return pictures.finish(self.W, figure, f"vehicle_{vehname}")

    def network_anim(
        self,
        animation_speed_inverse: float = 10,
        detailed: int = 0,
        timestep_skip: int = 24,
        file_name: str | None = None,
        **looks: Any,
    ) -> Path:
        """Write a moving map of the links: one frame every ``timestep_skip`` time steps.

        A frame lasts ``animation_speed_inverse`` ms for each of them. ``detailed`` makes part of
        the file's name alone. The file is a GIF, or an MP4 where ``file_name`` ends so.
        """
        from uxsim_geo.export.moving_links import animate_links

        pictures.check_looks(looks)
        path = self._path_of(file_name, f"anim_network{detailed}.gif")
        skip = _checked("timestep_skip", timestep_skip, above=0.0)
        frame_ms = _checked("animation_speed_inverse", animation_speed_inverse, above=0.0) * skip
        states = self._states_of_bins(skip * self.W.DELTAT)
        with pictures.watching(self.W, path) as progress:
            animate_links(self._network, states, path, frame_ms=frame_ms, progress=progress)
        return path

    def network_fancy(
        self,
        animation_speed_inverse: float = 10,
        sample_ratio: float = 0.3,
        interval: int = 5,
        trace_length: int = 3,
        speed_coef: float = 2,
        file_name: str | None = None,
        **looks: Any,
    ) -> Path:
        """Write a moving map of a share of the platoons: a frame every ``interval`` time steps.

        A frame lasts ``animation_speed_inverse * speed_coef`` ms; the way of a vehicle fades over
        ``trace_length`` frames. The file is a GIF, or an MP4 where ``file_name`` ends so.
        """
        from uxsim_geo.export.moving_vehicles import animate_vehicles

        pictures.check_looks(looks)
        path = self._path_of(file_name, "anim_network_fancy.gif")
        every = _checked("interval", interval, above=0.0) * self.W.DELTAT
        ratio = _checked("sample_ratio", sample_ratio, above=0.0, most=1.0)
        speed = _checked("animation_speed_inverse", animation_speed_inverse, above=0.0)
        samples = Samples.of(self._passages, every, self._result.settings.duration)
        frame_ms = speed * _checked("speed_coef", speed_coef, above=0.0)
        samples = samples.of_share(self._passages, ratio)
        with pictures.watching(self.W, path) as progress:
            animate_vehicles(
                self._network,
                self._passages,
                samples,
                path,
                frame_ms=frame_ms,
                trail=trace_length,
                progress=progress,
            )
        return path

    def desire_lines(self, most: int = 200) -> Figure:
        """Draw the pairs of origin and destination: width is vehicles, colour their mean delay.

        The ``most`` largest are drawn so, others thin.
        """
        from uxsim_geo.export.desire_lines import desire_lines_figure

        pairs = od_table(self._result, self._network)
        title = self.W.name or "network"
        figure = desire_lines_figure(self._network, pairs, title, most=most)
        return pictures.finish(self.W, figure, "desire_lines")

    def travel_times(self) -> Figure:
        """Draw how the travel times of those who have arrived are distributed."""
        from uxsim_geo.export.travel_times import travel_times_figure

        title, duration = self.W.name or "network", self._result.settings.duration
        figure = travel_times_figure(self._result.trips, title, duration=duration)
        return pictures.finish(self.W, figure, "travel_times")

    def fundamental_diagram(self, links: AnyLink | Iterable[AnyLink]) -> Figure:
        """Draw flow against density of links by time bin, beside their own diagrams."""
        from uxsim_geo.export.fundamental_diagram import fundamental_diagram_figure

        names = [link.name for link in self._links(links, least=1)]
        tau = self._result.settings.reaction_time
        title = self.W.name or "network"
        figure = fundamental_diagram_figure(self._network, self._states, names, tau, title)
        return pictures.finish(self.W, figure, f"fundamental_diagram_{'-'.join(names)}")

    def plot_vehicles_log(self, vehnamelist: Iterable[str | int]) -> list[Figure]:
        """Draw speed and links of several platoons, a figure each: :meth:`plot_vehicle_log`."""
        return [self.plot_vehicle_log(name) for name in vehnamelist]

    def network_pillow(self, t: float | None = None, detailed: int = 1, **looks: Any) -> Figure:
        """As :meth:`network`, by the name of another way to draw it."""
        return self.network(t, detailed, **looks)

    def _rows_of_links(
        self, linkslist: Sequence[AnyLink] | Sequence[Sequence[AnyLink]]
    ) -> list[list[Link]]:
        single = all(isinstance(one, Link | str) for one in linkslist)
        rows: Any = [linkslist] if single else linkslist
        return [_joined(self._links(row, least=1)) for row in rows]

    def _states_of_routes(
        self,
        routes: Sequence[Sequence[Link]],
        state: State,
        figsize: tuple[float, float],
        look: Look,
    ) -> list[Figure]:
        from uxsim_geo.export.space_time_states import space_time_states_figure

        figures = []
        for route in routes:
            names = [link.name for link in route]
            sizes = {link.id: self._cell_size(link) for link in route}
            cells = space_time_cells(
                self._result,
                self._network,
                bin_s=min(self.W.EULAR_DT, self._result.settings.duration),
                cell_m=[sizes[link] for link in sorted(sizes)],
                links=names,
                passages=self._passages,
            )
            tau = self._result.settings.reaction_time
            figure = space_time_states_figure(
                self._network, cells, names, state, figsize, reaction_time=tau
            )
            figures.append(self._finish_diagram(figure, route, f"tsd_{SHORT[state]}", look))
        return figures

    def _routes(
        self, routes: Sequence[Sequence[Link]], figsize: tuple[float, float], look: Look
    ) -> list[Figure]:
        from uxsim_geo.export.trajectories import trajectories_figure

        duration = self._result.settings.duration
        figures = []
        for route in routes:
            names = [link.name for link in route]
            figure = trajectories_figure(self._network, self._passages, names, duration, figsize)
            kind = "tsd_traj_links" if len(names) > 1 else "tsd_traj"
            figures.append(self._finish_diagram(figure, route, kind, look))
        return figures

    def _finish_diagram(
        self, figure: Figure, route: Sequence[Link], kind: str, look: Look
    ) -> Figure:
        """Mark red signals, cut the picture, save it."""
        from uxsim_geo.export.corridor import draw_reds

        if look.plot_signal:
            reds = [self._reds(link) for link in route]
            draw_reds(figure, np.array([link.length for link in route]), reds)
        if look.xlim is not None:
            figure.axes[0].set_xlim(look.xlim)
        if look.ylim is not None:
            figure.axes[0].set_ylim(look.ylim)
        names = "-".join(link.name for link in route)
        return pictures.finish(self.W, figure, f"{kind}_{names}")

    def _path_of(self, file_name: str | None, name: str) -> Path:
        path = pictures.folder(self.W) / name if file_name is None else Path(file_name)
        path.parent.mkdir(parents=True, exist_ok=True)
        return path


def _checked(
    name: str, value: float, *, above: float | None = None, most: float = float("inf")
) -> float:
    """Return a number, 0 or more, or more than ``above``; raises InputError where it is none."""
    faults = Faults("picture")
    found = values.number(faults, name, value, above=above)
    if not faults.found and found > most:
        faults.add(f"must be {most:g} or less", column=name, value=value)
    faults.raise_if_any()
    return found


def _joined(links: list[Link]) -> list[Link]:
    """Return links that follow one another; raises InputError where they do not."""
    faults = Faults("links of a diagram")
    for before, link in pairwise(links):
        if link.start_node is not before.end_node:
            what = f"begins at node {link.start_node.name}, but {before.name} ends at "
            faults.add(f"{what}{before.end_node.name}", column="link", value=link.name)
    faults.raise_if_any()
    return links

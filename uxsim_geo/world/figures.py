"""The figures of ``W.analyzer``: drawn by the export, saved and shown as the world says."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from uxsim_geo.analysis.link_states import link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.samples import Samples, cells_of_link
from uxsim_geo.world import options
from uxsim_geo.world.links import Link
from uxsim_geo.world.sight import AnyLink, Sight

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: letters of a file's name; file systems take some 255 bytes
LONGEST_NAME = 120

#: looks of UXsim's maps that are passed over: these maps are drawn in one way
LOOKS = frozenset(
    {"antialiasing", "detailed", "figsize", "legend", "legend_outside", "left_handed"}
    | {"maxwidth", "minwidth", "network_font_size", "node_size", "state_variables"}
    | {"trace_length"}
)


class Figures(Sight):
    """Figures of what a world has simulated so far.

    They are returned, saved to the folder ``out<name>`` where ``save_mode`` says so, and shown in
    notebooks where ``show_mode`` does. Animations are files: the path is returned.
    """

    def time_space_diagram_traj(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (12, 4),
    ) -> list[Figure]:
        """Draw the trajectories on each of some links, or of all."""
        return [figure for link in self._links(links) for figure in self._routes([[link]], figsize)]

    def time_space_diagram_traj_links(
        self,
        linkslist: Sequence[AnyLink] | Sequence[Sequence[AnyLink]],
        figsize: tuple[float, float] = (12, 4),
    ) -> list[Figure]:
        """Draw the trajectories along links that follow one another; several such rows if given."""
        single = all(isinstance(one, Link | str) for one in linkslist)
        rows: Any = [linkslist] if single else linkslist
        return self._routes([self._links(row) for row in rows], figsize)

    def time_space_diagram_density(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (12, 4),
    ) -> list[Figure]:
        """Draw the density by time and place of each of some links, or of all."""
        from uxsim_geo.export.density import density_figure

        figures = []
        for link in self._links(links):
            edges = self._cell_edges(link)
            cells = cells_of_link(self._passages, self._samples, link.id, edges)
            figure = density_figure(cells, link.name, link.jam_density, figsize)
            figures.append(self._finish(figure, f"tsd_k_{link.name}"))
        return figures

    def cumulative_curves(
        self,
        links: AnyLink | Iterable[AnyLink] | None = None,
        figsize: tuple[float, float] = (6, 4),
    ) -> list[Figure]:
        """Draw how many vehicles have entered and left each of some links, or of all."""
        from uxsim_geo.export.cumulative import cumulative_figure

        duration = self._result.settings.duration
        return [
            self._finish(
                cumulative_figure(self._network, self._passages, link.name, duration, figsize),
                f"cumulative_curves_{link.name}",
            )
            for link in self._links(links)
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

        network, states = self._network, self._states
        if links is not None:
            names = [link.name for link in self._links(links)]
            chosen = network.links["link_id"].isin(names)
            network = replace(network, links=network.links[chosen])
            states = states[states["link_id"].isin(names)]
        title = figtitle or f"{self.W.name or 'network'}: fundamental diagram"
        figure = mfd_figure(network_states(network, states), title)
        if figsize is not None:
            figure.set_size_inches(figsize)
        return self._finish(figure, f"mfd{fname}")

    def network(self, t: float | None = None, **looks: Any) -> Figure:
        """Draw a map of the time bin in which ``t`` (s) lies; None: of where it stands now."""
        from uxsim_geo.export.plots import network_state_figure

        self._check_looks(looks)
        time = self._result.settings.duration if t is None else t
        states = self._states.copy()
        here = states[(states["begin_s"] <= time) & (time < states["end_s"])]
        if here.empty:
            here = states[states["end_s"] == states["end_s"].max()]
        begin, end = here[["begin_s", "end_s"]].iloc[0]
        here = here.assign(volume=here["time"] / (end - begin)).reset_index(drop=True)
        figure = network_state_figure(
            self._network,
            here,
            f"{self.W.name or 'network'}: {begin:,.0f} to {end:,.0f} s",
            volume="vehicles on the link",
            period="in this time",
        )
        return self._finish(figure, f"network_{time:g}")

    def network_average(self, **looks: Any) -> Figure:
        """Draw a map of the whole run: volumes, and speeds."""
        from uxsim_geo.export.plots import network_state_figure

        self._check_looks(looks)
        totals = link_totals(self._network, self._states)
        title = f"{self.W.name or 'network'}: 0 to {self._result.settings.duration:,.0f} s"
        return self._finish(network_state_figure(self._network, totals, title), "network_average")

    def plot_vehicle_log(self, vehname: str | int) -> Figure:
        """Draw the speed of a platoon over time and the links it drove.

        ``vehname`` is its row of the trips, or the name of a vehicle that was added by itself.
        """
        from uxsim_geo.export.one_vehicle import vehicle_figure

        row, duration = self._row_of_vehicle(vehname), self._result.settings.duration
        figure = vehicle_figure(self._network, self._passages, self._samples, row, duration)
        return self._finish(figure, f"vehicle_{vehname}")

    def network_anim(
        self,
        animation_speed_inverse: float = 10,
        timestep_skip: int = 24,
        file_name: str | None = None,
        **looks: Any,
    ) -> Path:
        """Write a moving map of the links: one frame every ``timestep_skip`` time steps.

        A frame lasts ``animation_speed_inverse`` ms for each of them.
        """
        from uxsim_geo.export.animations import animate_links

        self._check_looks(looks)
        path = self._path_of(file_name, "anim_network.gif")
        states = self._states_of_bins(timestep_skip * self.W.DELTAT)
        frame_ms = animation_speed_inverse * timestep_skip
        animate_links(self._network, states, path, frame_ms)
        return path

    def network_fancy(
        self,
        animation_speed_inverse: float = 10,
        sample_ratio: float = 0.3,
        interval: int = 5,
        speed_coef: float = 2,
        file_name: str | None = None,
        **looks: Any,
    ) -> Path:
        """Write a moving map of a share of the platoons: a frame every ``interval`` time steps.

        A frame lasts ``animation_speed_inverse * speed_coef`` ms.
        """
        from uxsim_geo.export.animations import animate_vehicles

        self._check_looks(looks)
        path = self._path_of(file_name, "anim_network_fancy.gif")
        every = interval * self.W.DELTAT
        samples = Samples.of(self._passages, every, self._result.settings.duration)
        # of every ten platoons in a row as many as the ratio says
        shown = (self._passages.vehicle[samples.row] % 10) < round(10 * sample_ratio)
        frame_ms = animation_speed_inverse * speed_coef
        animate_vehicles(self._network, self._passages, samples.where(shown), path, frame_ms)
        return path

    def _routes(
        self, routes: Sequence[Sequence[Link]], figsize: tuple[float, float]
    ) -> list[Figure]:
        from uxsim_geo.export.trajectories import trajectories_figure

        duration = self._result.settings.duration
        figures = []
        for route in routes:
            names = [link.name for link in route]
            figure = trajectories_figure(self._network, self._passages, names, duration, figsize)
            figures.append(self._finish(figure, f"tsd_traj_{'-'.join(names)}"))
        return figures

    def _check_looks(self, looks: dict[str, Any]) -> None:
        for name in looks:
            if name not in LOOKS:
                raise TypeError(options.absent("a map", name, LOOKS))

    def _finish(self, figure: Figure, name: str) -> Figure:
        """Save and show a figure, as the world says."""
        from uxsim_geo.export.plots import save_figure

        if self.W.save_mode:
            self._folder.mkdir(parents=True, exist_ok=True)
            safe = "".join(sign if sign.isalnum() or sign in "-_." else "_" for sign in name)
            save_figure(figure, self._folder / f"{safe[:LONGEST_NAME]}.png")
        if self.W.show_mode and "IPython" in sys.modules:
            import_module("IPython.display").display(figure)
        return figure

    def _path_of(self, file_name: str | None, name: str) -> Path:
        path = self._folder / name if file_name is None else Path(file_name)
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

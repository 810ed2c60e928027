"""What ``W.analyzer`` offers: tables, figures and statistics of a world's result so far."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.link_states import bin_edges, link_times, link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Samples, cells_of_link
from uxsim_geo.analysis.summary import summary
from uxsim_geo.world import options, printing, tables
from uxsim_geo.world.links import Link

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result
    from uxsim_geo.world.world import World

#: one link, by name or itself
AnyLink = Link | str

#: letters of a file's name; file systems take some 255 bytes
LONGEST_NAME = 120

#: looks of UXsim's maps that are passed over: these maps are drawn in one way
LOOKS = frozenset(
    {"detailed", "legend", "legend_outside", "left_handed", "maxwidth", "minwidth"}
    | {"network_font_size", "node_size", "state_variables"}
)


class Analyzer:
    """Looks at the result of a world up to where its simulation stands.

    Figures are returned, saved to the folder ``out<name>`` where ``save_mode`` says so, and shown
    in notebooks where ``show_mode`` does. States are averages over time bins of the world's
    ``eular_dt``.

    Raises RuntimeError before anything has been simulated.
    """

    def __init__(self, world: World) -> None:
        if world.TIME <= 0:
            raise RuntimeError("nothing has been simulated yet: call exec_simulation() first")
        self.W = world
        now = replace(world.result.settings, duration=world.TIME)
        self._result: Result = replace(world.result, settings=now)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(options.absent("Analyzer", name, dir(type(self))))

    @property
    def _network(self) -> Network:
        return self.W.network

    @cached_property
    def _states(self) -> pd.DataFrame:
        result = self._result
        bin_s = min(self.W.EULAR_DT, result.settings.duration)
        return link_times(self._network, result.events, result.trips, result.settings, bin_s)

    @cached_property
    def _passages(self) -> Passages:
        result = self._result
        return Passages.of(self._network, result.events, result.trips, result.settings)

    @cached_property
    def _samples(self) -> Samples:
        return Samples.of(self._passages, self.W.DELTAT, self._result.settings.duration)

    # statistics and tables

    def print_simple_stats(self, force_print: bool = False) -> None:
        """Print the main figures; without ``print_mode`` only if forced."""
        if self.W.print_mode or force_print:
            printing.print_statistics(self.statistics())

    def statistics(self) -> dict[str, Any]:
        """Return the figures of the run so far: :func:`uxsim_geo.analysis.summary.summary`."""
        return summary(self._network, self._result)

    def basic_to_pandas(self) -> pd.DataFrame:
        """One row of figures: :func:`uxsim_geo.world.tables.basic_table`."""
        return tables.basic_table(self.statistics())

    def od_to_pandas(self) -> pd.DataFrame:
        """One row a pair: :func:`uxsim_geo.world.tables.od_table`."""
        return tables.od_table(self._network, self._result)

    def link_to_pandas(self) -> pd.DataFrame:
        """One row a link: :func:`uxsim_geo.world.tables.link_table`."""
        return tables.link_table(self._network, self._result)

    def mfd_to_pandas(self) -> pd.DataFrame:
        """One row a time bin: :func:`uxsim_geo.world.tables.mfd_table`."""
        return tables.mfd_table(network_states(self._network, self._states))

    def vehicle_trip_to_pandas(self) -> pd.DataFrame:
        """One row a platoon: :func:`uxsim_geo.world.tables.trip_table`."""
        return tables.trip_table(self._result)

    def vehicles_to_pandas(self) -> pd.DataFrame:
        """Where every platoon was at every time step: link, x (m from its start), v (m/s)."""
        return tables.sample_table(self._network, self._result, self._passages, self._samples)

    def link_traffic_state_to_pandas(self) -> pd.DataFrame:
        """Flow (veh/s), density (veh/m) and speed (m/s) by link, time bin and tenth of the link."""
        rows = [
            tables.cell_table(
                link.name, cells_of_link(self._passages, self._samples, link.id, edges)
            )
            for link in self.W.LINKS
            if (edges := self._cell_edges(link))
        ]
        return pd.concat(rows, ignore_index=True)

    def output_data(self, fname: str | None = None) -> None:
        """Write all tables to CSV files whose names begin with ``fname``."""
        begin = Path(fname) if fname is not None else self._folder / "data"
        begin.parent.mkdir(parents=True, exist_ok=True)
        for name, table in (
            ("basic", self.basic_to_pandas()),
            ("od", self.od_to_pandas()),
            ("mfd", self.mfd_to_pandas()),
            ("link", self.link_to_pandas()),
            ("link_traffic_state", self.link_traffic_state_to_pandas()),
            ("vehicles", self.vehicles_to_pandas()),
        ):
            table.to_csv(begin.with_name(f"{begin.name}_{name}.csv"), index=False)

    # figures

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
        return self._finish(mfd_figure(network_states(network, states), title), f"mfd{fname}")

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

    def _links(self, links: AnyLink | Iterable[AnyLink] | None) -> list[Link]:
        if links is None:
            return self.W.LINKS
        chosen = [links] if isinstance(links, Link | str) else list(links)
        return [self.W.get_link(link) for link in chosen]

    def _cell_edges(self, link: Link) -> tuple[Any, Any]:
        """Edges of cells: time bins, and tenths of the link that a step cannot jump over."""
        duration = self._result.settings.duration
        longest = max(link.length / 10, link.free_flow_speed * self.W.DELTAT)
        cells = max(1, int(link.length // longest))
        bins = bin_edges(duration, min(self.W.EULAR_DT, duration))
        return bins, np.linspace(0.0, link.length, cells + 1)

    @property
    def _folder(self) -> Path:
        return Path(f"out{self.W.name}")

    def _check_looks(self, looks: dict[str, Any]) -> None:
        for name in looks:
            if name not in LOOKS | {"figsize"}:
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

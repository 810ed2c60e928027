"""What ``W.analyzer`` offers: statistics, tables and figures of a world's result so far."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.link_states import link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.summary import summary
from uxsim_geo.analysis.trajectories import trajectories
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.world import area_tables, pictures, printing, tables, vehicle_tables
from uxsim_geo.world.figures import Figures
from uxsim_geo.world.nodes import Node
from uxsim_geo.world.sight import AnyLink
from uxsim_geo.world.vehicles import Vehicle


class Analyzer(Figures):
    """Looks at the result of a world up to where its simulation stands.

    States are averages over time bins of the world's ``eular_dt``. Every table has UXsim's columns;
    what is defined better here comes in further ones. Raises RuntimeError before anything has been
    simulated.
    """

    def print_simple_stats(self, force_print: bool = False) -> None:
        """Print the main figures; without ``print_mode`` only if forced."""
        if self.W.print_mode or force_print:
            printing.print_statistics(self.statistics())

    def statistics(self) -> dict[str, Any]:
        """Return the figures of the run so far: :func:`uxsim_geo.analysis.summary.summary`."""
        return summary(self._result, self._network)

    def basic_to_pandas(self) -> pd.DataFrame:
        """One row of figures: :func:`uxsim_geo.world.tables.basic_table`."""
        return tables.basic_table(self.statistics())

    def od_to_pandas(self) -> pd.DataFrame:
        """One row a pair: :func:`uxsim_geo.world.tables.od_table`."""
        return tables.od_table(self._network, self._trips, self._result.settings.duration)

    def link_to_pandas(self) -> pd.DataFrame:
        """One row a link: :func:`uxsim_geo.world.tables.link_table`."""
        return tables.link_table(self._network, self._result, link_totals(self._states))

    def link_cumulative_to_pandas(self) -> pd.DataFrame:
        """One row a link and time step: :func:`uxsim_geo.world.tables.cumulative_table`."""
        return tables.cumulative_table(self._passages, self._states_of_bins(self.W.DELTAT))

    def link_traffic_state_to_pandas(self) -> pd.DataFrame:
        """Flow (veh/s), density (veh/m) and speed (m/s) by link, time bin and tenth of the link."""
        duration = self._result.settings.duration
        cells = space_time_cells(
            self._result,
            self._network,
            bin_s=min(self.W.EULAR_DT, duration),
            cell_m=[self._cell_size(link) for link in self.W.LINKS],
            passages=self._passages,
        )
        return tables.cell_table(cells)

    def mfd_to_pandas(self, links: Iterable[AnyLink] | None = None) -> pd.DataFrame:
        """One row a time bin, of the network or some links: flow and density per lane."""
        return tables.mfd_table(network_states(self._states_of_links(links), self._network))

    def vehicle_trip_to_pandas(self) -> pd.DataFrame:
        """One row a platoon: :func:`uxsim_geo.world.tables.trip_table`."""
        return tables.trip_table(self._trips, self._names)

    def vehicles_to_pandas(self) -> pd.DataFrame:
        """One row a platoon and time step: :func:`uxsim_geo.world.vehicle_tables.log_table`."""
        return vehicle_tables.log_table(
            self._network, self._result, self._passages, self._samples, self._names
        )

    def log_vehicles_to_pandas(self) -> pd.DataFrame:
        """As :meth:`vehicles_to_pandas`, by its older name."""
        return self.vehicles_to_pandas()

    def gps_like_log_to_pandas(self) -> pd.DataFrame:
        """One row a platoon and time step: :func:`uxsim_geo.world.vehicle_tables.gps_table`."""
        moments = np.arange(0.0, self._result.settings.duration, self.W.DELTAT)
        where = trajectories(self._result, self._network, times=moments)
        return vehicle_tables.gps_table(where, self._names)

    def vehicle_groups_to_pandas(
        self, groups: Sequence[Iterable[Vehicle | str]], group_names: Sequence[str] | None = None
    ) -> pd.DataFrame:
        """One row a group of vehicles: :func:`uxsim_geo.world.vehicle_tables.group_table`."""
        rows = [
            [self._row_of_vehicle(one.name if isinstance(one, Vehicle) else one) for one in group]
            for group in groups
        ]
        names = group_names or [f"group {number}" for number in range(len(rows))]
        if len(set(names)) != len(rows):
            what = f"must be a name of its own for each of {len(rows)} groups"
            raise InputError([Fault(what, column="group_names", value=list(names))])
        trips = self._trips
        pairs = tables.shortest_distances(self._network, trips["origin"].unique().astype(str))
        ends = (
            index.get_indexer(pd.Index(trips[name].astype(str)))
            for index, name in ((pairs.index, "origin"), (pairs.columns, "destination"))
        )
        shortest = pairs.to_numpy()[tuple(ends)]
        return vehicle_tables.group_table(dict(zip(names, rows, strict=True)), trips, shortest)

    def area_to_pandas(
        self,
        areas: Sequence[Iterable[Node | str]],
        area_names: Sequence[str] | None = None,
        border_include: bool = True,
    ) -> pd.DataFrame:
        """One row an area, a set of nodes: :func:`uxsim_geo.world.area_tables.area_table`."""
        return area_tables.area_table(
            self._network,
            self._result,
            self.link_to_pandas(),
            self._areas(areas, area_names),
            border=border_include,
        )

    def areas2areas_to_pandas(
        self, areas: Sequence[Iterable[Node | str]], area_names: Sequence[str] | None = None
    ) -> pd.DataFrame:
        """One row a pair of areas: :func:`uxsim_geo.world.area_tables.area_pair_table`."""
        return area_tables.area_pair_table(self.od_to_pandas(), self._areas(areas, area_names))

    def output_data(self, fname: str | None = None) -> None:
        """Write tables to CSV files whose names begin with ``fname``: those that UXsim writes.

        They are basic, od, mfd, link, link_traffic_state and vehicles.
        """
        begin = Path(fname) if fname is not None else pictures.folder(self.W) / "data"
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

    @property
    def trip_all(self) -> float:
        """Vehicles that have departed."""
        return float(self._basic["total_trips"])

    @property
    def trip_completed(self) -> float:
        """Vehicles that have arrived."""
        return float(self._basic["completed_trips"])

    @property
    def total_travel_time(self) -> float:
        """Of those that have arrived, veh·s."""
        return float(self._basic["total_travel_time"])

    @property
    def average_travel_time(self) -> float:
        """Of those that have arrived, s."""
        return float(self._basic["average_travel_time"])

    @property
    def total_delay(self) -> float:
        """Of those that have arrived, veh·s."""
        return float(self._basic["total_delay"])

    @property
    def average_delay(self) -> float:
        """Of those that have arrived, s."""
        return float(self._basic["average_delay"])

    @property
    def total_distance_traveled(self) -> float:
        """Of all, veh·m."""
        return float(self.statistics()["total_distance_veh_m"])

    @cached_property
    def _basic(self) -> pd.Series[Any]:
        return self.basic_to_pandas().iloc[0]

    @cached_property
    def _trips(self) -> pd.DataFrame:
        return trip_summary(self._result, self._network)

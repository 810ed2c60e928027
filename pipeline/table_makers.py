"""Every table that can be exported from a finished run, and what each of them goes by."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from pipeline.table_options import TableOptions
from uxsim_geo.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.config import Config
    from pipeline.material import Material
    from uxsim_geo.analysis.observed import Comparison
    from uxsim_geo.analysis.selection import UserFlows
    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result


@dataclass(frozen=True)
class FinishedRun:
    """What tables are made of: a run, and what somebody asks of it.

    notes
        what to know of the table that is made
    """

    material: Material
    options: TableOptions
    notes: list[str] = field(default_factory=list)

    @property
    def config(self) -> Config:
        """As the run was told."""
        return self.material.config

    @property
    def network(self) -> Network:
        """Where it took place."""
        return self.material.network

    @property
    def result(self) -> Result:
        """What it left."""
        return self.material.result

    @property
    def bin_s(self) -> float:
        """Time bins of a table that cannot be without, s: as asked, else those of the report."""
        asked = self.options.bin_s
        return self.config.report.bin_s if asked is None else asked

    @cached_property
    def states(self) -> pd.DataFrame:
        """The links asked for, or all, in all bins, which must not be too many."""
        self.check_bins()
        return self.material.states_in(self.bin_s, self.options.links)

    def check_bins(self) -> None:
        """Refuse a table of the links asked for in all bins that would have too many rows."""
        from pipeline.material import faults_of_bins

        asked, duration = self.options.links, self.result.settings.duration
        links = len(self.network.links if asked is None else set(asked))
        if faults := list(faults_of_bins("--bin-s", self.bin_s, duration, links)):
            raise InputError(faults)


def _summary(run: FinishedRun) -> pd.DataFrame:
    """The figures of the run, a row each."""
    from uxsim_geo.analysis.summary import summary

    figures = summary(run.result, run.network)
    completed = figures.pop("completed")
    rows = figures | {f"completed_{name}": value for name, value in completed.items()}
    return _figures(rows)


def _figures(figures: dict[str, Any]) -> pd.DataFrame:
    """One row a figure, as text; null: there is none."""
    import pandas as pd

    texts = [None if pd.isna(value) else str(value).lower() for value in figures.values()]
    return pd.DataFrame({"figure": list(figures), "value": pd.Series(texts, dtype="str")})


def _od(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.od import od_table

    by_class = run.result.trips["class"].nunique() > 1
    bin_s = run.options.bin_s
    return od_table(run.result, run.network, bin_s=bin_s, by_class=by_class)


def _trips(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.trips import trip_summary

    return trip_summary(run.result, run.network)


def _trip_routes(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.trips import trip_routes

    return trip_routes(run.result)


def _turning_counts(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.turns import turning_counts

    return turning_counts(run.result, run.network, bin_s=run.options.bin_s)


def _links(run: FinishedRun) -> pd.DataFrame:
    """As the layer of that name, without geometry."""
    import pandas as pd

    from uxsim_geo.export.layers import links_layer

    layer = links_layer(run.network, run.states, run.result.settings.reaction_time)
    return pd.DataFrame(layer.drop(columns="geometry", errors="ignore"))


def _link_times(run: FinishedRun) -> pd.DataFrame:
    """As the layer of that name, with times in seconds after the start."""
    from uxsim_geo.export.layers import link_times_layer
    from uxsim_geo.export.run_description import origin_of

    table = link_times_layer(run.network, run.states, origin_of(run.config.report.start))
    table.insert(1, "begin_s", run.states["begin_s"])
    table.insert(2, "end_s", run.states["end_s"])
    return table.drop(columns=["begin", "end"])


def _cells(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.cells import space_time_cells
    from uxsim_geo.export.units import in_peoples_units

    cells = space_time_cells(
        run.result,
        run.network,
        bin_s=run.bin_s,
        cell_m=100.0 if run.options.cell_m is None else run.options.cell_m,
        links=run.options.links,
    )
    return in_peoples_units(cells)


def _network_states(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.network_states import network_states
    from uxsim_geo.export.units import in_peoples_units

    return in_peoples_units(network_states(run.states, run.network), per_lane=True)


def _area_states(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.areas import area_states, links_in_polygons
    from uxsim_geo.export.units import in_peoples_units

    states = area_states(run.states, run.network, _areas(run, links_in_polygons, "link"))
    return in_peoples_units(states, per_lane=True)


def _area_pairs(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.areas import area_pairs, nodes_in_polygons

    return area_pairs(run.result, run.network, _areas(run, nodes_in_polygons, "node"))


def _areas(
    run: FinishedRun, find: Callable[..., dict[str, list[str]]], kind: str
) -> dict[str, list[str]]:
    """The areas asked for that hold something; others are noted."""
    from pipeline.polygons import PolygonFile, areas_in

    assert run.options.areas is not None
    filled, empty = areas_in(run.network, PolygonFile("--areas", run.options.areas), find, kind)
    if empty:
        run.notes.append(f"no {kind} lies in {', '.join(empty)}: left out")
    return filled


def _vehicles_over_time(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.bins import bin_edges
    from uxsim_geo.analysis.vehicles_over_time import vehicles_over_time

    return vehicles_over_time(run.result, bin_edges(run.result.settings.duration, run.bin_s))


def _skims(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.skims import skims

    return skims(run.result, run.network, bin_s=run.bin_s, states=run.states)


def _cumulative(run: FinishedRun) -> pd.DataFrame:
    """The curves of links, one link after the other, at the edges of the bins."""
    import numpy as np
    import pandas as pd

    from uxsim_geo.analysis.bins import bin_edges
    from uxsim_geo.analysis.cumulative import curves_of_passages
    from uxsim_geo.analysis.subsets import rows_of_links

    run.check_bins()
    rows = rows_of_links(run.network, run.options.links)
    edges = bin_edges(run.result.settings.duration, run.bin_s)
    curves = [
        curves_of_passages(passages, int(link), edges)
        for some, passages in run.material.passages.blocks(rows)
        for link in some
    ]
    table = pd.concat(curves, ignore_index=True)
    ids = run.network.links["link_id"].astype(str).to_numpy()[rows]
    table.insert(0, "link_id", np.repeat(ids, len(edges)))
    return table


def _trajectories(run: FinishedRun) -> pd.DataFrame:
    from uxsim_geo.analysis.trajectories import trajectories
    from uxsim_geo.export.units import in_peoples_units

    step = 10.0 if run.options.step_s is None else run.options.step_s
    table = trajectories(run.result, run.network, step_s=step, links=run.options.links)
    return in_peoples_units(table)


def _by_links(run: FinishedRun) -> UserFlows:
    from uxsim_geo.analysis.selection import select_link

    assert run.options.links is not None
    return select_link(run.result, run.network, run.options.links)


def _by_zones(run: FinishedRun) -> UserFlows:
    from uxsim_geo.analysis.selection import select_zone

    assert run.options.zones is not None
    return select_zone(run.result, run.network, run.options.zones)


def _counts(run: FinishedRun) -> Comparison:
    from uxsim_geo.analysis.observations import read_counts
    from uxsim_geo.analysis.observed import compare_counts

    assert run.options.observed is not None
    return compare_counts(read_counts(run.options.observed), run.states)


def _travel_times(run: FinishedRun) -> Comparison:
    from uxsim_geo.analysis.observations import read_travel_times
    from uxsim_geo.analysis.observed import compare_travel_times

    assert run.options.observed is not None
    observed = read_travel_times(run.options.observed)
    simulated = run.states if "link_id" in observed else _skims(run)
    return compare_travel_times(observed, simulated)


class Table(NamedTuple):
    """The function that makes a table of a run, and the options that it takes and needs."""

    make: Callable[[FinishedRun], pd.DataFrame]
    takes: frozenset[str] = frozenset()
    needs: frozenset[str] = frozenset()


def _table(make: Callable[[FinishedRun], pd.DataFrame], takes: str = "", needs: str = "") -> Table:
    needed = frozenset(needs.split())
    return Table(make, frozenset(takes.split()) | needed, needed)


#: by the name that a user gives
TABLES = {
    "summary": _table(_summary),
    "od": _table(_od, "bin_s"),
    "trips": _table(_trips),
    "trip_routes": _table(_trip_routes),
    "turning_counts": _table(_turning_counts, "bin_s"),
    "links": _table(_links, "bin_s"),
    "link_times": _table(_link_times, "bin_s"),
    "cells": _table(_cells, "bin_s cell_m links"),
    "network_states": _table(_network_states, "bin_s links"),
    "area_states": _table(_area_states, "bin_s", "areas"),
    "area_pairs": _table(_area_pairs, needs="areas"),
    "vehicles_over_time": _table(_vehicles_over_time, "bin_s"),
    "skims": _table(_skims, "bin_s"),
    "cumulative": _table(_cumulative, "bin_s links"),
    "trajectories": _table(_trajectories, "step_s links"),
    "link_users": _table(lambda run: _by_links(run).users, needs="links"),
    "link_user_flows": _table(lambda run: _by_links(run).links, needs="links"),
    "link_user_pairs": _table(lambda run: _by_links(run).pairs, needs="links"),
    "zone_users": _table(lambda run: _by_zones(run).users, needs="zones"),
    "zone_user_flows": _table(lambda run: _by_zones(run).links, needs="zones"),
    "zone_user_pairs": _table(lambda run: _by_zones(run).pairs, needs="zones"),
    "counts": _table(lambda run: _counts(run).table, "bin_s", "observed"),
    "counts_fit": _table(lambda run: _figures(_counts(run).figures), "bin_s", "observed"),
    "travel_times": _table(lambda run: _travel_times(run).table, "bin_s", "observed"),
    "travel_times_fit": _table(
        lambda run: _figures(_travel_times(run).figures), "bin_s", "observed"
    ),
}

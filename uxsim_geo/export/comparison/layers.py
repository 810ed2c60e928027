"""The tables of ``comparison.gpkg``, with columns as :mod:`..columns` says them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison
from uxsim_geo.export.columns import Layer
from uxsim_geo.export.comparison.columns import (
    LINK_TIMES_LAYER,
    LINKS_LAYER,
    OD_LAYER,
    OF_ALL,
)
from uxsim_geo.export.comparison.study import Scenario, Study, comparison_of, joined_network
from uxsim_geo.export.layers import instants, run_info_layer
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH, PER_KM

#: pairs of a layer, those whose total delay changes most
MOST_PAIRS = 3000


def links_layer(base: Network, scenario: Scenario) -> pd.DataFrame:
    """Links of base and scenario; lines where the base has geometry."""
    found = comparison_of(scenario).links
    joined = joined_network(base, [scenario.network]).links
    rows = pd.Index(joined["link_id"].astype(str)).get_indexer(pd.Index(found["link_id"]))
    links = joined.iloc[rows].reset_index(drop=True)
    layer = pd.DataFrame({"link_id": found["link_id"].astype(str)})
    for name in ("from_node_id", "to_node_id", "name", "ref", "road_class"):
        given = links[name] if name in links else pd.Series(pd.NA, index=links.index)
        layer[name] = given.astype("string")
    layer["length_m"], layer["lanes"] = links["length"], links["lanes"]
    layer["free_speed_kmh"] = links["free_speed"] * KMH
    layer["jam_density_vpkm_per_lane"] = links["jam_density"] * PER_KM
    layer = _chosen(pd.concat([layer, found.drop(columns="link_id")], axis=1), LINKS_LAYER)
    return _on_map(layer, links["geometry"].to_numpy(), base) if "geometry" in links else layer


@dataclass(frozen=True)
class LinkTimes:
    """Links in time bins on the clock that shows ``start`` at 0 s."""

    comparison: Comparison
    start: datetime

    @property
    def bins(self) -> pd.DataFrame:
        """Begin and end of every bin; they end a second before the next, for maps of one bin."""
        times = self.comparison.link_times[["begin_s", "end_s"]].drop_duplicates(ignore_index=True)
        return self._on_clock(times)[["begin", "end"]]

    def parts(self) -> Iterator[pd.DataFrame]:
        """All of them at once, link by link."""
        yield _chosen(self._on_clock(self.comparison.link_times), LINK_TIMES_LAYER)

    def _on_clock(self, table: pd.DataFrame) -> pd.DataFrame:
        end = instants(table["end_s"], self.start - timedelta(seconds=1))
        return table.assign(begin=instants(table["begin_s"], self.start), end=end)


def od_layer(base: Network, scenario: Scenario) -> pd.DataFrame:
    """The pairs of nodes whose total delay changes most, as lines where nodes have places."""
    import shapely

    table = comparison_of(scenario).od
    change = table["delay_veh_h_difference"].abs().fillna(-1.0)
    order = np.argsort(-change.to_numpy(), kind="stable")[:MOST_PAIRS]
    layer = _chosen(table.iloc[np.sort(order)].reset_index(drop=True), OD_LAYER)
    nodes = joined_network(base, [scenario.network]).nodes
    if "geometry" not in nodes:
        return layer
    ids = pd.Index(nodes["node_id"].astype(str))
    places = shapely.get_coordinates(nodes["geometry"].to_numpy())
    ends = [ids.get_indexer(pd.Index(layer[end])) for end in ("origin", "destination")]
    placed = (ends[0] >= 0) & (ends[1] >= 0) & (ends[0] != ends[1])
    lines = np.full(len(layer), None, object)
    pairs = np.stack([places[end[placed]] for end in ends], axis=1)
    lines[placed] = shapely.linestrings(pairs)
    return _on_map(layer, lines, base)


def tables_of_all(study: Study) -> dict[str, pd.DataFrame]:
    """Tables without geometry, of all scenarios together, by name."""
    edits = [(entry.name, edit) for entry in study.scenarios for edit in entry.edits]
    return {
        "totals": _of_all(study, "totals", _totals),
        "winners": _of_all(study, "winners", lambda found: found.trips),
        "corridors": _of_all(study, "corridors", lambda found: found.corridors),
        "zones": _of_all(study, "zones", lambda found: found.zones),
        "edits": pd.DataFrame(edits, columns=["scenario", "edit"], dtype="string"),
        "study_info": run_info_layer(information_of(study)),
    }


def information_of(study: Study) -> dict[str, object]:
    """Facts of the study, its seeds, remarks and failed runs."""
    told: dict[str, object] = dict(study.about.information)
    for entry in study.compared:
        found = comparison_of(entry)
        told[f"seeds of {entry.name}"] = seeds_in_words(found)
        for number, remark in enumerate(found.remarks, start=1):
            told[f"remark {number} on {entry.name}"] = remark
    for run in study.failed:
        told[f"failed: {run.scenario}, seed {run.seed}"] = run.reason
    return told


def seeds_in_words(comparison: Comparison) -> str:
    """Seeds of the pairs; where those of a pair differ, both."""
    return ", ".join(
        str(base) if base == scenario else f"{base}/{scenario}"
        for base, scenario in comparison.seeds
    )


def _totals(comparison: Comparison) -> pd.DataFrame:
    return comparison.totals.rename(columns={"scenario": "scenario_value"})


def _of_all(
    study: Study, name: str, table_of: Callable[[Comparison], pd.DataFrame]
) -> pd.DataFrame:
    """One table of all scenarios, with their names in front."""
    tables = []
    for entry in study.compared:
        table = table_of(comparison_of(entry))
        names = pd.Series([entry.name] * len(table), index=table.index, dtype="string")
        tables.append(_chosen(table.assign(scenario=names), OF_ALL[name]))
    columns = [column.name for column in OF_ALL[name].columns]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=columns)


def _chosen(table: pd.DataFrame, layer: Layer) -> pd.DataFrame:
    """The columns of a layer in their order."""
    return table[[column.name for column in layer.columns]]


def _on_map(layer: pd.DataFrame, lines: object, base: Network) -> pd.DataFrame:
    import geopandas as gpd

    crs = getattr(base.links, "crs", None)
    spatial: pd.DataFrame = gpd.GeoDataFrame(layer, geometry=lines, crs=crs)
    return spatial

"""The tables of the GeoPackage: people's units, with the unit in the name of every column."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np
import pandas as pd

from uxsim_geo.analysis.link_states import link_totals
from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.columns import LAYERS
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import NODE_COLUMNS, NOTE_COLUMNS, Network
from uxsim_geo.network.note_words import note_in_words
from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM

#: rows of link_times that are made together
AT_ONCE = 1_000_000


def nodes_layer(network: Network) -> pd.DataFrame:
    """The nodes table, with geometry if the network has one."""
    return _with_geometry(network.nodes[list(NODE_COLUMNS)].copy(), network.nodes)


def links_layer(
    network: Network, states: States, reaction_time: float | None = None
) -> pd.DataFrame:
    """The links table with its attributes and the figures of the whole run.

    ``states`` come from :mod:`uxsim_geo.analysis.link_states`. volume_veh are the
    vehicles that entered; delay_s is the mean over those who left, delay_veh_s the sum over all;
    queue_veh and queue_m are the largest at the end of a time bin. capacity_vph is the given one,
    effective_capacity_vph what holds: the lower of that and the diagram's for ``reaction_time`` in
    seconds (empty where that is None).

    Raises :class:`uxsim_geo.errors.InputError` unless states are those of all links in all bins.
    """
    StateGrid.of_all(states, network)
    links, totals = network.links.reset_index(drop=True), link_totals(states)
    layer = links[["link_id", "from_node_id", "to_node_id", "name"]].copy()
    layer["ref"] = links["ref"] if "ref" in links else pd.array([pd.NA] * len(links), "string")
    layer["road_class"] = links["road_class"]
    layer["length_m"] = links["length"]
    layer["lanes"] = links["lanes"]
    layer["free_speed_kmh"] = links["free_speed"] * KMH
    layer["jam_density_vpkm_per_lane"] = links["jam_density"] * PER_KM
    layer["capacity_vph"] = links["capacity"].astype(float) * PER_HOUR
    layer["effective_capacity_vph"] = _effective_capacity(links, reaction_time) * PER_HOUR
    for column in ("merge_priority", "lanes_source", "free_speed_source", "source_id"):
        layer[column] = links[column]
    layer["volume_veh"] = totals["volume"]
    _add_speed_and_delay(layer, totals, links)
    _add_fullness(layer, totals)
    return _with_geometry(layer, links)


def link_times_layer(network: Network, states: pd.DataFrame, start: datetime) -> pd.DataFrame:
    """One row a link and time bin; begin and end on the clock that shows ``start`` at 0 s.

    end lies one second before the next begin, so that a temporal map shows one bin at a time; a bin
    of a second or less, as the last one may be, ends where it begins.

    Raises :class:`uxsim_geo.errors.InputError` unless states are those of all links in all bins.
    """
    bins = len(StateGrid.of_all(states, network).begin)
    links = pd.DataFrame(
        {
            name: np.repeat(network.links[name].array, bins)
            for name in ("link_id", "length", "free_speed")
        }
    )
    layer = pd.DataFrame({"link_id": links["link_id"].astype(str)})
    layer[["begin", "end"]] = _times(states, start)
    layer["flow_vph"] = states["flow"] * PER_HOUR
    layer["density_vpkm"] = states["density"] * PER_KM
    layer["entries_veh"] = states["entries"]
    layer["exits_veh"] = states["exits"]
    _add_speed_and_delay(layer, states, links)
    _add_fullness(layer, states)
    layer["instantaneous_travel_time_s"] = states["instantaneous_travel_time"]
    return layer


@dataclass(frozen=True)
class LinkTimes:
    """The layer link_times: the tables of some of its bins, which together may not fit in memory.

    Made by :meth:`of`; ``grid`` are the states of all links in all bins.
    """

    network: Network
    grid: StateGrid
    start: datetime

    @classmethod
    def of(cls, network: Network, states: States, start: datetime) -> LinkTimes:
        """Raises :class:`uxsim_geo.errors.InputError` unless states are of all links and bins."""
        return cls(network, StateGrid.of_all(states, network), start)

    def __len__(self) -> int:
        return len(self.grid.link_ids) * len(self.grid.begin)

    @property
    def columns(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(column.name for column in LAYERS["link_times"].columns)

    @property
    def bins(self) -> pd.DataFrame:
        """Begin and end of every bin, as in the layer."""
        times = pd.DataFrame({"begin_s": self.grid.begin, "end_s": self.grid.end})
        return _times(times, self.start)

    def delay(self) -> Floats:
        """The column delay_veh_s; shape (links, bins)."""
        return self.grid.values("delay")

    def table(self, bins: slice = slice(None)) -> pd.DataFrame:
        """The rows of some bins, link by link."""
        return link_times_layer(self.network, self.grid.table_of(bins), self.start)

    def parts(self) -> Iterator[pd.DataFrame]:
        """Tables of some bins after the other, of about :data:`AT_ONCE` rows each."""
        together = max(AT_ONCE // max(len(self.grid.link_ids), 1), 1)
        for first in range(0, len(self.grid.begin), together):
            yield self.table(slice(first, first + together))


def notes_layer(notes: pd.DataFrame) -> pd.DataFrame:
    """What the import assumed or repaired, all as text, and where if the notes have places."""
    layer = notes.reindex(columns=list(NOTE_COLUMNS)).astype("string").reset_index(drop=True)
    said = zip(layer["note"], layer["value"], strict=True)
    words = [note if pd.isna(note) else note_in_words(note, value) for note, value in said]
    layer["note"] = pd.Series(words, dtype="string")
    return _with_geometry(layer, notes)


def run_info_layer(information: Mapping[str, object]) -> pd.DataFrame:
    """Names and values, in the given order, all as text."""
    return pd.DataFrame(
        {
            "item": pd.Series(list(information), dtype="string"),
            "value": pd.Series([str(value) for value in information.values()], dtype="string"),
        }
    )


def _effective_capacity(links: pd.DataFrame, reaction_time: float | None) -> pd.Series:
    """The capacity that holds, veh/s; null where the reaction time is not known."""
    if reaction_time is None:
        return pd.Series(np.nan, index=links.index)
    return pd.Series(effective_capacity(links, reaction_time), index=links.index)


def _add_speed_and_delay(layer: pd.DataFrame, figures: pd.DataFrame, links: pd.DataFrame) -> None:
    """Columns that bins and the whole run share; null where nobody was there to measure."""
    free_time = links["length"] / links["free_speed"]
    late = figures["experienced_travel_time"] - free_time
    layer["speed_kmh"] = figures["speed"] * KMH
    layer["speed_ratio"] = figures["speed"] / links["free_speed"]
    layer["experienced_travel_time_s"] = figures["experienced_travel_time"]
    layer["delay_s"] = np.maximum(late, 0.0)  # rounding may leave -1e-14
    layer["delay_veh_s"] = figures["delay"]


def _add_fullness(layer: pd.DataFrame, figures: pd.DataFrame) -> None:
    """Columns that tell how near to full links are."""
    layer["queue_veh"] = figures["queue"]
    layer["queue_m"] = figures["queue_length"]
    layer["spillback_share"] = figures["spillback_share"]
    layer["volume_to_capacity"] = figures["volume_to_capacity"]


def _times(states: pd.DataFrame, start: datetime) -> pd.DataFrame:
    """Columns begin and end of begin_s and end_s."""
    begin = states["begin_s"]
    end = (states["end_s"] - 1.0).clip(lower=begin)
    return pd.DataFrame({"begin": instants(begin, start), "end": instants(end, start)})


def instants(seconds: pd.Series, start: datetime) -> pd.Series:
    """UTC date-times, whole milliseconds, of seconds after ``start``."""
    begin = pd.Timestamp(start).tz_convert("UTC")
    milliseconds = pd.to_timedelta((seconds * 1000).round(), unit="ms")
    return (begin + milliseconds).astype("datetime64[ms, UTC]")


def _with_geometry(layer: pd.DataFrame, table: pd.DataFrame) -> pd.DataFrame:
    """The layer as a GeoDataFrame if the table has geometry."""
    if "geometry" not in table.columns:
        return layer
    import geopandas as gpd

    geometry = table["geometry"].to_numpy()
    spatial: pd.DataFrame = gpd.GeoDataFrame(
        layer, geometry=geometry, crs=getattr(table, "crs", None)
    )
    return spatial

"""From trips between zones to trips between nodes, and over time."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.demand.demand import DEMAND_COLUMNS
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.reachable import reachable_pairs
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import is_among


def zone_nodes(network: Network, end: str) -> pd.DataFrame:
    """The nodes at which trips of each zone may start (``end`` origin) or end (destination).

    Columns ``{end}_zone`` and ``{end}`` (node_id). They come from the nodes' origin_of or
    destination_of (zones, blanks between), else zone_id; in a network without zones every node
    is its own.
    """
    nodes = network.nodes
    column = next((name for name in (f"{end}_of", "zone_id") if name in nodes), "node_id")
    if nodes[column].isna().all():
        column = "node_id"
    zones = nodes[column].astype("str").str.split()
    pairs = pd.DataFrame({f"{end}_zone": zones, end: nodes["node_id"]})
    return pairs.explode(f"{end}_zone").dropna().astype("str").reset_index(drop=True)


def zone_trips_at_nodes(trips: pd.DataFrame, network: Network, notes: Notes) -> pd.DataFrame:
    """Spread trips between zones evenly over the pairs of their nodes that a path connects.

    ``trips``: origin_zone, destination_zone, trips; returns origin, destination (node_id), trips,
    in the same order. Where no pair is connected all pairs have their part and a note says so;
    trips between zones that share their only node are left out and counted.
    """
    pairs = (
        trips.assign(row=np.arange(len(trips)))
        .merge(zone_nodes(network, "origin"), on="origin_zone")
        .merge(zone_nodes(network, "destination"), on="destination_zone")
        .sort_values("row", kind="stable", ignore_index=True)
    )
    pairs = pairs[pairs["origin"] != pairs["destination"]].reset_index(drop=True)
    _note_lost(trips, pairs["row"], notes)
    connected = pd.Series(reachable_pairs(network, pairs["origin"], pairs["destination"]))
    some = connected.groupby(pairs["row"]).transform("any")
    _note_unreachable(pairs[~some], notes)
    pairs = pairs[connected | ~some]
    parts = pairs.groupby("row")["row"].transform("size")
    pairs = pairs.assign(trips=pairs["trips"] / parts)
    return pairs[["origin", "destination", "trips"]].reset_index(drop=True)


def _note_lost(trips: pd.DataFrame, rows: pd.Series, notes: Notes) -> None:
    lost = float(trips.loc[~np.isin(np.arange(len(trips)), rows), "trips"].sum())
    if lost > 0:
        note = "trips between zones that start and end at the same node were left out; value: trips"
        notes.add("trips at one node", note, element="demand", severity="warning", value=repr(lost))


def _note_unreachable(pairs: pd.DataFrame, notes: Notes) -> None:
    for origin, destination, trips in (
        pairs.drop_duplicates("row")[["origin_zone", "destination_zone", "trips"]]
    ).itertuples(index=False):
        notes.add(
            "unreachable",
            f"no path leads from zone {origin} to zone {destination}: nobody can arrive; "
            "value: trips",
            element="demand",
            severity="warning",
            value=repr(float(trips)),
        )


def add_zone_faults(cells: pd.DataFrame, network: Network, faults: Faults) -> None:
    """Note zones with trips for which the network has no node, each once, with its line."""
    for end, what in (("origin", "start"), ("destination", "end")):
        zone_of = cells[f"{end}_zone"]
        with_trips = (cells["trips"] > 0) & (zone_of != "")
        known = zone_nodes(network, end)[f"{end}_zone"]
        unknown = cells[with_trips & ~is_among(zone_of, known)]
        unknown = unknown.drop_duplicates(f"{end}_zone")
        for zone, line in zip(unknown[f"{end}_zone"], unknown["line"], strict=True):
            text = f"unknown zone: the network has no node at which trips of this zone can {what}"
            faults.add(text, line=line, value=zone)


def between_zones(cells: pd.DataFrame, options: TripsOptions, notes: Notes) -> pd.DataFrame:
    """Pairs of different zones with trips, those times the factor."""
    scaled = cells.assign(trips=cells["trips"] * options.factor)
    within = scaled["origin_zone"] == scaled["destination_zone"]
    lost = float(scaled.loc[within, "trips"].sum())
    if lost > 0:
        note = "trips that start and end in the same zone were left out; value: trips"
        notes.add("intrazonal trips", note, element="demand", severity="warning", value=repr(lost))
    return scaled[~within & (scaled["trips"] > 0)].reset_index(drop=True)


def over_time(at_nodes: pd.DataFrame, options: TripsOptions) -> pd.DataFrame:
    """The demand table: each row of ``at_nodes`` once for every slice of the period."""
    parts = [
        at_nodes.assign(
            start_s=part.start_s, end_s=part.end_s, vehicles=at_nodes["trips"] * part.share
        )
        for part in options.slices()
    ]
    table = pd.concat(parts).sort_index(kind="stable").reset_index(drop=True)
    return table[list(DEMAND_COLUMNS)]

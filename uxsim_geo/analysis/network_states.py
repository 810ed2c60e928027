"""The network as a whole over time: its fundamental diagram, and where the vehicles are."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import edie_states
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result


def network_states(states: pd.DataFrame, network: Network) -> pd.DataFrame:
    """Average flow and density of the network, or a part of it, in every time bin, for the MFD.

    ``states`` is what :func:`uxsim_geo.analysis.link_states.link_times` returns for the same
    network, of all links or some: those make up the part. With d and t the distance and time of all
    vehicles in a bin of length T and the total lane length Λ = Σ length · lanes of those links
    (Edie 1963; Geroliminis and Daganzo 2008):

        flow = d / (Λ T)  (veh/s per lane)      density = t / (Λ T)  (veh/m per lane)

    Columns: begin_s, end_s, distance (veh·m), time (veh·s), flow, density, speed (m/s; NaN while
    the network is empty), delay (veh·s), queue (veh, on links at the end of the bin).

    Raises :class:`uxsim_geo.errors.InputError` if the states are not those of each of their links
    in each bin, in that order, or of links that the network lacks.
    """
    grid = StateGrid.of(states)
    return states_of_part(grid, lane_lengths(grid, network), np.arange(len(grid.link_ids)))


def lane_lengths(grid: StateGrid, network: Network) -> Floats:
    """Length times lanes of the links of a grid, m; errors as of :meth:`StateGrid.rows_in`."""
    links = network.links.iloc[grid.rows_in(network)]
    lengths: Floats = (links["length"] * links["lanes"]).to_numpy(float)
    return lengths


def states_of_part(grid: StateGrid, lanes_m: Floats, part: Integers) -> pd.DataFrame:
    """The table of :func:`network_states`, of the links in some rows of a grid.

    ``lanes_m`` are the :func:`lane_lengths` of all its links.
    """
    names = ("distance", "time", "delay", "queue")
    sums = {name: grid.values(name)[part].sum(axis=0) for name in names}
    area = lanes_m[part].sum() * (grid.end - grid.begin)
    return pd.DataFrame(
        {
            "begin_s": grid.begin,
            "end_s": grid.end,
            "distance": sums["distance"],
            "time": sums["time"],
            **edie_states(sums["distance"], sums["time"], area),
            "delay": sums["delay"],
            "queue": sums["queue"],
        }
    )


def vehicle_counts(trips: pd.DataFrame, ends: Floats, times: Floats) -> pd.DataFrame:
    """Where the vehicles of trips are at each of ``times`` (s after the start, ascending).

    ``ends`` are those of these trips, as :func:`trip_ends` gives them for all.

    Columns: time_s and, in vehicles, departed (waiting, running, completed and aborted together),
    waiting (to enter the network), running (on links), completed and aborted (so far).
    """
    vehicles = trips["vehicles"].to_numpy(float)
    aborted = (trips["status"] == "aborted").to_numpy()

    def until(moments: Floats, chosen: np.ndarray) -> Floats:
        chosen = chosen & ~np.isnan(moments)
        order = np.argsort(moments[chosen], kind="stable")
        total = np.concatenate(([0.0], np.cumsum(vehicles[chosen][order])))
        passed = np.searchsorted(moments[chosen][order], times, side="right")
        counts: Floats = total[passed]
        return counts

    everyone = np.ones(len(trips), bool)
    entered = trips["enter_s"].to_numpy(float)
    never_entered = np.isnan(entered)
    departed = until(trips["depart_s"].to_numpy(float), everyone)
    completed, given_up = until(ends, ~aborted), until(ends, aborted)
    on_links_or_after = until(entered, everyone)
    return pd.DataFrame(
        {
            "time_s": times,
            "departed": departed,
            "waiting": departed - on_links_or_after - until(ends, aborted & never_entered),
            "running": on_links_or_after - completed - until(ends, aborted & ~never_entered),
            "completed": completed,
            "aborted": given_up,
        }
    )


def trip_ends(result: Result) -> Floats:
    """When each trip ended, s: at its arrival, or where it was aborted; NaN while it goes on.

    An aborted trip ends when it leaves its last link, or at its departure if it never entered one.
    """
    trips = result.trips
    ends = trips["arrive_s"].to_numpy(float, copy=True)
    aborted = (trips["status"] == "aborted").to_numpy()
    if aborted.any():
        ends[aborted] = trips["depart_s"].to_numpy(float)[aborted]
        left = result.log.some("vehicle", "exit_s", vehicles=aborted)
        np.fmax.at(ends, left["vehicle"], left["exit_s"])
    return ends

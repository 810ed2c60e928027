"""What happened on every link in every time bin, by Edie's definitions, and over the whole run.

Over a link of length L and a bin of length T, with the vehicles' total distance d and total time t
in that rectangle of space and time (Edie 1963):

    flow q = d / (L T)      density k = t / (L T)      speed v = d / t = q / k

Both sums are exact: entries and exits come from the events, and positions at the edges of the bins
from the closed form in :mod:`uxsim_geo.analysis.passages`.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges
from uxsim_geo.analysis.cell_sums import Observed
from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.kept_states import LinkStates
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.run_passages import blocks_at_hand
from uxsim_geo.analysis.spillback import times_without_room
from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.analysis.subsets import chosen_vehicles, rows_of_links
from uxsim_geo.analysis.table_size import MOST_STATES, check_rows
from uxsim_geo.analysis.types import Integers
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result


def link_times(  # noqa: PLR0913 -- three ways to choose, by keyword alone
    result: Result,
    network: Network,
    *,
    bin_s: npt.ArrayLike,
    links: str | Iterable[str] | None = None,
    vehicles: npt.ArrayLike | None = None,
    passages: Passages | None = None,
) -> pd.DataFrame:
    """States of links in time bins: one row a link and bin, links first, SI units.

    ``bin_s`` is the length of the bins, s, or their edges, as
    :func:`uxsim_geo.analysis.bins.bin_edges` takes them; ``links`` are link_ids, ``vehicles`` rows
    of the trips that alone count (None: all). ``passages`` are those of this result, where they are
    at hand. Vehicles count by their number, not by platoons. Columns:

    link_id (categorical, in the order of the links), begin_s, end_s
    entries, exits
        vehicles that entered or left the link in [begin, end); the last bin holds its end too
    distance (veh·m), time (veh·s)
        what the vehicles drove and spent on the link
    flow (veh/s), density (veh/m, all lanes together), speed (m/s)
        Edie's; speed is NaN where nobody was on the link
    delay (veh·s)
        time minus distance / free speed of the link without control: the time lost in this bin, to
        a speed limit too
    experienced_travel_time (s)
        mean time spent on the link by those who left it in this bin, NaN if nobody did
    instantaneous_travel_time (s)
        length / speed; at free speed where the link is empty, and at least at a hundredth of that
    queue (veh)
        vehicles on the link at the end of the bin which are behind the trajectory they would have
        at their own free speed, the limit in force when they entered: they have met the tail of a
        queue, or others who must drive slower, whether they stand or creep now
    queue_length (m)
        from the tail of the rearmost of those to the end of the link
    spillback_share
        part of the bin in which nobody could enter, whoever is counted, for want of room
        (:func:`uxsim_geo.analysis.spillback.times_without_room`): 0 to 1
    volume_to_capacity
        flow / capacity of the link without control, the lower of the given one and the diagram's

    Raises :class:`uxsim_geo.errors.InputError` for wrong bins, for a table of over 50 million rows,
    if ``links`` or ``vehicles`` are empty or not there, if ``passages`` are those of another
    result, or if the result is of another network.
    """
    return link_states(
        result, network, bin_s=bin_s, links=links, vehicles=vehicles, passages=passages
    ).table()


def link_states(  # noqa: PLR0913 -- three ways to choose, by keyword alone
    result: Result,
    network: Network,
    *,
    bin_s: npt.ArrayLike,
    links: str | Iterable[str] | None = None,
    vehicles: npt.ArrayLike | None = None,
    passages: Passages | None = None,
) -> LinkStates:
    """What :func:`link_times` says, kept so that parts of the table can be had one by one."""
    edges = bin_edges(result.settings.duration, bin_s)
    rows = rows_of_links(network, links)
    instead = "take longer bins or fewer links"
    check_rows(len(rows) * (len(edges) - 1), MOST_STATES, "bin_s", instead)
    counts = chosen_vehicles(result.trips, vehicles)

    def observe(some: tuple[Integers, Passages]) -> tuple[Integers, Observed]:
        own, there = some
        closures = times_without_room(there, network, result.settings)
        return own, Observed(there, counts, closures, edges)

    blocks = blocks_at_hand(passages, result, network, rows)
    return LinkStates.of(map(observe, blocks), network, edges, result.settings.reaction_time)


def link_totals(states: States) -> pd.DataFrame:
    """Figures of all bins together, one row a link in the order of ``states``, SI units.

    ``states`` is what :func:`link_times` or :func:`link_states` returns. Columns: link_id, volume
    (vehicles that entered), exits, distance (veh·m), time (veh·s), speed (m/s, distance / time, NaN
    if nobody came), delay (veh·s), experienced_travel_time (s, mean of those who left), queue and
    queue_length (the largest found at the end of a bin: veh, m), spillback_share,
    volume_to_capacity (of the whole time).

    Raises :class:`uxsim_geo.errors.InputError` if the states are not those of each of their links
    in each bin, in that order.
    """
    grid = StateGrid.of(states)
    by_link = grid.values
    length_of_bin = grid.end - grid.begin
    exits = by_link("exits")
    distance, time = by_link("distance").sum(axis=1), by_link("time").sum(axis=1)
    on_link = np.nan_to_num(by_link("experienced_travel_time")) * exits
    return pd.DataFrame(
        {
            "link_id": grid.link_ids.to_numpy(),
            "volume": by_link("entries").sum(axis=1),
            "exits": exits.sum(axis=1),
            "distance": distance,
            "time": time,
            "speed": ratio(distance, time),
            "delay": by_link("delay").sum(axis=1),
            "experienced_travel_time": ratio(on_link.sum(axis=1), exits.sum(axis=1)),
            "queue": by_link("queue").max(axis=1),
            "queue_length": by_link("queue_length").max(axis=1),
            **{
                name: np.average(by_link(name), axis=1, weights=length_of_bin)
                for name in ("spillback_share", "volume_to_capacity")
            },
        }
    )

"""Cumulative curves of a link: vehicles that have entered it, could have left it, and have left it.

Read across, the curves tell how long vehicles took; read upwards, how many are between (Newell
1993): from the exits to the entries those on the link, from the exits to the virtual departures
those in its queue, taken to stand at its end.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import checked_moments
from uxsim_geo.analysis.subsets import check_links, named_rows
from uxsim_geo.analysis.types import Floats
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result


def cumulative_curves(
    result: Result, network: Network, link: str, times: npt.ArrayLike | None = None
) -> pd.DataFrame:
    """Vehicles that have entered and left a link up to each moment, since the start.

    ``link`` is a link_id; ``times`` are s after the start, from 0 to the end of the simulation, in
    any order. None: the start, the end, and every moment at which a curve rises. One row a moment,
    in the order given. Columns, in vehicles but for the first:

    time_s
    entries
        entered up to this moment, and in it
    virtual_departures
        would have left if nobody had been in their way: entered at least the free-flow time ago,
        L/u with the free speed, or the speed limit, that held at their entry
    exits
        have left
    queue
        virtual_departures − exits: of a queue without length at the end of the link. Its area over
        time is what the vehicles have lost on the link so far against that free flow, veh·s

    entries ≥ virtual_departures ≥ exits at every moment.

    Raises :class:`uxsim_geo.errors.InputError` if the link is not there, if ``times`` is empty or
    leaves the simulation, or if the result is of another network.
    """
    check_links(result, network)
    if not isinstance(link, str):
        faults = Faults()
        faults.add(
            "must be one link_id: each link has curves of its own", column="link", value=link
        )
        faults.raise_if_any()
    known = pd.Index(network.links["link_id"].astype(str))
    (row,) = named_rows(link, known, "link")
    passages = Passages.of(result, network, np.array([row]))
    moments = None if times is None else checked_moments(times, passages.end)
    return curves_of_passages(passages, int(row), moments)


def curves_of_passages(
    passages: Passages, link: int, moments: Floats | None = None
) -> pd.DataFrame:
    """The table of :func:`cumulative_curves` of the link in row ``link`` of the links table."""
    return pd.DataFrame(curves_at(passages, link, moments))


def curves_at(passages: Passages, link: int, moments: Floats | None = None) -> dict[str, Floats]:
    """The columns of :func:`curves_of_passages`."""
    own = slice(passages.first[link], passages.first[link + 1])
    vehicles, enter, leave = passages.vehicles[own], passages.enter[own], passages.exit[own]
    free = enter + passages.geometry.length[link] / passages.free_speed[own]
    # exits at free flow may differ from this in the last digit, and must not come before it
    rises = {"entries": enter, "virtual_departures": np.minimum(free, leave), "exits": leave}
    if moments is None:
        moments = np.unique(np.concatenate(([0.0, passages.end], *rises.values())))
        moments = moments[moments <= passages.end]
    curves = {name: _curve(times, vehicles, moments) for name, times in rises.items()}
    queue = curves["virtual_departures"] - curves["exits"]
    return {"time_s": moments} | curves | {"queue": queue}


def _curve(rises: Floats, vehicles: Floats, moments: Floats) -> Floats:
    """Sum of the ``vehicles`` whose moment has come by each of ``moments``."""
    order = np.argsort(rises, kind="stable")
    total = np.concatenate(([0.0], np.cumsum(vehicles[order])))
    curve: Floats = total[np.searchsorted(rises[order], moments, side="right")]
    return curve

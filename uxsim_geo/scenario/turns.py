"""Turns banned and allowed: from link to link, or over links between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults, did_you_mean
from uxsim_geo.network.bans import VIA_COLUMN, ban_paths
from uxsim_geo.network.network import MOVEMENT_COLUMNS, Network
from uxsim_geo.scenario.changes import Changes


def ban_turn(network: Network, way: Sequence[str]) -> tuple[Network, pd.DataFrame]:
    """Ban a way over two links, or more, given by their link_ids in the order of driving.

    Returns the network and the changes. Raises :class:`uxsim_geo.errors.InputError` for links that
    are not there or do not follow one another, and for a way that is banned already.
    """
    faults, way = Faults(), tuple(way)
    _add_way_faults(network, way, faults)
    if not faults.found and way in ban_paths(_filled(network.movements)):
        faults.add("is banned already", column="from_link", value=" ".join(way))
    faults.raise_if_any()
    ends = dict(zip(network.links["link_id"], network.links["to_node_id"], strict=True))
    row = {"node_id": ends[way[0]], "from_link_id": way[0], "to_link_id": way[-1]}
    columns = list(network.movements.columns) if len(network.movements.columns) else []
    columns = list(dict.fromkeys([*MOVEMENT_COLUMNS, *columns]))
    if len(way) > 2:
        row[VIA_COLUMN] = " ".join(way[1:-1])
        columns = list(dict.fromkeys([*columns, VIA_COLUMN]))
    new = pd.DataFrame([row], columns=columns, dtype="str")
    old = _filled(network.movements).reindex(columns=columns)
    movements = pd.concat([old.astype("str"), new], ignore_index=True) if len(old) else new
    changes = Changes()
    changes.add("turn", " ".join(way), "banned", None, "yes")
    return replace(network, movements=movements), changes.table()


def allow_turn(network: Network, way: Sequence[str]) -> tuple[Network, pd.DataFrame]:
    """Allow a way that is banned; returns and raises as :func:`ban_turn`."""
    faults, way = Faults(), tuple(way)
    _add_way_faults(network, way, faults)
    paths = ban_paths(_filled(network.movements))
    meant = np.array([path == way for path in paths], bool)
    if not faults.found and not meant.any():
        near = [" ".join(path) for path in paths if path[0] == way[0]]
        advice = f"; banned from there: {', '.join(near[:5])}" if near else ""
        faults.add(f"is not banned{advice}", column="from_link", value=" ".join(way))
    faults.raise_if_any()
    changes = Changes()
    changes.add("turn", " ".join(way), "banned", "yes", None)
    movements = network.movements[~meant].reset_index(drop=True)
    return replace(network, movements=movements), changes.table()


def _filled(movements: pd.DataFrame) -> pd.DataFrame:
    """The table of banned turns with its columns, which an empty one may lack."""
    if len(movements.columns):
        return movements
    return pd.DataFrame({name: pd.Series(dtype="str") for name in MOVEMENT_COLUMNS})


def _add_way_faults(network: Network, way: tuple[str, ...], faults: Faults) -> None:
    ids = network.links["link_id"].astype(str).tolist()
    place = {link_id: row for row, link_id in enumerate(ids)}
    columns = ["from_link", *["via_links"] * (len(way) - 2), "to_link"]
    for column, link_id in zip(columns, way, strict=True):
        if link_id not in place:
            what = f"the network has no such link_id{did_you_mean(link_id, ids)}"
            faults.add(what, column=column, value=link_id)
    if faults.found:
        return
    start, end = network.links["from_node_id"].tolist(), network.links["to_node_id"].tolist()
    for column, (one, other) in zip(columns[1:], pairwise(way), strict=True):
        if end[place[one]] != start[place[other]]:
            what = (
                f"does not start where {one} ends: that is node {end[place[one]]}, and "
                f"{other} starts at {start[place[other]]}"
            )
            faults.add(what, column=column, value=other)

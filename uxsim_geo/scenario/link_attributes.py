"""Links with other attributes: set, multiplied, with more lanes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.site import Target
from uxsim_geo.errors import Faults
from uxsim_geo.network.diagram import diagram_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.network.overrides import SOURCES
from uxsim_geo.network.rows import count, numbers, whole_where_possible
from uxsim_geo.network.selection import select_links
from uxsim_geo.scenario.changes import Changes

Rows = npt.NDArray[np.int64]

#: s: of the diagram from which a capacity follows that nobody gave
REACTION_TIME = 1.0


def chosen_links(network: Network, target: Target) -> Rows:
    """Return the rows of the links that a target means; raises InputError where it means none."""
    rows = select_links(network, target)
    if not len(rows):
        faults = Faults()
        given = ("links", "where", "polygon", "street")
        column = next((name for name in given if getattr(target, name)), "links")
        faults.add("no link of the network is meant", column=column, value=str(target))
        faults.raise_if_any()
    return rows


def set_attributes(
    network: Network, target: Target, values: Mapping[str, object]
) -> tuple[Network, pd.DataFrame]:
    """Give links other values, by columns of the links table in SI units.

    A capacity that a link has follows its lanes in proportion, unless it is among the values.
    Lanes and free speeds set here become ``given``. Returns the network and the changes. Raises
    :class:`uxsim_geo.errors.InputError` where the target is wrong or means no link.
    """
    rows = chosen_links(network, target)
    return _with_values(
        network, rows, {name: [value] * len(rows) for name, value in values.items()}
    )


def scale_attributes(
    network: Network,
    target: Target,
    factors: Mapping[str, float],
    reaction_time: float = REACTION_TIME,
) -> tuple[Network, pd.DataFrame]:
    """Multiply attributes of links, by columns of the links table.

    A capacity that is null is that of the triangular diagram with ``reaction_time`` (s), before
    anything else is multiplied. Returns and raises as :func:`set_attributes`.
    """
    rows = chosen_links(network, target)
    links = network.links.iloc[rows]
    scaled: dict[str, object] = {}
    for name, factor in factors.items():
        values = numbers(links[name])
        if name == "capacity":
            values = np.where(np.isnan(values), diagram_capacity(links, reaction_time), values)
        scaled[name] = values * factor
    return _with_values(network, rows, scaled)


def add_lanes(network: Network, target: Target, lanes: int) -> tuple[Network, pd.DataFrame]:
    """Give links more lanes, or fewer where ``lanes`` is below 0; of each link one must stay.

    Returns and raises as :func:`set_attributes`.
    """
    rows = chosen_links(network, target)
    after = numbers(network.links["lanes"])[rows] + lanes
    faults = Faults()
    if lanes == 0:
        faults.add("adds no lane", column="lanes", value=lanes)
    if (after < 1).any():
        few = network.links["link_id"].iloc[rows[after < 1]].astype(str).tolist()
        which = f"{count(len(few), 'link')}, of {', '.join(few[:5])}"
        what = f"leaves no lane of {which}: close them instead"
        faults.add(what, column="lanes", value=lanes)
    faults.raise_if_any()
    return _with_values(network, rows, {"lanes": after})


def _with_values(
    network: Network, rows: Rows, values: Mapping[str, object]
) -> tuple[Network, pd.DataFrame]:
    """Put values, one for each of some rows, into columns; note what changes."""
    values = dict(values)
    links, changes = network.links.copy(), Changes()
    if "lanes" in values and "capacity" not in values:
        capacity = numbers(links["capacity"])[rows]
        follow = capacity * np.asarray(values["lanes"], float) / numbers(links["lanes"])[rows]
        values["capacity"] = follow
    ids = links["link_id"].iloc[rows].astype(str).tolist()
    for name, new in values.items():
        before = links[name].iloc[rows].tolist() if name in links else [None] * len(rows)
        after = _put(links, rows, name, new)
        changes.add_each(ids, name, before, after)
    return replace(network, links=links), changes.table()


def _put(links: pd.DataFrame, rows: Rows, name: str, new: object) -> list[object]:
    """Write values into some rows of a column, which may be new; return what stands there."""
    if isinstance(np.asarray(new).ravel()[0], str):
        column = links[name] if name in links else pd.Series(None, links.index, dtype="str")
        column = column.astype("str")
        column.iloc[rows] = list(new)  # type: ignore[call-overload]
        links[name] = column
    else:
        filled = numbers(links[name]).copy()
        filled[rows] = new
        links[name] = whole_where_possible(filled) if name == "lanes" else filled
    if name in SOURCES and SOURCES[name] in links:
        source = links[SOURCES[name]].copy()
        source.iloc[rows] = "given"
        links[SOURCES[name]] = source
    return list(links[name].iloc[rows])

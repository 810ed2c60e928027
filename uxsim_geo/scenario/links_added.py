"""New links, along a line or straight, in one direction or both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults, did_you_mean
from uxsim_geo.network.measure import line_lengths
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import numbers
from uxsim_geo.scenario.changes import EXISTS, Changes
from uxsim_geo.scenario.columns import longer
from uxsim_geo.scenario.lines import line_between


@dataclass(frozen=True)
class NewLink:
    """A link that is not there yet.

    along
        its line: WKT in the reference system of the network, or a file with one line
    values
        by columns of the links table, in SI units; ``lanes`` and ``free_speed`` are needed, the
        length where the network has no coordinates
    back_id
        of a second link, the same in the other direction
    """

    link_id: str
    from_node: str
    to_node: str
    along: str | Path | None = None
    values: Mapping[str, object] = field(default_factory=dict)
    back_id: str | None = None


def add_link(network: Network, link: NewLink) -> tuple[Network, pd.DataFrame]:
    """Put a link, or two, behind those of a network.

    The length is measured along the line, on the ground, unless it is given. Where nothing is
    said, jam density and merge priority are those that most links have, and the capacity is that
    of the diagram. Returns the network and the changes. Raises
    :class:`uxsim_geo.errors.InputError` with all that is wrong: ids that are taken, nodes that are
    not there, a line that is none or does not lead from node to node.
    """
    faults = Faults()
    _add_id_faults(network, link, faults)
    line = _line(network, link, faults)
    length = link.values.get("length")
    if length is None and line is not None:
        length = float(
            line_lengths(np.array([line], object), getattr(network.links, "crs", None))[0]
        )
        if not length > 0:
            faults.add("has no length", column="along")
    elif length is None and not faults.found:
        faults.add("the network has no coordinates: give the length", column="length")
    faults.raise_if_any()
    rows = [_row(network, link, length, line)]
    if link.back_id is not None:
        back = replace(link, link_id=link.back_id, from_node=link.to_node, to_node=link.from_node)
        rows.append(_row(network, back, length, None if line is None else line.reverse()))
    return _with_rows(network, rows)


def _add_id_faults(network: Network, link: NewLink, faults: Faults) -> None:
    known = set(network.links["link_id"].astype(str))
    for name, id_ in (("id", link.link_id), ("both_ways", link.back_id)):
        if id_ in known:
            faults.add("the network has this link_id already", column=name, value=id_)
    nodes = network.nodes["node_id"].astype(str).tolist()
    for name, node in (("from", link.from_node), ("to", link.to_node)):
        if node not in set(nodes):
            what = f"the network has no such node_id{did_you_mean(node, nodes)}"
            faults.add(what, column=name, value=node)


def _line(network: Network, link: NewLink, faults: Faults) -> Any:
    """The line, in a network that has coordinates; None without them, and with a fault."""
    import shapely

    if "geometry" not in network.links or "geometry" not in network.nodes:
        if link.along is not None:
            faults.add("the network has no coordinates", column="along")
        return None
    ids = network.nodes["node_id"].astype(str)
    places = dict(zip(ids, network.nodes["geometry"], strict=True))
    if link.from_node not in places or link.to_node not in places:
        return None
    ends = shapely.get_coordinates([places[link.from_node], places[link.to_node]])
    return line_between(link.along, ends, getattr(network.links, "crs", None), faults)


def _row(network: Network, link: NewLink, length: object, line: Any) -> dict[str, object]:
    row: dict[str, object] = {
        "link_id": link.link_id,
        "from_node_id": link.from_node,
        "to_node_id": link.to_node,
        "jam_density": _usual(network.links["jam_density"]),
        "merge_priority": _usual(network.links["merge_priority"]),
        "capacity": np.nan,
        "lanes_source": "given",
        "free_speed_source": "given",
        **link.values,
        "length": length,
        "geometry": line,
    }
    return {name: row.get(name) for name in dict.fromkeys([*network.links.columns, *link.values])}


def _usual(column: pd.Series) -> float:
    """The value that occurs most often; of several the smallest."""
    values, counts = np.unique(numbers(column), return_counts=True)
    return float(values[np.argmax(counts)])


def _with_rows(network: Network, rows: list[dict[str, object]]) -> tuple[Network, pd.DataFrame]:
    links, changes = network.links, Changes()
    columns = {}
    for name in rows[0]:
        if name == "geometry":
            continue
        old = links[name] if name in links else pd.Series(None, links.index, dtype="str")
        columns[name] = longer(old, [row[name] for row in rows])
    table = pd.DataFrame(columns)
    if "geometry" in links:
        import geopandas

        lines = [*links["geometry"], *(row["geometry"] for row in rows)]
        table = geopandas.GeoDataFrame(table, geometry=lines, crs=getattr(links, "crs", None))
        table = table[[*links.columns, *(name for name in table if name not in links)]]
    for row in rows:
        changes.add("link", str(row["link_id"]), EXISTS, None, "yes")
    return replace(network, links=table), changes.table()

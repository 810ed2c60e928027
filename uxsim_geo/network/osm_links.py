"""Sections with the directions and tags of their ways: the tables of links and nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS
from uxsim_geo.network.osm_file import PER_DEGREE, OsmFile
from uxsim_geo.network.osm_sections import Rows, Sections
from uxsim_geo.network.osm_tags import Tags
from uxsim_geo.network.osm_ways import DIRECTED, DIRECTIONS, KEPT_TEXTS, Ways

CRS = "EPSG:4326"

#: m; two nodes at one place are so far apart, since a link must have a length
SHORTEST = 0.1

#: columns of links after the geometry
OWN_LINK_COLUMNS = (
    "direction",
    "oneway",
    "ref",
    "junction",
    "layer",
    "bridge",
    "tunnel",
    "access",
    "turn_lanes",
    "free_speed_basis",
    "source_node_ids",
)


@dataclass(frozen=True)
class DirectedLinks:
    """Links as rows of other arrays, in the order way id, place on the way, direction.

    section, way
        rows of the section and the way each is of
    backward
        0: as the way is drawn; 1: against that
    start, end
        rows of nodes in the file's ``node_ids``
    ids
        ``way:from-to``; where a way leads from one node to another more than once, the second
        has ``:2`` after it
    """

    section: Rows
    way: Rows
    backward: Rows
    start: Rows
    end: Rows
    ids: pd.Series


def direct(file: OsmFile, sections: Sections, ways: Ways) -> DirectedLinks:
    """Make a link of each section in each direction open on its way."""
    section, backward = np.nonzero(ways.open[sections.way])
    start, end = sections.start[section], sections.end[section]
    start, end = np.where(backward, end, start), np.where(backward, start, end)
    way = sections.way[section]
    way_id, from_id, to_id = (
        pd.Series(ids.astype(str), dtype="str")
        for ids in (file.way_ids[way], file.node_ids[start], file.node_ids[end])
    )
    ids = way_id + ":" + from_id + "-" + to_id
    times = ids.groupby(ids).cumcount() + 1
    again = times > 1
    ids[again] = ids[again] + ":" + times[again].astype("str")
    return DirectedLinks(section, way, backward, start, end, ids.rename("link_id"))


def links_table(
    file: OsmFile,
    sections: Sections,
    ways: Ways,
    links: DirectedLinks,
    jam_density: float,
) -> pd.DataFrame:
    """The table of links as a GeoDataFrame in longitude and latitude."""
    import geopandas

    row = 2 * links.way + links.backward
    columns: dict[str, Any] = {name: _taken(ways.directed[name], row) for name in DIRECTED}
    columns |= {name: _taken(column, links.way) for name, column in ways.texts.items()}
    columns |= {
        "link_id": links.ids,
        "from_node_id": file.node_ids[links.start].astype(str),
        "to_node_id": file.node_ids[links.end].astype(str),
        "length": np.maximum(sections.length[links.section], SHORTEST),
        "jam_density": jam_density,
        "capacity": np.full(len(row), np.nan),
        "merge_priority": np.asarray(ways.merge_priority)[links.way],
        "source_id": file.way_ids[links.way].astype(str),
        "direction": np.asarray(DIRECTIONS, dtype=object)[links.backward],
        "oneway": ~ways.open[links.way].all(axis=1),
        "layer": np.asarray(ways.layer, dtype=np.int64)[links.way],
        "source_node_ids": _node_lists(file, sections, links),
    }
    table = pd.DataFrame(columns, columns=[*LINK_COLUMNS, *OWN_LINK_COLUMNS])
    table = table.astype({"lanes": "int64", "free_speed": "float64"})
    texts = [name for name in table if name in _TEXTS]
    table[texts] = table[texts].astype("str")
    table.insert(len(LINK_COLUMNS), "geometry", _lines(file, sections, links))
    located: pd.DataFrame = geopandas.GeoDataFrame(table, geometry="geometry", crs=CRS)
    return located


_TEXTS = frozenset(
    (
        *("link_id", "from_node_id", "to_node_id", "road_class", "source_id", "direction"),
        *("lanes_source", "free_speed_source", "free_speed_basis", "turn_lanes", "access"),
        *KEPT_TEXTS,
        "source_node_ids",
    )
)


def _taken(values: list[Any], rows: Rows) -> Any:
    return np.asarray(values, dtype=object)[rows]


def _node_lists(file: OsmFile, sections: Sections, links: DirectedLinks) -> list[str]:
    """Ids of all nodes along each link, with blanks between, from its start to its end."""
    names = file.node_ids[sections.points].astype(str).tolist()
    lists = []
    bounds = sections.first.tolist()
    for section, backward in zip(links.section.tolist(), links.backward.tolist(), strict=True):
        along = names[bounds[section] : bounds[section + 1]]
        lists.append(" ".join(reversed(along) if backward else along))
    return lists


def _lines(file: OsmFile, sections: Sections, links: DirectedLinks) -> Any:
    """The line of each link, from its start to its end."""
    import shapely

    first, last = sections.first[links.section], sections.first[links.section + 1] - 1
    sizes = last - first + 1
    offsets = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    turned = np.repeat(links.backward, sizes)
    place = np.where(turned, np.repeat(last, sizes) - offsets, np.repeat(first, sizes) + offsets)
    point = sections.points[place]
    coordinates = np.stack([file.x[point] / PER_DEGREE, file.y[point] / PER_DEGREE], axis=1)
    return shapely.linestrings(coordinates, indices=np.repeat(np.arange(len(sizes)), sizes))


def nodes_table(file: OsmFile, links: DirectedLinks, signals: dict[int, list[int]]) -> pd.DataFrame:
    """The nodes at which links meet, by id; ``signals``: row of a junction to rows of signals."""
    import geopandas
    import shapely

    rows = np.union1d(links.start, links.end)
    ids = file.node_ids[rows]
    tags = [file.node_tags.get(node_id, {}) for node_id in ids.tolist()]
    sources = [file.node_ids[sorted(signals.get(row, ()))].astype(str) for row in rows.tolist()]
    table = pd.DataFrame(
        {
            "node_id": pd.Series(ids.astype(str), dtype="str"),
            "zone_id": pd.Series([None] * len(rows), dtype="str"),
            "control": np.where([row in signals for row in rows.tolist()], "signal", "none"),
            "through_traffic": True,
            "highway": pd.Series([tag.get("highway") for tag in tags], dtype="str"),
            "barrier": pd.Series([tag.get("barrier") for tag in tags], dtype="str"),
            "beyond": _beyond(file, rows, tags),
            "signal_node_ids": pd.Series(
                [" ".join(names) or None for names in sources], dtype="str"
            ),
        }
    )
    points = shapely.points(file.x[rows] / PER_DEGREE, file.y[rows] / PER_DEGREE)
    table.insert(len(NODE_COLUMNS), "geometry", points)
    located: pd.DataFrame = geopandas.GeoDataFrame(table, geometry="geometry", crs=CRS)
    return located


def _beyond(file: OsmFile, rows: Rows, tags: list[Tags]) -> pd.Series:
    """What is known of streets that end at nodes: that another way goes on, or nothing does."""
    other = np.isin(file.node_ids[rows], file.other_way_ids)
    beyond = [
        "noexit" if tag.get("noexit") == "yes" else "other way" if path else None
        for tag, path in zip(tags, other.tolist(), strict=True)
    ]
    return pd.Series(beyond, dtype="str")

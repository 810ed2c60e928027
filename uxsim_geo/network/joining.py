"""Links over nodes of degree two become one link, without losing what changes along them.

A joined link is as long as its pieces and takes as long at free flow, whatever they were. What
its pieces say in words is kept: different names, sources and the like stand side by side. The
columns that make a difference to traffic (:data:`KINDS`) change at a node that is kept, unless
the piece is so short that it is told how: see :func:`join_links`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.network.chains import places_in_chains, straight_of
from uxsim_geo.network.incidence import Floats, Rows, ends_of, rank_of, turns_of
from uxsim_geo.network.joined_columns import Groups, joined_columns
from uxsim_geo.network.joined_movements import movements_of_joined
from uxsim_geo.network.joints import Roads, nodes_to_join
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.place_notes import note_places
from uxsim_geo.network.rows import count, numbers

#: links that differ in one of these are joined only where a piece is short
KINDS = (
    "lanes",
    "free_speed",
    "jam_density",
    "capacity",
    "merge_priority",
    "road_class",
    "junction",
)


def join_links(
    network: Network, short_piece: float, notes: Notes, *, kinds: tuple[str, ...] = KINDS
) -> Network:
    """Join links at nodes with two neighbours at which nothing changes, begins, ends or is decided.

    A piece shorter than ``short_piece`` (m) that differs from its neighbours in ``kinds`` is
    joined to them or to the shorter of them: the link has the values of the longest stretch of
    one kind, and the speed at which it takes as long as its pieces,
    u = Σ length / Σ (length / speed). The link is called as its first piece, with ``+n`` for
    n pieces joined to it.
    """
    ends = ends_of(network)
    if not len(ends.start):
        return network
    turns = turns_of(network, ends)
    straight = straight_of(network, ends, turns)
    kind = kind_of_each(network.links, kinds)
    length = numbers(network.links["length"])
    roads = Roads(straight, ends, kind, length, rank_of(network.nodes["node_id"]))
    joined = nodes_to_join(roads, short_piece)
    if not joined.any():
        notes.add("links joined", "no node of degree two to join links at", value=0)
        return network
    groups = Groups.of(*places_in_chains(np.where(joined[ends.start], straight.previous, -1)))
    links = links_of_chains(network.links, groups, kind, set(network.links["link_id"]))
    movements, dropped = movements_of_joined(network, joined, groups.of_link, links["link_id"])
    ends_at = dict(zip(links["link_id"], links["to_node_id"], strict=True))
    movements["node_id"] = movements["from_link_id"].map(ends_at).astype("str")
    _note(network, links, groups, kind, notes)
    if dropped:
        note = "bans of turning back where no node is left: nothing turns there; value: bans"
        notes.add("bans without a node", note, value=dropped)
    nodes = network.nodes[~joined].reset_index(drop=True)
    return Network(nodes, links, movements, network.notes)


def kind_of_each(links: pd.DataFrame, kinds: tuple[str, ...] = KINDS) -> Rows:
    """A number for each link, the same where all of ``kinds`` are; (links,)."""
    number = np.zeros(len(links), dtype=np.int64)
    for column in kinds:
        if column in links:
            codes, _ = pd.factorize(links[column], sort=True, use_na_sentinel=True)
            number = number * (int(codes.max(initial=0)) + 2) + codes + 1
            _, number = np.unique(number, return_inverse=True)
    return np.asarray(number, dtype=np.int64)


def links_of_chains(
    table: pd.DataFrame, groups: Groups, kind: Rows, taken: set[str]
) -> pd.DataFrame:
    """The table with one row a chain, where its first piece stood; ``taken``: ids of others."""
    several = groups.size > 1
    links = table.iloc[groups.first].reset_index(drop=True)
    columns = joined_columns(table, groups, kind)
    for name, values in columns.items():
        links[name] = values
    links["link_id"] = _ids(table["link_id"], groups, taken)
    links["to_node_id"] = table["to_node_id"].iloc[groups.last].to_numpy()
    links["length"], links["free_speed"] = _lengths_and_speeds(table, groups)
    if "geometry" in table and several.any():
        shapes = np.array(links["geometry"], dtype=object)
        shapes[several] = _lines(table, groups, several)
        links["geometry"] = shapes
    return located(links, table)


def located(links: pd.DataFrame, like: pd.DataFrame) -> pd.DataFrame:
    """The links as a GeoDataFrame if the table was one."""
    crs = getattr(like, "crs", None)
    if crs is None or "geometry" not in links:
        return links
    import geopandas

    located: pd.DataFrame = geopandas.GeoDataFrame(links, geometry="geometry", crs=crs)
    return located


def _ids(ids: pd.Series, groups: Groups, taken: set[str]) -> pd.Series:
    """The first piece's id, with the number of pieces joined to it."""
    known = set(taken)
    found = ids.iloc[groups.first].tolist()
    for row in np.flatnonzero(groups.size > 1).tolist():
        name = f"{found[row]}+{groups.size[row] - 1}"
        while name in known:
            name += "'"
        known.add(name)
        found[row] = name
    return pd.Series(found, dtype="str", name="link_id")


def _lengths_and_speeds(table: pd.DataFrame, groups: Groups) -> tuple[Floats, Floats]:
    length, speed = numbers(table["length"]), numbers(table["free_speed"])
    total = groups.sums(length)
    with np.errstate(divide="ignore", invalid="ignore"):
        harmonic = total / groups.sums(length / speed)
    own = speed[groups.first]
    one_speed = groups.least(speed) == groups.greatest(speed)
    single = groups.size == 1
    return (
        np.where(single, length[groups.first], np.round(total, 6)),
        np.where(single | one_speed, own, harmonic),
    )


def _lines(table: pd.DataFrame, groups: Groups, several: Any) -> Any:
    """The line over all pieces of each of several links."""
    import shapely

    rows = groups.order[np.repeat(several, groups.size)]
    sizes = groups.size[several]
    shapes = np.asarray(table["geometry"], dtype=object)[rows]
    points, piece = shapely.get_coordinates(shapes, return_index=True)
    link = np.repeat(np.arange(len(sizes)), sizes)[piece]
    again = np.zeros(len(points), dtype=bool)
    again[1:] = (link[1:] == link[:-1]) & (piece[1:] != piece[:-1])
    again[1:] &= (points[1:] == points[:-1]).all(axis=1)
    return shapely.linestrings(points[~again], indices=link[~again])


def _note(network: Network, links: pd.DataFrame, groups: Groups, kind: Rows, notes: Notes) -> None:
    before = len(network.links)
    note = f"{count(before, 'link')} became {len(links)} at nodes of degree two; value: nodes gone"
    gone = int((groups.size - 1).sum())
    notes.add("links joined", note, element="link", value=gone)
    mixed = groups.least(kind) != groups.greatest(kind)
    names = links["link_id"][mixed].tolist()
    remark = (
        "short piece joined",
        "a short piece with other lanes, speed or class is a part of it; value: pieces",
    )
    note_places(notes, remark, names, values=groups.size[mixed].tolist())

"""``changes.gpkg``: what scenarios change, on the map, before anything is run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.export import qml
from uxsim_geo.export.columns import Column, Layer
from uxsim_geo.export.geopackage import Contents, write_contents
from uxsim_geo.export.qml import ColourClass, Lines
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.styles import NamedStyle, plain_style, tip_of, with_titles
from uxsim_geo.network.network import Network


@dataclass(frozen=True)
class Edited:
    """A scenario: its network, and its changes of links, nodes and turns, and others.

    changes
        line (of the study; null: of the base), edit, element, id, attribute, before, after
    others
        element, id, what and edits of each: sums over what is nowhere on the map
    """

    name: str
    network: Network
    changes: pd.DataFrame
    others: pd.DataFrame


#: kinds of changes of links with their colours, the first that fits a link is its own
KINDS = {
    "removed": "#111111",
    "added": "#b8860b",
    "closed": "#b2182b",
    "lanes closed": "#ef8a62",
    "reopened": "#1b7837",
    "attributes": "#2166ac",
    "control": "#762a83",
}
#: kinds of changes at nodes
NODE_KINDS = (
    ("node added", "node added", "#b8860b", 3.0),
    ("turn banned", "turn banned", "#b2182b", 3.0),
    ("turn allowed", "turn allowed", "#1b7837", 3.0),
    ("signal", "signal changed", "#f2b84b", 3.0),
)

_SIDES = ("before", "after")

_COMMON = (
    Column("scenario", "scenario", "text", "name of the scenario"),
    Column("kind", "kind", "text", "kind of change, by which it is coloured"),
    Column("what", "what changes", "text", "each attribute before → after, in the unit it names"),
    Column("edits", "edits", "text", "lines of the study file"),
)
LINK_CHANGES = Layer(
    "Changes of links by scenario",
    "A link that a scenario changes, adds, removes or closes.",
    (
        Column("link_id", "link", "text", "id of the link"),
        *_COMMON,
        Column("name", "name", "text", "of the road", "where it has none"),
    ),
)
NODE_CHANGES = Layer(
    "Changes at nodes by scenario",
    "A node that a scenario adds, or whose turns or signal it changes.",
    (Column("id", "node or turn", "text", "id of the node, or the links of the turn"), *_COMMON),
)
OTHER_CHANGES = Layer(
    "Other changes by scenario",
    "What an edit changes that is nowhere on the map: of trips, of settings.",
    (Column("id", "what", "text", "how many pairs of nodes, or which key"), *_COMMON),
)


def write_scenario_changes(
    path: Path, base: Network, scenarios: Sequence[Edited], description: RunDescription
) -> None:
    """Write the layers ``changes``, ``changes_at_nodes`` and ``other_changes``, with styles.

    ``base``: the network without edits, which has the links that scenarios remove. Without geometry
    all are tables.
    """
    links = pd.concat([_links(base, one) for one in scenarios], ignore_index=True)
    nodes = pd.concat([_nodes(base, one) for one in scenarios], ignore_index=True)
    other = pd.concat([_other(one) for one in scenarios], ignore_index=True)
    other = other.astype("str")
    crs = getattr(base.links, "crs", None)
    layers = {"changes": _spatial(links, crs), "changes_at_nodes": _spatial(nodes, crs)}
    layers |= {"other_changes": other}
    words = {
        "changes": LINK_CHANGES,
        "changes_at_nodes": NODE_CHANGES,
        "other_changes": OTHER_CHANGES,
    }
    styles = {name: [plain_style(name, layer)] for name, layer in words.items()}
    if "geometry" in base.links:
        styles |= {"changes": [_line_style(description)], "changes_at_nodes": [_dot_style()]}
    types = {"changes": "LineString", "changes_at_nodes": "Point"}
    write_contents(path, Contents(layers, words, styles, types=types), description)


def _links(base: Network, scenario: Edited) -> pd.DataFrame:
    changes = scenario.changes[scenario.changes["element"] == "link"]
    table = _one_an_element(changes, scenario.name, _kind_of_link).rename(columns={"id": "link_id"})
    found: dict[str, dict[str, Any]] = {"name": {}, "geometry": {}}
    for network in (base, scenario.network):
        ids = network.links["link_id"].astype(str)
        for column, of_link in found.items():
            if column in network.links:
                of_link |= dict(zip(ids, network.links[column], strict=True))
    columns = {
        column: np.array([of_link.get(one) for one in table["link_id"]], object)
        for column, of_link in found.items()
    }
    return table.assign(**columns).astype({"name": "str"})


def _nodes(base: Network, scenario: Edited) -> pd.DataFrame:
    changes = scenario.changes[scenario.changes["element"].isin(("node", "turn"))]
    table = _one_an_element(changes, scenario.name, _kind_at_node)
    points: dict[str, Any] = {}
    ends: dict[str, str] = {}
    for network in (base, scenario.network):
        ids = network.links["link_id"].astype(str)
        ends |= dict(zip(ids, network.links["to_node_id"].astype(str), strict=True))
        if "geometry" in network.nodes:
            nodes = network.nodes["node_id"].astype(str)
            points |= dict(zip(nodes, network.nodes["geometry"], strict=True))
    turn = table["kind"].str.startswith("turn").to_numpy(bool)
    at = np.where(turn, [ends.get(one.split(" ")[0], "") for one in table["id"]], table["id"])
    return table.assign(geometry=np.array([points.get(one) for one in at], object))


def _other(scenario: Edited) -> pd.DataFrame:
    table = scenario.others.rename(columns={"element": "kind"}).assign(scenario=scenario.name)
    return table[["id", *(column.name for column in _COMMON)]]


def _one_an_element(changes: pd.DataFrame, scenario: str, kind_of: Any) -> pd.DataFrame:
    """One row an element, with all that changes of it in words."""
    rows = [
        (id_, scenario, kind_of(own), _in_words(own), _lines_of(own))
        for id_, own in changes.groupby("id", sort=False)
    ]
    return pd.DataFrame(rows, columns=["id", "scenario", "kind", "what", "edits"]).astype("str")


def _kind_of_link(own: pd.DataFrame) -> str:
    attributes = dict(zip(own["attribute"], own["after"].notna(), strict=True))
    if "exists" in attributes:
        return "added" if attributes["exists"] else "removed"
    if "closed" in attributes:
        return "closed" if attributes["closed"] else "reopened"
    if "lanes_closed" in attributes:
        return "lanes closed"
    return "control" if (own["edit"] == "control").all() else "attributes"


def _kind_at_node(own: pd.DataFrame) -> str:
    first = own.iloc[0]
    if first["element"] == "turn":
        return "turn banned" if pd.notna(own["after"].iloc[-1]) else "turn allowed"
    return "node added" if first["attribute"] == "exists" else "signal"


def _in_words(own: pd.DataFrame) -> str:
    told = []
    for change in own.to_dict("records"):
        before, after = ("–" if pd.isna(change[name]) else change[name] for name in _SIDES)
        told.append(f"{change['attribute']} {before} → {after}")
    return "; ".join(told)


def _lines_of(own: pd.DataFrame) -> str:
    lines = zip(own["line"], own["edit"], strict=True)
    told = (f"{edit} (base)" if pd.isna(line) else f"{edit} (line {line})" for line, edit in lines)
    return ", ".join(dict.fromkeys(told))


def _spatial(table: pd.DataFrame, crs: Any) -> pd.DataFrame:
    if not len(table) or table["geometry"].isna().all():
        return table.drop(columns="geometry")
    import geopandas

    shapes = table["geometry"].to_numpy()
    spatial: pd.DataFrame = geopandas.GeoDataFrame(
        table.drop(columns="geometry"), geometry=shapes, crs=crs
    )
    return spatial


def _line_style(description: RunDescription) -> NamedStyle:
    root = with_titles(LINK_CHANGES)
    number = " ".join(f"WHEN \"kind\" = '{kind}' THEN {n}" for n, kind in enumerate(KINDS))
    classes = [
        ColourClass(n - 0.5, n + 0.5, colour, kind)
        for n, (kind, colour) in enumerate(KINDS.items())
    ]
    value = f"CASE {number} END"
    lines = Lines(value, classes, "1.2", f"-({value})", description.driving_side)
    qml.add_lines(root, lines)
    qml.add_labels(root, "what", 12_000)
    what = {"scenario": '"scenario"', "what": '"what"', "edits": '"edits"'}
    qml.add_tip(root, tip_of(what))
    return NamedStyle("kind", "colour: kind of change", root)


def _dot_style() -> NamedStyle:
    root = with_titles(NODE_CHANGES)
    qml.add_dots(root, "kind", NODE_KINDS)
    return NamedStyle("kind", "colour: kind of change", root)

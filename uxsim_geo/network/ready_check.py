"""Do the tables name one another rightly? What the steps of making ready rely on."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from uxsim_geo.errors import Faults
from uxsim_geo.network.bans import ban_paths
from uxsim_geo.network.network import MOVEMENT_COLUMNS, REQUIRED_LINK_COLUMNS, Network
from uxsim_geo.network.rows import add_missing_columns, add_rows, is_among


def check_ids(network: Network) -> None:
    """Raise :class:`InputError` with all ids that are absent, not unique or not known.

    Lengths, lanes and speeds may still be missing: an overrides table can bring them later.
    """
    faults = Faults()
    faults.extend(_of_nodes_and_links(network))
    faults.raise_if_any()
    faults.extend(_of_movements(network))
    faults.raise_if_any()


def _of_nodes_and_links(network: Network) -> Faults:
    nodes, links = Faults("nodes"), Faults("links")
    missing = add_missing_columns(nodes, network.nodes, ("node_id",))
    missing |= add_missing_columns(links, network.links, REQUIRED_LINK_COLUMNS)
    if not missing:
        for faults, ids in ((nodes, network.nodes["node_id"]), (links, network.links["link_id"])):
            add_rows(faults, ids.isna(), f"no {ids.name}")
            again = np.asarray(ids.duplicated() & ids.notna(), dtype=bool)
            add_rows(faults, again, f"the {ids.name} of an earlier row", ids=ids)
        for column in ("from_node_id", "to_node_id"):
            unknown = ~is_among(network.links[column], network.nodes["node_id"])
            what = f"a {column} that is not in the nodes"
            add_rows(links, unknown, what, ids=network.links["link_id"])
    nodes.extend(links)
    return nodes


def _of_movements(network: Network) -> Faults:
    """Bans whose links are not there, or do not lead from one to the next."""
    faults = Faults("movements")
    if add_missing_columns(faults, network.movements, MOVEMENT_COLUMNS):
        return faults
    links = network.links
    starts, ends = (
        dict(zip(links["link_id"], links[f"{side}_node_id"], strict=True))
        for side in ("from", "to")
    )
    paths = ban_paths(network.movements)
    known = [all(name in starts for name in path) for path in paths]
    meet = [
        not there or all(ends[a] == starts[b] for a, b in pairwise(path))
        for path, there in zip(paths, known, strict=True)
    ]
    add_rows(faults, ~np.array(known, dtype=bool), "links that are not in the links")
    add_rows(faults, ~np.array(meet, dtype=bool), "links that do not lead to one another")
    return faults

"""Paths of links along a street, by its name."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.network.network import Network

#: a path shorter than this share of the street's longest is left out: a slip road, not the street
LEAST_SHARE = 0.25


def street_paths(network: Network, street: str) -> dict[str, list[str]]:
    """The longest paths along the links of a street, each way: name → link_ids as driven.

    Links go on to the next link of the street where there is but one, and it has no other before
    it; nobody turns back. Paths are named by the street and their end nodes, so that they are the
    same in two networks whose street has the same ends. None where no link has that name.
    """
    if "name" not in network.links:
        return {}
    named = network.links["name"].astype("str").str.strip()
    links = network.links[(named.str.casefold() == street.strip().casefold()).to_numpy()]
    after = _next_links(links)
    first = sorted(set(range(len(links))) - set(after.values()))
    paths, seen = [], set[int]()
    # what no path begins, goes round in a ring
    for start in (*first, *range(len(links))):
        path: list[int] = []
        place: int | None = start
        while place is not None and place not in seen:
            seen.add(place)
            path.append(place)
            place = after.get(place)
        if path:
            paths.append(path)
    return _named(links, paths)


def _next_links(links: pd.DataFrame) -> dict[int, int]:
    """By the place of a link that of the one that follows it, if there is one and no doubt."""
    starts, ends = (links[name].astype(str).tolist() for name in ("from_node_id", "to_node_id"))
    leaving: dict[str, list[int]] = {}
    for place, node in enumerate(starts):
        leaving.setdefault(node, []).append(place)
    after = {
        place: [link for link in leaving.get(node, []) if ends[link] != starts[place]]
        for place, node in enumerate(ends)
    }
    before: dict[int, int] = {}
    for found in after.values():
        for link in found:
            before[link] = before.get(link, 0) + 1
    return {
        place: found[0]
        for place, found in after.items()
        if len(found) == 1 and before[found[0]] == 1
    }


def _named(links: pd.DataFrame, paths: list[list[int]]) -> dict[str, list[str]]:
    lengths, streets = links["length"].to_numpy(float), links["name"].str.strip()
    longest = max((float(np.sum(lengths[path])) for path in paths), default=0.0)
    found: dict[str, list[str]] = {}
    for path in paths:
        if np.sum(lengths[path]) < LEAST_SHARE * longest:
            continue
        start, end = links["from_node_id"].iloc[path[0]], links["to_node_id"].iloc[path[-1]]
        name = title = f"{streets.iloc[path[0]]}, {start} to {end}"
        number = 1
        while name in found:
            number += 1
            name = f"{title} ({number})"
        found[name] = links["link_id"].astype(str).iloc[path].tolist()
    return found

"""Networks drawn by the coordinates of their nodes, and shortest ways found plainly on them."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import geopandas
import numpy as np
import pandas as pd
import shapely

from uxsim_geo.network.network import MOVEMENT_COLUMNS, Network

UTM = "EPSG:32632"

#: a road: from, to, and what differs from the default; ``both`` makes a link each way
Road = tuple[str, str, dict[str, Any]]

DEFAULT = {
    "lanes": 1,
    "free_speed": 10.0,
    "jam_density": 0.2,
    "capacity": np.nan,
    "merge_priority": 1.0,
    "road_class": "residential",
    "name": None,
    "lanes_source": "given",
    "free_speed_source": "given",
    "junction": None,
}


def road(start: str, end: str, **values: Any) -> Road:
    return start, end, values


def street(start: str, end: str, **values: Any) -> Road:
    """A road of both directions."""
    return start, end, {"both": True, **values}


def drawn(
    places: Mapping[str, tuple[float, float]],
    roads: Iterable[Road],
    *,
    signals: Iterable[str] = (),
    zones: Mapping[str, str] | None = None,
    bans: Iterable[str] = (),
    crs: str | None = UTM,
) -> Network:
    """Links are called ``a-b``, lengths are those of the drawing unless given.

    A ban is the ids of its links with blanks between: ``a-b b-c``.
    """
    rows = []
    for start, end, values in roads:
        values = dict(values)
        both = values.pop("both", False)
        rows.append(row(places, start, end, values))
        if both:
            rows.append(row(places, end, start, values))
    links = geopandas.GeoDataFrame(rows, geometry="geometry", crs=crs)
    texts = ["link_id", "from_node_id", "to_node_id", "road_class", "name", "source_id"]
    texts += ["lanes_source", "free_speed_source", "junction", "source_node_ids"]
    links[texts] = links[texts].astype("str")
    ids = list(places)
    table = pd.DataFrame(
        {
            "node_id": pd.Series(ids, dtype="str"),
            "zone_id": pd.Series([(zones or {}).get(name) for name in ids], dtype="str"),
            "control": ["signal" if name in set(signals) else "none" for name in ids],
            "through_traffic": True,
        }
    )
    points = [shapely.Point(places[name]) for name in ids]
    nodes = geopandas.GeoDataFrame(table, geometry=points, crs=crs)
    starts = dict(zip(links["link_id"], links["from_node_id"], strict=True))
    movements = []
    for path in (ban.split() for ban in bans):
        between = " ".join(path[1:-1]) or None
        movements.append((starts[path[1]], path[0], path[-1], between))
    columns = [*MOVEMENT_COLUMNS, "via_link_ids"]
    return Network(nodes, links, pd.DataFrame(movements, columns=columns, dtype="str"))


def row(
    places: Mapping[str, tuple[float, float]], start: str, end: str, values: dict[str, Any]
) -> dict[str, Any]:
    through = values.pop("through", [])
    line = shapely.LineString([places[start], *through, places[end]])
    return {
        "link_id": f"{start}-{end}",
        "from_node_id": start,
        "to_node_id": end,
        "length": line.length,
        **DEFAULT,
        "source_id": f"{start}{end}",
        "source_node_ids": f"{start} {end}",
        "geometry": line,
        **values,
    }


def banned(network: Network) -> set[str]:
    """Bans as they are given to :func:`drawn`."""
    table = network.movements.fillna("")
    return {
        " ".join([one, *via.split(), other])
        for one, via, other in table[["from_link_id", "via_link_ids", "to_link_id"]].values
    }


def link(network: Network, link_id: str) -> pd.Series:
    return network.links.set_index("link_id").loc[link_id]


def shuffled(network: Network, seed: int) -> Network:
    """The same tables with their rows in another order."""
    tables = {
        name: getattr(network, name).sample(frac=1.0, random_state=seed).reset_index(drop=True)
        for name in ("nodes", "links", "movements")
    }
    return replace(network, **tables)


def in_order(network: Network) -> list[pd.DataFrame]:
    """The tables sorted, to compare what was made of rows in different orders."""
    nodes = network.nodes.sort_values("node_id", ignore_index=True)
    links = network.links.sort_values("link_id", ignore_index=True)
    columns = ["from_link_id", "to_link_id", "via_link_ids"]
    return [nodes, links, network.movements.sort_values(columns, ignore_index=True)]


def plain_costs(network: Network, origin: str, cost: str) -> dict[str, float]:
    """Least length (or time) from a node to all others, by a search that remembers every link.

    Bans are kept. One turns back only where no other turn leads on from the link, or none into
    the link back, or where a merged junction stands.
    """
    table = network.links.set_index("link_id")
    ends = table["to_node_id"].to_dict()
    starts = table["from_node_id"].to_dict()
    length = table["length"]
    costs = (length if cost == "length" else length / table["free_speed"]).to_dict()
    paths = {tuple(ban.split()) for ban in banned(network)}
    longest = max((len(path) for path in paths), default=2)
    merged = set()
    if "merged_node_ids" in network.nodes:
        merged = set(network.nodes["node_id"][network.nodes["merged_node_ids"].notna()])
    leaving: dict[str, list[str]] = {}
    for name in table.index:
        leaving.setdefault(starts[name], []).append(name)

    def back(one: str, other: str) -> bool:
        ways = starts[one] == ends[other] and ends[one] == starts[other]
        return bool(ways and abs(length[one] - length[other]) < 1e-3)

    onward = {
        one: [o for o in leaving.get(ends[one], []) if (one, o) not in paths] for one in table.index
    }
    straight = {one: [o for o in found if not back(one, o)] for one, found in onward.items()}
    entered = {o for found in straight.values() for o in found}
    for one, found in onward.items():
        turning = [o for o in found if back(one, o)]
        kept = [o for o in turning if not straight[one] or o not in entered or ends[one] in merged]
        onward[one] = straight[one] + kept
    best: dict[str, float] = {origin: 0.0}
    done = set()
    heap = [(costs[first], (first,)) for first in leaving.get(origin, [])]
    heapq.heapify(heap)
    while heap:
        covered, path = heapq.heappop(heap)
        if path in done:
            continue
        done.add(path)
        best.setdefault(ends[path[-1]], covered)
        for other in onward[path[-1]]:
            whole = (*path, other)
            if not any(whole[-len(ban) :] == ban for ban in paths):
                heapq.heappush(heap, (covered + costs[other], whole[-(longest - 1) :]))
    return best


def city(size: int, seed: int) -> Network:
    """A bent grid with gaps, one-way streets, short pieces, dead ends, signals and bans."""
    generator = np.random.default_rng(seed)
    step = generator.choice([15.0, 60.0, 150.0], size=(2, size))
    xs, ys = np.cumsum(step, axis=1)
    jitter = generator.uniform(-4.0, 4.0, size=(size, size, 2))
    places = {
        f"{i}.{j}": (xs[i] + jitter[i, j, 0], ys[j] + jitter[i, j, 1])
        for i in range(size)
        for j in range(size)
    }
    roads = []
    for i in range(size):
        for j in range(size):
            for a, b in ((i + 1, j), (i, j + 1)):
                kind = generator.uniform()
                if a == size or b == size or kind < 0.15:
                    continue
                values = {
                    "lanes": int(generator.integers(1, 3)),
                    "free_speed": float(generator.choice([8.0, 14.0])),
                    "road_class": str(generator.choice(["residential", "primary"])),
                }
                names = (f"{i}.{j}", f"{a}.{b}")
                make = street if kind < 0.75 else road
                roads.append(make(*(names if kind < 0.87 else names[::-1]), **values))
    used = {name for start, end, _ in roads for name in (start, end)}
    places = {name: place for name, place in places.items() if name in used}
    signals = [name for name in places if generator.uniform() < 0.1]
    plain = drawn(places, roads, signals=signals)
    return drawn(places, roads, signals=signals, bans=random_bans(plain, generator))


def random_bans(network: Network, generator: np.random.Generator) -> list[str]:
    """Some turns, and some paths of three links."""
    links = network.links
    leaving = links.groupby("from_node_id")["link_id"].apply(list).to_dict()
    ends = dict(zip(links["link_id"], links["to_node_id"], strict=True))
    bans = set()
    for first in links["link_id"]:
        path = [first]
        for _ in range(int(generator.integers(1, 3))):
            choices = leaving.get(ends[path[-1]], [])
            path += [str(generator.choice(choices))] if choices else []
        if len(path) > 1 and generator.uniform() < 0.08:
            bans.add(" ".join(path))
    return sorted(bans)

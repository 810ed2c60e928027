"""Networks and streams for hypothesis to draw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict

from hypothesis import strategies as st
from plain_paths import best_routes
from small_networks import Row, Stream, link
from twin import TwinLink

from uxsim_geo.settings import Settings

#: link_ids from origin to destination: the only way there is
Routes = dict[tuple[str, str], list[str]]
Drawn = tuple[list[TwinLink], Routes, list[Stream]]


@st.composite
def trees(draw: st.DrawFn, platoon_size: int) -> Drawn:
    """Up to eight links without a second way between any two nodes, and up to six streams.

    Every link stores a whole number of platoons. Lengths and times grow with Δn, so that a case
    has as many platoons and steps whatever their size.
    """
    links: list[TwinLink] = []
    for number in range(draw(st.integers(1, 8))):
        ends = [f"{draw(st.integers(0, number))}", f"{number + 1}"]
        if draw(st.booleans()):
            ends.reverse()
        links.append(_link(draw, f"link{number}", ends, platoon_size))
    routes = routes_of(links)
    pairs = draw(st.lists(st.sampled_from(sorted(routes)), min_size=1, max_size=6, unique=True))
    streams: list[Stream] = []
    for origin, destination in pairs:
        start = platoon_size * draw(st.floats(0, 60))
        end = start + platoon_size * draw(st.floats(40, 120))
        streams.append((origin, destination, start, end, draw(st.floats(0.2, 1.5))))
    return links, {pair: routes[pair] for pair in pairs}, streams


Barred = tuple[list[TwinLink], list[tuple[str, ...]], list[Stream]]


@st.composite
def barred_webs(draw: st.DrawFn, platoon_size: int) -> Barred:
    """Up to twelve links between up to five nodes, up to four streams, and bans.

    Of the fastest ways of the streams some turns, and ways over several links, are banned.
    """
    nodes = draw(st.integers(3, 5))
    links: list[TwinLink] = []
    for number in range(draw(st.integers(6, 12))):
        first = number % nodes
        last = (first + draw(st.integers(1, 2))) % nodes
        links.append(_link(draw, f"link{number}", [f"{first}", f"{last}"], platoon_size))
    rows = [row_of(one) for one in links]
    used = sorted({end for one in links for end in (one.from_node, one.to_node)})
    streams: list[Stream] = []
    for number in range(draw(st.integers(1, 4))):
        origin, destination = draw(st.permutations(used))[:2]
        start = platoon_size * (40 * number + draw(st.floats(0, 20)))
        end = start + platoon_size * draw(st.floats(40, 100))
        streams.append((origin, destination, start, end, draw(st.floats(0.2, 1.0))))
    banned = set(draw(bans(rows, most=4)))
    cost = {one.link_id: one.length / one.free_speed for one in links}
    for origin, destination, *_ in streams:
        _, way = best_routes(rows, [], cost, origin).get(destination, (0.0, ()))
        if len(way) > 1 and draw(st.booleans()):
            begin = draw(st.integers(0, len(way) - 2))
            banned.add(way[begin : draw(st.integers(begin + 2, len(way)))])
    return links, sorted(banned), streams


def row_of(one: TwinLink) -> Row:
    """The row of a link of the twin in a links table."""
    names = {"from_node": "from_node_id", "to_node": "to_node_id"}
    row = {names.get(name, name): value for name, value in asdict(one).items()}
    return row | {"capacity": math.nan if one.capacity is None else one.capacity}


def _link(draw: st.DrawFn, link_id: str, ends: Sequence[str], platoon_size: int) -> TwinLink:
    lanes = draw(st.sampled_from([1, 2, 3]))
    jam_density = draw(st.floats(0.12, 0.2))
    return TwinLink(
        link_id,
        from_node=ends[0],
        to_node=ends[1],
        # a hair more than whole, so that rounding does not make it a hair less
        length=(draw(st.integers(6, 30)) + 1e-9) * platoon_size / (lanes * jam_density),
        free_speed=draw(st.floats(6, 22)),
        lanes=lanes,
        jam_density=jam_density,
        capacity=draw(st.sampled_from([None, None, 0.1, 0.3, 0.5])),
        merge_priority=draw(st.sampled_from([0.5, 1.0, 3.0])),
    )


def routes_of(links: Sequence[TwinLink]) -> Routes:
    """The ways of a tree between all its nodes that have one."""
    routes: Routes = {(link.from_node, link.to_node): [link.link_id] for link in links}
    found = dict(routes)
    while found:
        longer = {
            (start, link.to_node): [*way, link.link_id]
            for (start, end), way in found.items()
            for link in links
            if link.from_node == end
        }
        routes |= longer
        found = longer
    return routes


def substeps_for(links: Sequence[TwinLink]) -> int:
    """The fewest parts of a step that all numbers of lanes divide."""
    return math.lcm(*(link.lanes for link in links))


#: rows of links as `small_networks.link` makes them, and of demand
Tables = tuple[list[Row], list[tuple[str, str, float, float, float]]]


@st.composite
def webs(draw: st.DrawFn, platoon_size: int) -> Tables:
    """Up to eight links between up to five nodes, and up to six flows, more than there is room for.

    The first links make a road from node to node, closed to a ring if there are enough of them; so
    loops, parallel links, dead ends and pairs without a way occur. Lengths and times grow with Δn.
    """
    nodes = draw(st.sampled_from([5, 4, 3, 2]))
    links = []
    for number in range(draw(st.integers(2, 8))):
        first = number if number < nodes else draw(st.integers(0, nodes - 1))
        last = (first + (1 if number < nodes else draw(st.integers(1, nodes - 1)))) % nodes
        links.append(
            link(
                f"link{number}",
                f"{first}",
                f"{last}",
                platoon_size * draw(st.floats(1, 80)),
                free_speed=draw(st.floats(3, 30)),
                lanes=draw(st.integers(1, 3)),
                jam_density=draw(st.floats(0.1, 0.25)),
                capacity=draw(st.sampled_from([math.nan, 0.05, 0.1, 0.4])),
                merge_priority=draw(st.sampled_from([0.5, 1.0, 3.0])),
            )
        )
    used = sorted({row[end] for row in links for end in ("from_node_id", "to_node_id")})
    rows = []
    for _ in range(draw(st.integers(1, 6))):
        origin, destination = draw(st.permutations(used))[:2]
        start = platoon_size * draw(st.floats(0, 60))
        end = start + platoon_size * draw(st.floats(1, 120))
        rows.append(
            (origin, destination, start, end, float(draw(st.integers(10, 80 * platoon_size))))
        )
    return links, rows


def _any_size(least: float, most: float) -> st.SearchStrategy[float]:
    """Numbers of every order of magnitude, the ends often."""
    between = st.floats(math.log10(least), math.log10(most)).map(lambda power: 10.0**power)
    return st.sampled_from([least, most]) | between.filter(lambda drawn: least <= drawn <= most)


_LONGEST = 1e5  # s: of a link of an extreme web

#: rows as of a web, and what the run is told
Extreme = tuple[list[Row], list[tuple[str, str, float, float, float]], Settings]


@st.composite
def extreme_webs(draw: st.DrawFn) -> Extreme:
    """Up to seven links between up to four nodes, whose every attribute is as far out as allowed.

    Lengths of 1 mm to 10,000 km, 1 to 100 lanes, platoons of up to 10,000 vehicles, steps of 0.01 s
    to 11 days, and up to four flows of up to 60 platoons. No way takes 149 hours, beyond which all
    count as equally long.
    """
    nodes = draw(st.sampled_from([4, 3, 2]))
    links = []
    for number in range(draw(st.integers(2, 7))):
        length = draw(_any_size(1e-3, 1e7))
        first = number if number < nodes else draw(st.integers(0, nodes - 1))
        last = (first + (1 if number < nodes else draw(st.integers(1, nodes - 1)))) % nodes
        links.append(
            link(
                f"link{number}",
                f"{first}",
                f"{last}",
                length,
                free_speed=draw(_any_size(max(0.1, length / _LONGEST), 150.0)),
                lanes=draw(st.sampled_from([1, 2, 3, 100])),
                jam_density=draw(_any_size(1e-3, 1.0)),
                capacity=draw(st.sampled_from([math.nan, math.nan, 1e-3, 0.4, 1e3])),
                merge_priority=draw(st.sampled_from([1e-6, 1.0, 1e6])),
            )
        )
    used = sorted({row[end] for row in links for end in ("from_node_id", "to_node_id")})
    size = draw(st.sampled_from([1, 5, 1000, 10_000]))
    reaction_time = draw(st.sampled_from([0.01, 1.3, 100.0]))
    duration = min(draw(st.sampled_from([500.0, 5000.0])) * size * reaction_time, 1e8)
    told = Settings(duration, size, reaction_time=reaction_time, route_update_interval=duration / 7)
    rows = []
    for _ in range(draw(st.integers(1, 4))):
        origin, destination = draw(st.permutations(used))[:2]
        start = duration * draw(st.floats(0, 0.5))
        end = start + duration * draw(st.floats(1e-4, 0.5))
        rows.append((origin, destination, start, end, float(draw(st.integers(1, 60 * size)))))
    return links, rows, told


@st.composite
def bans(draw: st.DrawFn, links: Sequence[Row], most: int = 6) -> list[tuple[str, ...]]:
    """Up to so many banned paths of two to four links that follow one another; or just turns."""
    banned = set()
    for _ in range(draw(st.integers(0, most))):
        way = [draw(st.sampled_from(links))]
        for _ in range(draw(st.sampled_from([1, 1, 1, 2, 3]))):
            following = [row for row in links if row["from_node_id"] == way[-1]["to_node_id"]]
            if following:
                way.append(draw(st.sampled_from(following)))
        if len(way) > 1:
            banned.add(tuple(row["link_id"] for row in way))
    return sorted(banned)

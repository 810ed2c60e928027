"""The scene of a picture in space and time: the map as the ground, links as walls, time upwards.

A scene is arrays and texts by name, in the coordinates of :class:`Frame`, ready to be drawn by
somebody who knows nothing of traffic:

{mesh}.points, {mesh}.faces or {mesh}.lines, {mesh}.rgb
    for each mesh: points (n, 3), rows of points of its quads (m, 4) or straight lines (m, 2), and
    the colour of each (m, 3), 0 to 255. Meshes: minor and major (roads), slow (roads that are
    slow at some time), ribbons, queues, trajectories
axes, sides
    as :func:`uxsim_geo.export.space_time.frame.axes` makes them
ground, corners, height, duration
    least x and y, greatest x and y of the map; its corners; height of the axis, and its time, s
feet
    lines (n, 2, 3) under walls that float
marks.points, marks.texts
    numbers on poles at the places of ``notes``
title, notes, subtitle, attribution, scale_title, scale_labels, scale_rgb
    texts, and the colour bar
plane, plane_text
    height of the time plane, and what is said of it
names, links.speed, links.density, links.queue, links.free
    of links with walls: names; km/h, veh/km per lane and m of queue in every bin; km/h
walls.link, walls.first, walls.last
    of every box, ribbons before queues: row of ``names``, first and last of its bins
edges
    of the bins, s
"""

from __future__ import annotations

from typing import Any

import numpy as np

from uxsim_geo.analysis.state_grid import States
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.lost_time import in_words
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.space_time.bins import coarser
from uxsim_geo.export.space_time.choice import Choice
from uxsim_geo.export.space_time.frame import Frame, axes, time_marks
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.space_time.places import place_parts
from uxsim_geo.export.space_time.roads import empty_parts, lines_mesh, road_meshes
from uxsim_geo.export.space_time.scale import Scale
from uxsim_geo.export.space_time.walls import (
    QUEUE,
    RIBBON,
    Pieces,
    Walls,
    quads,
    runs,
)
from uxsim_geo.export.street_names import street_names
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH, TIMES

MOST_FEET = 150  # more lines under walls would be a thicket
WAY = (70.0, 70.0, 90.0)  # colour of trajectories


def space_time_scene(
    network: Network, states: States, look: Look, ways: list[Floats] | None = None
) -> dict[str, Any]:
    """Make the scene of states of links.

    ``states`` as :mod:`uxsim_geo.analysis.link_states` gives them, as a table or kept, which takes
    less memory; ``ways`` of vehicles as points (n, 3): x, y in units of the projected map, and
    time, s. Raises ValueError if the network has no geometry.
    """
    plane = MapPlane.of(network)
    choice = Choice.of(network, coarser(states, network), plane, look)
    end = float(choice.grid.end[-1])
    frame = Frame.of(plane, choice.box, end, crowded=choice.is_crowded)
    clock = look.clock([*choice.grid.begin, end])
    scale = Scale.of(look, choice)
    pieces = Pieces.of(frame, choice.links, look.driving_side)
    ribbons, queues = walls_of(network, choice, scale, look)
    return {
        "title": f"{look.title}: slow links in space and time",
        **place_parts(network, states, frame, look),
        "subtitle": _subtitle(network, choice, look, clock),
        "attribution": look.attribution,
        "scale_title": scale.title,
        "scale_labels": np.array(scale.labels()),
        "scale_rgb": scale.rgb(),
        **boxes("ribbons", frame, pieces, ribbons, scale.rgb()),
        **boxes("queues", frame, pieces, queues, scale.rgb()),
        **_told(network, choice),
        **_walls_told(choice, frame, pieces, (ribbons, queues)),
        "feet": feet(frame, pieces, ribbons),
        **road_meshes(network, frame),
        **_slow_roads(choice, frame, scale, look),
        **trajectories_mesh(frame, ways or []),
        **axes(frame, time_marks(frame, clock), title_of(clock)),
        "ground": frame.ground,
        "corners": frame.corners(),
        "height": frame.height,
        "duration": frame.duration,
        "plane": frame.upwards(_plane_time(choice, look)),
        "plane_text": f"plane: {clock.text(_plane_time(choice, look))}",
    }


def walls_of(network: Network, choice: Choice, scale: Scale, look: Look) -> tuple[Walls, Walls]:
    """Ribbons over whole links, equal bins as one, and the walls of queues, a bin each."""
    links = choice.links
    values = choice.percent if look.colour == "speed" else choice.density
    classes = np.where(choice.slow[links], scale.classes(values[links]), -1)
    begin, end = choice.grid.begin, choice.grid.end
    link, first, last, colour = runs(
        classes if "ribbons" in look.show else np.full_like(classes, -1)
    )
    half = np.full(len(link), RIBBON)
    ribbons = Walls(link, begin[first], end[last], np.zeros(len(link)), colour, half)
    length = network.links["length"].to_numpy(float)[links, None]
    share = np.minimum(choice.grid.values("queue_length")[links] / length, 1.0)
    shown = (classes >= 0) & (share > 0) & ("queues" in look.show)
    link, bin_ = np.nonzero(shown)
    half = np.full(len(link), QUEUE)
    tail = 1.0 - share[link, bin_]
    return ribbons, Walls(link, begin[bin_], end[bin_], tail, classes[link, bin_], half)


def boxes(name: str, frame: Frame, pieces: Pieces, walls: Walls, colours: Floats) -> dict[str, Any]:
    """The mesh of walls; ``colours`` of their classes, 0 to 255, shape (classes, 3)."""
    corners, wall = pieces.boxes(frame, walls)
    points, faces = quads(corners)
    rgb = np.repeat(colours[walls.colour[wall]], 6, axis=0)
    return {f"{name}.points": points, f"{name}.faces": faces, f"{name}.rgb": rgb}


def _told(network: Network, choice: Choice) -> dict[str, Any]:
    """What somebody may ask of a link that is drawn: its name, and its figures in every bin."""
    links = choice.links
    free = network.links["free_speed"].to_numpy(float)[links] * KMH
    return {
        "edges": np.append(choice.grid.begin, choice.grid.end[-1]),
        "names": _full_names(network, links),
        "links.free": free,
        "links.speed": choice.grid.values("speed")[links] * KMH,
        "links.density": choice.density[links],
        "links.queue": choice.grid.values("queue_length")[links],
    }


def _full_names(network: Network, links: Integers) -> Any:
    """Streets with the ids of their links, which go by those alone where they have no name."""
    names = street_names(network.links).to_numpy(object)[links]
    ids = network.links["link_id"].astype(str).to_numpy(object)[links]
    told = (
        name if name == f"link {id_}" else f"{name}, link {id_}"
        for name, id_ in zip(names, ids, strict=True)
    )
    return np.array(list(told), dtype=str)


def _walls_told(
    choice: Choice, frame: Frame, pieces: Pieces, walls: tuple[Walls, Walls]
) -> dict[str, Any]:
    """Of every box, first of ribbons and then of queues: its link, first and last bin."""
    own = [one.part(pieces.boxes(frame, one)[1]) for one in walls]
    link, begin, end = (
        np.concatenate([getattr(one, name) for one in own]) for name in ("link", "begin", "end")
    )
    first = np.searchsorted(choice.grid.begin, begin)
    return {
        "walls.link": link,
        "walls.first": first,
        "walls.last": np.searchsorted(choice.grid.end, end),
    }


def feet(frame: Frame, pieces: Pieces, ribbons: Walls) -> Floats:
    """Upright lines under the middles of links whose lowest wall floats, shape (links, 2, 3)."""
    links, first = np.unique(ribbons.link, return_index=True)  # of a link in order of time
    top = frame.upwards(ribbons.begin[first])
    links, top = links[top > 0], top[top > 0]
    if not len(links) or len(links) > MOST_FEET:
        return np.empty((0, 2, 3))
    xy = np.array([pieces.middle(link) for link in links])
    ends = [np.column_stack([xy, np.zeros(len(xy))]), np.column_stack([xy, top])]
    return np.stack(ends, axis=1)


def _slow_roads(choice: Choice, frame: Frame, scale: Scale, look: Look) -> dict[str, Any]:
    """On the ground the worst state of all links that are slow at some time, with walls or not."""
    links = np.concatenate([choice.on_ground(), choice.links])  # walls stand on what lies on top
    values = choice.percent if look.colour == "speed" else choice.density
    worst = np.nanmin if look.colour == "speed" else np.nanmax
    if not len(links):
        return empty_parts("slow")
    pieces = Pieces.of(frame, links, look.driving_side)
    own = worst(np.where(choice.slow[links], values[links], np.nan), axis=1)
    rgb = np.repeat(scale.rgb()[scale.classes(own)], np.diff(pieces.first), axis=0)
    ends = np.stack([pieces.begin, pieces.end], axis=1)
    inside = ((ends >= frame.ground[:2]) & (ends <= frame.ground[2:])).all(axis=(1, 2))
    ends, rgb = ends[inside].reshape(-1, 2), rgb[inside]
    points = np.column_stack([ends, np.full(len(ends), 1e-4)])
    return lines_mesh("slow", points, np.arange(len(ends)).reshape(-1, 2), rgb)


def trajectories_mesh(frame: Frame, ways: list[Floats]) -> dict[str, Any]:
    """Ways of vehicles as lines."""
    points = np.concatenate([np.empty((0, 3)), *ways])
    counts = np.array([len(way) for way in ways], np.int64)
    last = np.cumsum(counts) - 1
    drawn = np.column_stack([frame.on_ground(points[:, :2]), frame.upwards(points[:, 2])])
    x0, y0, x1, y1 = frame.ground
    x, y = drawn[:, 0], drawn[:, 1]
    outside = np.flatnonzero((x < x0) | (x > x1) | (y < y0) | (y > y1))
    rows = np.setdiff1d(np.arange(len(points)), np.concatenate([last, outside, outside - 1]))
    rgb = np.tile(WAY, (len(rows), 1))
    return lines_mesh("trajectories", drawn, np.stack([rows, rows + 1], axis=1), rgb)


def _subtitle(network: Network, choice: Choice, look: Look, clock: Clock) -> str:
    """What is drawn, of what, and the delay of all."""
    drawn, whole = choice.lost
    slow = int(choice.slow.any(axis=1).sum())
    parts = {
        "ribbons": f"a link while slower than {100 * look.slower_than:.0f} % of free speed",
        "queues": "thick: its queue, up to the tail",
    }
    said = [text for part, text in parts.items() if part in look.show]
    count, links = len(choice.links), len(network.links)
    bin_s = choice.grid.end[0] - choice.grid.begin[0]
    which = "all" if count == slow else f"the {count:,} with most delay"
    share = f", {drawn / whole:.0%} of all delay" if count < slow and whole > 0 else ""
    return (
        f"{links:,} links, {slow:,} of them slow at some time; walls: {which}{share}. "
        f"Time lost on all links: {in_words(whole * TIMES['h'])}; most vehicles queue at "
        f"{clock.text(choice.worst_time)}\nwall, by {bin_s / 60:g} min: {'; '.join(said)}. "
        "On the ground: the worst state of every slow link; grey: all others"
    )


def title_of(clock: Clock) -> str:
    """Of the axis: the zone of the time of day, or what is counted."""
    return f"time, {clock.zone}" if clock.zone else "time, h:min"


def _plane_time(choice: Choice, look: Look) -> float:
    return choice.worst_time if look.time is None else look.time

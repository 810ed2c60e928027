"""Desire lines: who wants to go where, and how much later than on empty roads they arrive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.colours import NEUTRAL
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.map_sheet import INK, MapSheet, in_words, legend_steps
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import TIMES

if TYPE_CHECKING:
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

MOST = 100  # pairs that the eye can tell apart
BOW = 0.12  # of a line's length
LEAST_DELAY = 1e-3  # min; less is none, and makes no scale
POINTS = 21  # of a line
THIN, WIDE = 0.5, 6.0  # lines of the largest pairs, points


class _Pairs(NamedTuple):
    """OD pairs from the smallest on: rows of nodes, vehicles, mean delay (s)."""

    origin: Integers
    destination: Integers
    vehicles: Floats
    delay: Floats


def desire_lines_figure(
    network: Network, od: pd.DataFrame, title: str, *, most: int = MOST
) -> Figure:
    """Map of the OD pairs: width is the number of vehicles, colour their mean delay.

    ``od`` comes from :func:`uxsim_geo.analysis.od.od_table`; classes and slices of time are taken
    together. Vehicles are those who have departed, with their delay so far. The ``most`` largest
    pairs are drawn so, all others thin and grey below them; of equal ones as many as there is room
    for, spread evenly over the table. Lines bow to the right of their direction, so that both
    directions show; trips within a node have none. Raises ValueError if the network has no geometry
    or lacks a node of the table.
    """
    pairs = _pairs(network, od, most)
    plane = MapPlane.of(network)
    lines = _curves(plane.points[pairs.origin], plane.points[pairs.destination])
    sheet = MapSheet.around(plane, title, _extent(plane, lines))
    sheet.draw_roads(plane.lines)
    first = max(len(lines) - most, 0)
    shown = _draw_largest(sheet, lines[first:], pairs, first)
    _draw_others(sheet, lines[:first])
    _draw_destinations(sheet, network, pairs.destination[first:])
    sheet.draw_scale()
    sheet.colour_bar(shown, "mean delay so far, min")
    _draw_legend(sheet, pairs, first)
    return sheet.figure


def _pairs(network: Network, od: pd.DataFrame, most: int) -> _Pairs:
    """Sum classes and slices; without pairs of one place, and those of whom nobody departed."""
    ends = ("origin", "destination")
    names = {end: od[end].astype(str).to_numpy() for end in ends}
    sums = od[["vehicles_departed", "total_delay_so_far_veh_s"]].groupby(
        [names[end] for end in ends], sort=False
    )
    table = sums.sum()
    table = table[table["vehicles_departed"] > 0]
    nodes = pd.Index(network.nodes["node_id"].astype(str))
    origin, destination = (
        nodes.get_indexer(table.index.get_level_values(level)) for level in range(2)
    )
    if min(origin.min(initial=0), destination.min(initial=0)) < 0:
        raise ValueError("the table names nodes that the network lacks")
    vehicles, delay = (table[name].to_numpy(float) for name in table.columns)
    apart = np.flatnonzero(origin != destination)
    order = apart[_largest_last(vehicles[apart], most)]
    mean = delay[order] / vehicles[order]
    return _Pairs(
        origin[order].astype(np.int64), destination[order].astype(np.int64), vehicles[order], mean
    )


def _largest_last(vehicles: Floats, most: int) -> Integers:
    """Places of the pairs from the smallest on, in such an order that the last ``most`` are shown.

    Of equal ones at that limit those are shown that are spread evenly over the table: its last ones
    would all come from the same few origins.
    """
    order = np.argsort(vehicles, kind="stable").astype(np.int64)
    first = len(order) - most
    if first <= 0:
        return order
    limit = vehicles[order[first]]
    begin, end = (int(np.searchsorted(vehicles[order], limit, side)) for side in ("left", "right"))
    wanted = end - first
    shown = np.zeros(end - begin, bool)
    shown[((np.arange(wanted) + 0.5) * len(shown) / wanted).astype(np.int64)] = True
    equal = order[begin:end]
    order[begin:end] = np.concatenate([equal[~shown], equal[shown]])
    return order


def _curves(start: Floats, end: Floats) -> Floats:
    """Parabolas from start to end that bow to the right; shape (pairs, points, 2)."""
    along = end - start
    right = np.stack([along[:, 1], -along[:, 0]], axis=1)
    control = (start + end) / 2 + 2 * BOW * right
    t = np.linspace(0.0, 1.0, POINTS)[None, :, None]
    curves: Floats = (
        (1 - t) ** 2 * start[:, None] + 2 * t * (1 - t) * control[:, None] + t**2 * end[:, None]
    )
    return curves


def _extent(plane: MapPlane, lines: Floats) -> tuple[float, float, float, float]:
    """That of the map, and of all that bows out of it."""
    x0, y0, x1, y1 = plane.extent
    edge = 0.01 * max(x1 - x0, y1 - y0)
    places = np.concatenate([lines.reshape(-1, 2), plane.points])
    low, high = places.min(axis=0) - edge, places.max(axis=0) + edge
    return min(x0, low[0]), min(y0, low[1]), max(x1, high[0]), max(y1, high[1])


def _widths(vehicles: npt.ArrayLike, largest: float) -> Floats:
    return THIN + (WIDE - THIN) * np.asarray(vehicles, float) / max(largest, 1e-9)


def _draw_largest(sheet: MapSheet, lines: Floats, pairs: _Pairs, first: int) -> LineCollection:
    """The largest pairs; the larger lie on top."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize

    minutes = pairs.delay[first:] / TIMES["min"]
    longest = float(minutes.max(initial=0.0))
    vehicles = pairs.vehicles[first:]
    collection = LineCollection(
        list(lines),
        array=minutes,
        cmap=_colours(),
        norm=Normalize(0.0, longest if longest > LEAST_DELAY else 1.0),
        linewidths=_widths(vehicles, float(vehicles.max(initial=0.0))),
        alpha=0.85,
        zorder=2.5,
    )
    sheet.axes.add_collection(collection)
    return collection


def _draw_destinations(sheet: MapSheet, network: Network, nodes: Integers) -> None:
    """Names of all nodes; where there is no room for them, dots where the lines shown end."""
    sheet.draw_nodes(network)
    if not sheet.names_nodes:
        x, y = sheet.plane.points[np.unique(nodes)].T
        sheet.axes.scatter(x, y, s=14, c=INK, edgecolors="white", linewidths=0.4, zorder=3)


def _draw_others(sheet: MapSheet, lines: Floats) -> None:
    from matplotlib.collections import LineCollection

    opacity = float(np.clip(300 / max(len(lines), 1), 0.12, 0.4))  # thousands are no fog
    style: dict[str, Any] = {"colors": "#777777", "linewidths": 0.3, "alpha": opacity}
    sheet.axes.add_collection(LineCollection(list(lines), zorder=2, **style))


def _colours() -> ListedColormap:
    """Viridis from green to dark blue: the longer the delay, the darker; white hides yellow."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["viridis_r"](np.linspace(0.15, 1.0, 256)))


def _draw_legend(sheet: MapSheet, pairs: _Pairs, first: int) -> None:
    from matplotlib.lines import Line2D

    if not len(pairs.vehicles):
        sheet.note("nobody has departed")
        return
    shown = legend_steps(pairs.vehicles)
    widths = _widths(shown, float(pairs.vehicles[-1]))
    handles = [Line2D([], [], color=INK, linewidth=width) for width in widths]
    labels = [f"{number:,.4g}" for number in shown]
    if first:
        handles.append(Line2D([], [], color=NEUTRAL, linewidth=1.0))
        labels.append("other pairs")
    sheet.legend(handles, labels, "vehicles of a pair")
    share = pairs.vehicles[first:].sum() / pairs.vehicles.sum()
    sheet.note(
        f"{len(pairs.vehicles) - first:,} of {in_words(len(pairs.vehicles), 'pair')},\n"
        f"{100 * share:.0f} % of vehicles.\nLines bow to the right\nof their direction"
        f"{'.' if sheet.names_nodes else ',' + chr(10) + 'dots are their ends.'}"
    )

"""Which links of a network a picture in space and time shows.

Of thousands of links a picture can show some dozens before walls hide one another. Those that
matter are those on which people lost most time in states below a share of the free speed; a lone
vehicle that waits does not count. The others that were slow lie on the ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import PER_KM

FEW_LINKS = 200  # of a network up to so large the whole map is shown
MOST_WALLS = 200  # unless another number is asked for
LEAST_WALLS = 20  # of a large network, however long they are
CROWDED = 0.7  # length of walls x share of the time, of the map's side: more hide one another
SHORTEST = 0.015  # of that side: a shorter wall is a stripe that hides as much
SPARSE = 0.03  # of jam density: states below are a few vehicles, and no queue
OUTLYING = 0.03  # of the lost time lies beyond each side of the part of a large map that is shown
MARGIN = 0.12  # beyond that, of its larger side


@dataclass(frozen=True)
class Choice:
    """What is drawn; arrays have the shape (links, bins) of the network unless stated.

    slow
        states that are drawn if their link is
    links
        rows of the links that are drawn as walls, most lost time first
    percent, density
        speed, % of free speed, at most 100, NaN where nobody was; veh/km per lane
    jam
        the density of standing traffic on each link, veh/km per lane
    box
        least x and y, greatest x and y of what is shown of the map, in its units
    """

    grid: StateGrid
    slow: npt.NDArray[np.bool_]
    links: Integers
    percent: Floats
    density: Floats
    jam: Floats
    box: tuple[float, float, float, float]

    @classmethod
    def of(cls, network: Network, states: States, plane: MapPlane, look: Look) -> Choice:
        """Choose links by the time lost in their slow states."""
        grid = StateGrid.of_all(states, network)
        free, jam, lanes = (
            network.links[name].to_numpy(float)[:, None]
            for name in ("free_speed", "jam_density", "lanes")
        )
        percent = np.minimum(100 * grid.values("speed") / free, 100.0)
        density = grid.values("density") / lanes
        slow = (percent < 100 * look.slower_than) & (density >= SPARSE * jam)
        lost = np.where(slow, grid.values("delay"), 0.0).sum(axis=1)
        order = np.argsort(-lost, kind="stable")
        links = order[lost[order] > 0][: look.most_links or MOST_WALLS]
        box = plane.extent
        if len(network.links) > FEW_LINKS and links.size:
            box, inside = part_of_map(plane, links, lost[links])
            links = links[inside]
            if look.most_links is None:
                links = links[: number_with_room(plane, box, links, slow[links])]
        return cls(grid, slow, links, percent, density * PER_KM, jam.ravel() * PER_KM, box)

    @property
    def is_crowded(self) -> bool:
        """Whether the network is one of so many links that high walls would hide others."""
        return len(self.slow) > FEW_LINKS

    @property
    def worst_time(self) -> float:
        """End of the bin at which most vehicles queued, s."""
        return float(self.grid.end[np.argmax(self.grid.values("queue").sum(axis=0))])

    @property
    def lost(self) -> tuple[float, float]:
        """Time lost on the links that are drawn, and on all, veh·h."""
        delay = self.grid.values("delay")
        return float(delay[self.links].sum()) / 3600, float(delay.sum()) / 3600

    def on_ground(self) -> Integers:
        """Rows of the links that are slow at some time but no walls, in the network's order."""
        slow: Integers = np.setdiff1d(np.flatnonzero(self.slow.any(axis=1)), self.links)
        return slow


def number_with_room(
    plane: MapPlane,
    box: tuple[float, float, float, float],
    links: Integers,
    slow: npt.NDArray[np.bool_],
) -> int:
    """So many walls as do not crowd the map: by their length, and for how long they are there."""
    import shapely

    side = max(box[2] - box[0], box[3] - box[1])
    length = np.maximum(shapely.length(plane.lines[links]) / side, SHORTEST)
    area = length * slow.mean(axis=1)
    return max(int(np.searchsorted(np.cumsum(area), CROWDED, side="right")), LEAST_WALLS)


def part_of_map(
    plane: MapPlane, links: Integers, lost: Floats
) -> tuple[tuple[float, float, float, float], npt.NDArray[np.bool_]]:
    """The part of the map that holds nearly all lost time, and which links lie in it."""
    import shapely

    middles = shapely.get_coordinates(
        shapely.line_interpolate_point(plane.lines[links], 0.5, normalized=True)
    )
    sides = [_quantiles(along, lost) for along in middles.T]
    x0, y0, x1, y1 = plane.extent
    larger = max(high - low for low, high in sides)
    least = 0.25 * max(x1 - x0, y1 - y0)
    margin = MARGIN * larger
    (left, right), (bottom, top) = (
        _widened(low - margin, high + margin, max(least, 0.6 * larger)) for low, high in sides
    )
    box = (max(left, x0), max(bottom, y0), min(right, x1), min(top, y1))
    x, y = middles.T
    inside = (x >= box[0]) & (x <= box[2]) & (y >= box[1]) & (y <= box[3])
    return box, inside


def _quantiles(values: Floats, weights: Floats) -> tuple[float, float]:
    """Between these all but a small part of the weight lies."""
    order = np.argsort(values, kind="stable")
    share = np.cumsum(weights[order]) / weights.sum()
    first = int(np.searchsorted(share, OUTLYING))
    last = min(int(np.searchsorted(share, 1 - OUTLYING)), len(values) - 1)
    return float(values[order[first]]), float(values[order[last]])


def _widened(low: float, high: float, least: float) -> tuple[float, float]:
    more = max(least - (high - low), 0.0) / 2
    return low - more, high + more

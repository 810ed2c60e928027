"""Which links meet where: what turn restrictions are sought on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.incidence import Grouped
from uxsim_geo.network.osm_file import PER_DEGREE, OsmFile
from uxsim_geo.network.osm_links import DirectedLinks
from uxsim_geo.network.osm_relations import RestrictionError
from uxsim_geo.network.osm_sections import Rows, Sections


@dataclass(frozen=True)
class Junctions:
    """Which links start and end at a node, and which are of a way.

    leaving, ending
        rows of links by the row of the node they start at, and they end at
    of_way
        where the links of each way begin, since links are sorted by way; (ways + 1,)
    """

    file: OsmFile
    sections: Sections
    links: DirectedLinks
    leaving: Grouped
    ending: Grouped
    of_way: Rows

    def start(self, link: int) -> int:
        """Row of the node a link starts at."""
        return int(self.links.start[link])

    def end(self, link: int) -> int:
        """Row of the node a link ends at."""
        return int(self.links.end[link])

    def back(self, link: int, other: int) -> bool:
        """Whether the other link is the way back along the first."""
        return bool(self.links.section[link] == self.links.section[other]) and link != other

    def from_node(self, node: int) -> list[int]:
        """Rows of the links that start at the row of a node."""
        return [int(row) for row in self.leaving.rows_of_one(node)]

    def to_node(self, node: int) -> list[int]:
        """Rows of the links that end at the row of a node."""
        return [int(row) for row in self.ending.rows_of_one(node)]

    def of(self, way_id: int) -> range:
        """Rows of the links of a way. Raises :class:`RestrictionError` if it has none."""
        way = int(np.searchsorted(self.file.way_ids, way_id))
        if way < len(self.file.way_ids) and self.file.way_ids[way] == way_id:
            links = range(int(self.of_way[way]), int(self.of_way[way + 1]))
            if links:
                return links
        if way_id in self.file.dropped_ids:
            raise RestrictionError("restriction on other roads", f"way {way_id} is no road here")
        raise RestrictionError("broken restriction", f"way {way_id} is no road in the file")

    def arriving(self, links: range, node: int) -> list[int]:
        """Those of the links that end at the row of a node."""
        ends = self.links.end[links.start : links.stop]
        return [links.start + int(row) for row in np.flatnonzero(ends == node)]

    def departing(self, links: range, node: int) -> list[int]:
        """Those of the links that start at the row of a node."""
        starts = self.links.start[links.start : links.stop]
        return [links.start + int(row) for row in np.flatnonzero(starts == node)]

    def nodes_of(self, links: range) -> set[int]:
        """Rows of the nodes at which the links start or end."""
        rows = slice(links.start, links.stop)
        return {*self.links.start[rows].tolist(), *self.links.end[rows].tolist()}

    def angle(self, link: int, other: int) -> float:
        """By how much one turns from a link into another, degrees: left above 0, within ±180."""
        before, after = self._heading(link, at_end=True), self._heading(other, at_end=False)
        return (after - before + 180.0) % 360.0 - 180.0

    def _heading(self, link: int, *, at_end: bool) -> float:
        """Direction of a link's last piece (or its first), degrees from east to the left."""
        section = self.links.section[link]
        points = self.sections.points[
            self.sections.first[section] : self.sections.first[section + 1]
        ]
        if self.links.backward[link]:
            points = points[::-1]
        low, high = points[-2:] if at_end else points[:2]
        (west, south), (east, north) = (self._place(low), self._place(high))
        across = (east - west + 180.0) % 360.0 - 180.0
        return math.degrees(math.atan2(north - south, across * math.cos(math.radians(south))))

    def _place(self, node: int) -> tuple[float, float]:
        return int(self.file.x[node]) / PER_DEGREE, int(self.file.y[node]) / PER_DEGREE


def junctions_of(file: OsmFile, sections: Sections, links: DirectedLinks) -> Junctions:
    """Group the links by where they start, and by where they end."""
    leaving, ending = (Grouped.of(node, len(file.node_ids)) for node in (links.start, links.end))
    ways = np.arange(len(file.way_ids) + 1)
    return Junctions(file, sections, links, leaving, ending, np.searchsorted(links.way, ways))

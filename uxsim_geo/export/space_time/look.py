"""What a picture in space and time is to show, and how."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from uxsim_geo.export.clock import Clock
from uxsim_geo.network.driving_side import DrivingSide

Colour = Literal["speed", "density"]
Part = Literal["ribbons", "queues", "trajectories", "time_plane"]
Camera = Literal["auto", "south", "east", "north", "west", "above"]


@dataclass(frozen=True)
class Look:
    """How space and time are drawn.

    title
        above the picture
    start
        date and time of second 0, with its zone; None: the clock begins at 0:00
    colour
        what the colour of ribbons says: speed, % of free speed, or density, veh/km per lane
    show
        parts of the scene beside the map
    slower_than
        share of the free speed under which a link's state is drawn, 0 to 1
    most_links
        so many links at most are drawn as ribbons, those that lost most time; None: 200, and of a
        large network only as many as do not hide one another
    most_trajectories
        so many platoons at most, spread evenly over all
    time
        of the time plane, s; None: when most vehicles queued
    size
        pixels, across and up
    driving_side
        the side of their road that links stand on
    attribution
        who is to be named beside the picture; empty: nobody
    """

    title: str = ""
    start: datetime | None = None
    colour: Colour = "speed"
    show: tuple[Part, ...] = ("ribbons", "queues")
    slower_than: float = 0.6
    most_links: int | None = None
    most_trajectories: int = 300
    time: float | None = None
    size: tuple[int, int] = (1600, 1200)
    driving_side: DrivingSide = "right"
    attribution: str = ""

    def clock(self, edges: Iterable[float]) -> Clock:
        """The clock of a run whose bins have these edges, s."""
        return Clock.of(self.start, edges)

"""What a picture in space and time is to show, and how."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Literal

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

    def clock(self, seconds: float) -> str:
        """The time of day, as 7:05, or hours and minutes since the start, which may be many."""
        if self.start is None:
            minutes = round(seconds / 60)
            return f"{minutes // 60}:{minutes % 60:02d}"
        then = self.start + timedelta(seconds=seconds)
        then += timedelta(seconds=30)  # to the nearest minute
        return f"{then.hour}:{then.minute:02d}"

    @property
    def clock_title(self) -> str:
        """What the clock counts from, or the zone in which it shows the time of day."""
        if self.start is None:
            return "time, h:min"
        offset = self.start.utcoffset() or timedelta()
        hours, minutes = divmod(round(abs(offset).total_seconds() / 60), 60)
        ahead = f"{'−' if offset < timedelta() else '+'}{hours}" if offset else ""
        return f"time, UTC{ahead}{f':{minutes:02d}' if minutes else ''}"

    @property
    def second_of_day(self) -> float:
        """On the clock at the start."""
        if self.start is None:
            return 0.0
        return self.start.hour * 3600.0 + self.start.minute * 60.0 + self.start.second

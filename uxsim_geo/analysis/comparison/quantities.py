"""What runs are compared by: every quantity with its unit, its meaning and which way is better.

Tables and columns of a comparison, words on pictures and the documentation come from here.
"""

from __future__ import annotations

from typing import NamedTuple

LESS, EITHER, MORE = -1, 0, 1

#: what stands behind the name of a quantity in a table of differences
SUFFIXES = (
    "base",
    "scenario",
    "difference",
    "low",
    "high",
    "relative",
    "p",
    "adjusted_p",
    "significant",
    "seeds",
)


class Quantity(NamedTuple):
    """A figure of a run, or a column of one of its tables.

    name (with the unit in it), title (what a reader calls it), unit, what (its definition), better
    (-1: the less the better, 1: the more, 0: neither), adds_up (a sum, which is 0 of nobody; else a
    mean, which is undefined of nobody)
    """

    name: str
    title: str
    unit: str
    what: str
    better: int = EITHER
    adds_up: bool = False


def _sum(name: str, title: str, unit: str, what: str, better: int = EITHER) -> Quantity:
    return Quantity(name, title, unit, what, better, adds_up=True)


TOTALS = (
    _sum("vehicles_demanded", "vehicles demanded", "veh", "all, whenever they depart"),
    _sum("vehicles_departed", "vehicles departed", "veh", "those who wanted to depart in the run"),
    _sum("vehicles_completed", "vehicles arrived", "veh", "trips completed", MORE),
    _sum("vehicles_unfinished", "vehicles unfinished", "veh", "waiting or on the road", LESS),
    _sum("vehicles_waiting", "vehicles waiting", "veh", "not yet in the network at the end", LESS),
    _sum("vehicles_aborted", "vehicles without a way", "veh", "trips that were given up", LESS),
    _sum(
        "total_travel_time_veh_h",
        "total travel time",
        "veh·h",
        "from the wish to depart to the arrival, of the unfinished to the end of the run",
        LESS,
    ),
    _sum(
        "total_origin_wait_veh_h",
        "wait to enter",
        "veh·h",
        "the part of the total travel time before the network was entered",
        LESS,
    ),
    _sum(
        "total_delay_veh_h",
        "total delay",
        "veh·h",
        "total travel time less that at free flow, of the unfinished that of what they drove",
        LESS,
    ),
    Quantity(
        "completed_average_travel_time_s",
        "mean travel time of completed trips",
        "s",
        "the unfinished are left out: look at their number too",
        LESS,
    ),
    Quantity(
        "completed_average_delay_s",
        "mean delay of completed trips",
        "s",
        "the unfinished are left out: look at their number too",
        LESS,
    ),
    _sum("total_distance_veh_km", "distance driven", "veh·km", "of all vehicles"),
    Quantity("average_speed_kmh", "mean speed", "km/h", "distance / time in the network", MORE),
    _sum("total_toll", "tolls paid", "currency", "by all vehicles so far"),
    Quantity("gridlocked", "runs in gridlock", "share of runs", "1 or 0 for a single run", LESS),
)

LINKS = (
    _sum("volume_veh", "volume", "veh", "vehicles that entered in the run"),
    _sum("time_veh_h", "time spent", "veh·h", "by all vehicles on the link", LESS),
    _sum("delay_veh_h", "delay", "veh·h", "time spent less distance / free speed", LESS),
    Quantity("speed_kmh", "speed", "km/h", "distance driven / time spent", MORE),
    Quantity(
        "experienced_travel_time_s", "travel time", "s", "mean on the link of those who left", LESS
    ),
    _sum("queue_m", "longest queue", "m", "the longest at the end of a time bin", LESS),
)

LINK_TIMES = (
    _sum("flow_vph", "flow", "veh/h", "distance driven / (length × bin)"),
    _sum("delay_veh_h", "delay", "veh·h", "time lost on the link in the bin", LESS),
    Quantity("speed_kmh", "speed", "km/h", "distance driven / time spent", MORE),
    Quantity(
        "experienced_travel_time_s", "travel time", "s", "mean of those who left in the bin", LESS
    ),
    _sum("queue_m", "queue", "m", "at the end of the bin", LESS),
)

#: of pairs of nodes, pairs of zones, and zones
TRIPS = (
    _sum("demanded_veh", "demand", "veh", "vehicles that want to go, whenever they depart"),
    _sum("departed_veh", "departed", "veh", "those whose wish fell into the run"),
    _sum("completed_veh", "arrived", "veh", "trips completed", MORE),
    _sum("unfinished_veh", "unfinished", "veh", "waiting or on the road at the end", LESS),
    Quantity(
        "travel_time_s",
        "travel time so far",
        "s",
        "mean of the departed since the wish to depart, of the unfinished to the end of the run",
        LESS,
    ),
    Quantity("delay_s", "delay so far", "s", "that time less the one at free flow", LESS),
    _sum("delay_veh_h", "total delay so far", "veh·h", "its sum over the departed", LESS),
)

CORRIDORS = (
    _sum("vehicles_veh", "vehicles", "veh", "that entered in the bin and drove all of it"),
    Quantity(
        "experienced_travel_time_s", "travel time", "s", "mean of those vehicles, end to end", LESS
    ),
    Quantity(
        "instantaneous_travel_time_s",
        "travel time at the speeds of the bin",
        "s",
        "sum of length / speed of its links; none where nobody was on one of them",
        LESS,
    ),
)

#: names of the tables that have rows of several quantities, with what their rows are known by
KEYS = {
    "links": ("link_id",),
    "link_times": ("link_id", "begin_s", "end_s"),
    "od": ("origin", "destination"),
    "zone_pairs": ("origin_zone", "destination_zone"),
    "zones": ("end", "zone"),
    "corridors": ("corridor", "begin_s", "end_s"),
}

QUANTITIES = {
    "links": LINKS,
    "link_times": LINK_TIMES,
    "od": TRIPS,
    "zone_pairs": TRIPS,
    "zones": TRIPS,
    "corridors": CORRIDORS,
}

#: tables in which a row that a run lacks is one of nobody: 0 vehicles, and no mean
ABSENT_IS_NOBODY = ("od", "zone_pairs", "zones")

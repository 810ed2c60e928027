"""What the tags of each way say of its two directions, as columns over the ways."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from uxsim_geo.network.osm_access import access_of
from uxsim_geo.network.osm_defaults import Defaults
from uxsim_geo.network.osm_lanes import lanes_of, turn_lanes
from uxsim_geo.network.osm_oneway import ROUND, directions
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.osm_reserved import lanes_of_cars
from uxsim_geo.network.osm_speeds import free_speeds
from uxsim_geo.network.osm_tags import Remark, Tags

DIRECTIONS = ("forward", "backward")

#: tags kept as they are, null where they are absent
KEPT_TEXTS = ("name", "ref", "junction", "bridge", "tunnel")

#: columns of :class:`Ways` that differ between the directions, in the links' order
DIRECTED = (
    "lanes",
    "lanes_source",
    "free_speed",
    "free_speed_source",
    "free_speed_basis",
    "turn_lanes",
    "access",
)


@dataclass
class Ways:
    """Columns over the ways.

    open
        whether each direction may be driven; shape (ways, 2): forward, backward
    directed
        by name of :data:`DIRECTED`: values of all ways, forward and backward of each in turn;
        (2 · ways,)
    texts
        road_class and :data:`KEPT_TEXTS`; (ways,)
    layer, merge_priority
        (ways,)
    remarks
        (row of the way, remark), in the order of the ways
    """

    open: npt.NDArray[np.bool_]
    directed: dict[str, list[object]] = field(
        default_factory=lambda: {name: [] for name in DIRECTED}
    )
    texts: dict[str, list[str | None]] = field(
        default_factory=lambda: {name: [] for name in ("road_class", *KEPT_TEXTS)}
    )
    layer: list[int] = field(default_factory=list)
    merge_priority: list[float] = field(default_factory=list)
    remarks: list[tuple[int, Remark]] = field(default_factory=list)


def read_ways(
    way_tags: list[Tags],
    options: OsmOptions,
    defaults: Defaults,
    progress: Callable[[float], None],
) -> Ways:
    """Read the tags of every way; ``progress`` is called with the share of them that is done."""
    ways = Ways(np.zeros((len(way_tags), 2), dtype=bool))
    for row, tags in enumerate(way_tags):
        remarks: list[Remark] = []
        _add_directions(ways, row, tags, options, (defaults, remarks))
        ways.texts["road_class"].append(tags["highway"])
        for name in KEPT_TEXTS:
            text = tags.get(name)
            ways.texts[name].append(None if text in ("no", "") else text)
        ways.layer.append(_layer(tags, remarks))
        ways.merge_priority.append(defaults.merge_priority(options.country, tags["highway"]))
        ways.remarks.extend((row, remark) for remark in remarks)
        if row % 10_000 == 0:
            progress(row / len(way_tags))
    return ways


def _add_directions(
    ways: Ways,
    row: int,
    tags: Tags,
    options: OsmOptions,
    tables: tuple[Defaults, list[Remark]],
) -> None:
    defaults, remarks = tables
    open_to = directions(tags, options.private, remarks)
    ways.open[row] = open_to.forward, open_to.backward
    oneway = open_to.oneway and tags.get("junction") not in ROUND
    assumed = defaults.lanes(options.country, tags["highway"], oneway=oneway)
    lanes = lanes_of(tags, open_to, assumed, remarks)
    lanes = lanes_of_cars(tags, open_to, lanes, options, remarks)
    speeds = free_speeds(tags, options.country, defaults, remarks)
    for direction, lane, speed in zip(DIRECTIONS, lanes, speeds, strict=True):
        values = (
            lane.count,
            lane.source,
            speed.value,
            speed.source,
            speed.basis,
            turn_lanes(tags, direction, open_to.oneway),
            access_of(tags, direction),
        )
        for name, value in zip(DIRECTED, values, strict=True):
            ways.directed[name].append(value)


def _layer(tags: Tags, remarks: list[Remark]) -> int:
    """The layer, from -5 up to 5; 0 where nothing sensible is said."""
    text = tags.get("layer")
    if text is None:
        return 0
    try:
        layer = int(text)
    except ValueError:
        layer = 99
    if abs(layer) > 5:
        note = "a layer (value) that is no whole number from -5 to 5 is taken as 0"
        remarks.append(Remark("unreadable layer", note, text))
        return 0
    return layer

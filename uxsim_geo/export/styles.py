"""Styles for every layer of the GeoPackage, so that it opens as a map; several where it helps.

Lines stand beside their road, on the side that is driven on, so that both directions show; their
width is the traffic and their colour the speed relative to free speed, or the delay, the queue, the
use of capacity. In time the width is how much of the road is taken, by vehicles that drive or by
vehicles that stand: flow alone would hide a standing queue.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple
from xml.etree.ElementTree import Element

import pandas as pd

from uxsim_geo.export import qml
from uxsim_geo.export.colours import NEUTRAL, NO_TRAFFIC, SPEED_CLASSES
from uxsim_geo.export.columns import LAYERS, Layer, titled
from uxsim_geo.export.od_layer import least_of_largest
from uxsim_geo.export.qml import ColourClass, Lines
from uxsim_geo.export.run_description import RunDescription

WIDEST, NARROWEST = 2.6, 0.25  # mm

#: stands for values where nobody was, below all of them
NOBODY = -1.0

NO_VALUE = ColourClass(NOBODY - 0.5, NOBODY + 0.5, NEUTRAL, NO_TRAFFIC)

#: the greater of flow / capacity and density / jam density, an expression over link_states
SHARE_OF_ROAD = (
    'max(coalesce("flow_vph" / "effective_capacity_vph", 0), '
    'coalesce("density_vpkm" / ("jam_density_vpkm_per_lane" * "lanes"), 0))'
)

#: what is added to travel at the speeds of the bin, s; where all stand, it is long and not endless
DELAY_NOW = '"instantaneous_travel_time_s" - 3.6 * "length_m" / "free_speed_kmh"'

#: from none to the worst, as different in lightness as the classes of speed
STEPS = tuple(speed.colour for speed in reversed(SPEED_CLASSES))

#: severities of notes with their colour and size in mm
NOTES = (
    ("doubt", "doubt", "#e0592a", 3.2),
    ("warning", "warning", "#f2b84b", 2.6),
    ("info", "info", "#84bcd8", 1.6),
)

#: desire lines that the eye can tell apart
MOST_PAIRS = 200

#: lines are named where the map is so large, 1 : this
NAMES_FROM = 12_000
NODES_FROM = 25_000
FEW_NODES = 60  # shown and named at every scale


class NamedStyle(NamedTuple):
    """A style under its name; the first of a layer is the one it opens with."""

    name: str
    description: str
    root: Element


def stepped(bounds: Sequence[float], unit: str, first: str = "") -> tuple[ColourClass, ...]:
    """Classes between bounds, the first from 0 (its label, if it has one), the last without end."""
    edges = [0.0, *bounds, 1e12]
    labels = [f"{low:g}–{high:g} {unit}" for low, high in pairwise(bounds)]
    labels = [first or f"under {bounds[0]:g} {unit}", *labels, f"over {bounds[-1]:g} {unit}"]
    return tuple(
        ColourClass(low, high, colour, label)
        for (low, high), colour, label in zip(pairwise(edges), STEPS, labels, strict=True)
    )


#: rounding may lift the speed a hair above free speed
SPEED = (
    *(ColourClass(*speed) for speed in SPEED_CLASSES[:-1]),
    ColourClass(*SPEED_CLASSES[-1]._replace(upper=1.000001)),
    NO_VALUE,
)
DELAY = (*stepped((5, 15, 30, 60), "s a vehicle"), NO_VALUE)
QUEUE = (*stepped((1, 25, 50, 75), "% of the link", "no queue"),)
CAPACITY = (*stepped((50, 70, 85, 95), "% of capacity"),)
LOST = (*stepped((10, 25, 50, 75), "% of the time lost"), NO_VALUE)
LATE = (*stepped((1, 3, 5, 10), "min late"), NO_VALUE)


def share_of_largest(column: str, values: pd.Series) -> str:
    """The expression of a column's share in its largest value, 0 to 1."""
    largest = max([1.0, *values.dropna()])
    return f'coalesce("{column}", 0) / {largest:.6g}'


def width_of(share: str, widest: float = WIDEST) -> str:
    """The expression of a width, mm, for one of a share, 0 to 1."""
    return f"scale_linear({share}, 0, 1, {NARROWEST}, {widest:g})"


def styles_of(
    layers: Mapping[str, pd.DataFrame], description: RunDescription
) -> dict[str, list[NamedStyle]]:
    """All styles of all layers that are there, by layer; the first is the default."""
    side = description.driving_side
    found = {name: [plain_style(name, LAYERS[name])] for name in layers}
    found["nodes"] = [_nodes(few=len(layers["nodes"]) <= FEW_NODES)]
    width = width_of(share_of_largest("volume_veh", layers["links"]["volume_veh"]))
    found["links"] = list(_of_links(width, side))
    if "link_times" in layers:
        found["link_states"] = list(_of_states(width_of(SHARE_OF_ROAD), side))
    if "geometry" in layers.get("import_notes", ()):
        found["import_notes"] = [_notes()]
    if "od_lines" in layers:
        found["od_lines"] = list(_desire_lines(layers["od_lines"], side))
    if "trajectories" in layers:
        found["trajectories"] = [_trajectories()]
    return {name: found[name] for name in LAYERS if name in found}


def _of_links(width: str, side: qml.Side) -> Iterator[NamedStyle]:
    """Speed, delay, queue and volume over the whole run; the width is the volume."""
    late = 'coalesce("delay_veh_s" / nullif("volume_veh", 0), -1)'
    queue = 'min(100 * "queue_m" / "length_m", 100)'
    used = '100 * "volume_to_capacity"'
    for name, what, lines in (
        ("speed", "mean speed of the run / free speed", _by_speed(width, side)),
        ("delay", "mean time lost by a vehicle", Lines(late, DELAY, width, late, side)),
        ("queue", "longest queue at the end of a bin", Lines(queue, QUEUE, width, queue, side)),
        ("volume", "mean flow / capacity", Lines(used, CAPACITY, width, '"volume_veh"', side)),
    ):
        yield NamedStyle(name, f"colour: {what}; width: volume", _road_style("links", lines))
    ground = Lines("0", (ColourClass(-0.5, 0.5, NEUTRAL, "road"),), "0.2", "0", "none")
    yield NamedStyle("roads", "all alike, below other layers", _road_style("links", ground))


def _of_states(width: str, side: qml.Side) -> Iterator[NamedStyle]:
    """The same in every time bin; the width is how much of the road is taken."""
    late = f'if("speed_ratio" is null, -1, max({DELAY_NOW}, 0))'
    queue = 'min(100 * "queue_m" / "length_m", 100)'
    used = '100 * "volume_to_capacity"'
    for name, what, lines in (
        ("speed", "speed in the bin / free speed", _by_speed(width, side)),
        ("delay", "time lost at the speed of the bin", Lines(late, DELAY, width, late, side)),
        ("queue", "queue at the end of the bin", Lines(queue, QUEUE, width, queue, side)),
        ("flow", "flow in the bin / capacity", Lines(used, CAPACITY, width, used, side)),
    ):
        root = _road_style("link_states", lines)
        qml.show_from_begin_to_end(root)
        yield NamedStyle(name, f"colour: {what}; width: share of the road that is taken", root)


def _by_speed(width: str, side: qml.Side) -> Lines:
    """Classes of speed; where nobody was, and so no speed is, grey with a label of their own."""
    slow_last = 'if("speed_ratio" is null, -2, -"speed_ratio")'
    return Lines(f'coalesce("speed_ratio", {NOBODY:g})', SPEED, width, slow_last, side)


def _road_style(layer: str, lines: Lines) -> Element:
    root = with_titles(LAYERS[layer])
    qml.add_lines(root, lines)
    qml.add_labels(root, "name", NAMES_FROM)
    qml.add_tip(root, TIPS[layer])
    return root


def _desire_lines(layer: pd.DataFrame, side: qml.Side) -> Iterator[NamedStyle]:
    """The largest pairs, and all if those are more than the eye can tell apart."""
    width = width_of(share_of_largest("departed_veh", layer["departed_veh"]), 4.0)
    late, what = 'coalesce("delay_s" / 60, -1)', "colour: mean delay of a pair; width: vehicles"
    lines = Lines(late, LATE, width, '"departed_veh"', side, 0.75)
    least = least_of_largest(layer, MOST_PAIRS)
    if not least:
        yield NamedStyle("delay", what, _pairs_style(lines))
        return
    left_out = NO_VALUE._replace(label=f"not drawn: pairs under {least:,.6g} vehicles")
    largest = lines._replace(
        value=f'if("departed_veh" < {least:.6g}, null, {late})', classes=(*LATE[:-1], left_out)
    )
    yield NamedStyle("delay", f"the largest pairs; {what}", _pairs_style(largest))
    yield NamedStyle("all pairs", what, _pairs_style(lines))


def _pairs_style(lines: Lines) -> Element:
    root = with_titles(LAYERS["od_lines"])
    qml.add_lines(root, lines)
    return root


def _trajectories() -> NamedStyle:
    root = with_titles(LAYERS["trajectories"])
    lost = 'coalesce(100 * "delay_s" / nullif("travel_time_s", 0), -1)'
    qml.add_lines(root, Lines(lost, LOST, "0.35", lost, "none", 0.6))
    qml.show_from_begin_to_end(root)
    return NamedStyle("time lost", "colour: share of its time that a trip lost", root)


def _nodes(*, few: bool) -> NamedStyle:
    """Small dots, signals stand out; at large scales only, unless they are few and have names."""
    root = with_titles(LAYERS["nodes"])
    kinds = [("signal", "signal", "#f2b84b", 2.0), ("", "node", "#ffffff", 1.2)]
    qml.add_dots(root, "control", kinds)
    if few:
        qml.add_labels(root, "node_id", along=False)
    else:
        qml.hide_beyond(root, NODES_FROM)
    return NamedStyle("control", "signals and other nodes", root)


def _notes() -> NamedStyle:
    """Dots by severity: doubts large, warnings smaller, everything else small."""
    root = with_titles(LAYERS["import_notes"])
    qml.add_dots(root, "severity", NOTES)
    qml.add_tip(root, f"[% {as_text('note')} %]")
    return NamedStyle("severity", "doubts, warnings and everything else", root)


def plain_style(name: str, layer: Layer) -> NamedStyle:
    """Nothing to draw: names of columns with their units."""
    return NamedStyle(name, layer.title, with_titles(layer))


def with_titles(layer: Layer) -> Element:
    """A style in which columns are called by their titles."""
    root = qml.document()
    qml.add_aliases(root, {column.name: titled(column) for column in layer.columns})
    return root


def as_text(column: str) -> str:
    """An expression of a column's text that HTML shows as it is."""
    marks = "'&', '&amp;', '<', '&lt;', '>', '&gt;', '\"', '&quot;'"
    first, *others = (pair for pair in zip(*[iter(marks.split(", "))] * 2, strict=True))
    text = f'replace("{column}", {first[0]}, {first[1]})'
    for mark, code in others:
        text = f"replace({text}, {mark}, {code})"
    return text


def tip_of(rows: Mapping[str, str]) -> str:
    """HTML of a tip: the road's name, then what is known of it, a row each."""
    head = f"coalesce({as_text('name')}, {as_text('link_id')})"
    table = "".join(
        f"<tr><td>{what}</td><td align='right'>[% {value} %]</td></tr>"
        for what, value in rows.items()
    )
    return f"<b>[% {head} %]</b><table>{table}</table>"


_SPEEDS = "coalesce(round(\"speed_kmh\"), '–') || ' of ' || round(\"free_speed_kmh\") || ' km/h'"

TIPS = {
    "links": tip_of(
        {
            "volume": "round(\"volume_veh\") || ' veh'",
            "speed": _SPEEDS,
            "time lost": "round(\"delay_veh_s\" / 3600, 1) || ' veh·h'",
            "longest queue": "round(\"queue_m\") || ' m'",
        }
    ),
    "link_states": tip_of(
        {
            "flow": "round(\"flow_vph\") || ' veh/h'",
            "speed": _SPEEDS,
            "time lost": "round(\"delay_veh_s\" / 3600, 2) || ' veh·h'",
            "queue": "round(\"queue_m\") || ' m'",
        }
    ),
}

"""What a scenario changes in space and time: links as walls, coloured by the change in each bin.

The scene is drawn by :mod:`uxsim_geo.export.space_time.drawing`, as that of a run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison
from uxsim_geo.analysis.comparison.quantities import LINK_TIMES, Quantity
from uxsim_geo.analysis.types import Booleans, Floats, Integers
from uxsim_geo.export.comparison.changes import (
    ADDED,
    BETTER,
    ONLY_BASE,
    ONLY_SCENARIO,
    REMOVED,
    WORSE,
)
from uxsim_geo.export.comparison.study import Scenario, Study, comparison_of, joined_network
from uxsim_geo.export.comparison.words import number
from uxsim_geo.export.map_plane import MapPlane, round_below
from uxsim_geo.export.space_time.choice import FEW_LINKS, number_with_room, part_of_map
from uxsim_geo.export.space_time.frame import Frame, axes, time_marks
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.space_time.places import PLACES, cut, tops
from uxsim_geo.export.space_time.roads import empty_parts, lines_mesh, road_meshes
from uxsim_geo.export.space_time.scene import boxes, feet, title_of
from uxsim_geo.export.space_time.walls import RIBBON, Pieces, Walls, runs
from uxsim_geo.export.street_names import street_names
from uxsim_geo.network.network import Network

Changing = Literal["delay_veh_h", "speed_kmh"]

#: even classes on either side of 0; the last holds all beyond
STEPS = 3

#: of all changes so many lie within the classes but the last
WITHIN = 0.9

#: of a step: smaller changes have no wall
LEAST = 0.2

#: links with walls, at most
MOST_LINKS = 200


@dataclass(frozen=True)
class _Changes:
    """Of the links that walls may stand on.

    rows (of the joined network), values (change, shape (links, bins); NaN where there is no wall),
    begin and end (of the bins, s), step (of the classes), is_known (how sure changes are)
    """

    quantity: Quantity
    rows: Integers
    values: Floats
    begin: Floats
    end: Floats
    step: float
    is_known: bool

    @classmethod
    def of(cls, comparison: Comparison, network: Network, name: str) -> _Changes:
        table = comparison.link_times
        quantity = next(one for one in LINK_TIMES if one.name == name)
        ids = comparison.links["link_id"]
        shape = (len(ids), -1)
        change, low, high = (
            table[f"{name}_{end}"].to_numpy(float).reshape(shape)
            for end in ("difference", "low", "high")
        )
        perhaps = (low <= 0) & (high >= 0)
        sizes = np.abs(change[np.isfinite(change) & ~perhaps])
        sizes = sizes[sizes > 1e-9]
        most = float(np.quantile(sizes, WITHIN)) if len(sizes) else 1.0
        step = round_below(max(most / (STEPS - 1), 1e-6))
        drawn = np.isfinite(change) & ~perhaps & (np.abs(change) >= LEAST * step)
        begin, end = (np.unique(table[side]) for side in ("begin_s", "end_s"))
        rows = pd.Index(network.links["link_id"].astype(str)).get_indexer(pd.Index(ids))
        values = np.where(drawn, change, np.nan)
        return cls(quantity, rows, values, begin, end, step, bool(np.isfinite(low).any()))

    @property
    def sizes(self) -> Floats:
        """Of each link, over all its walls."""
        total: Floats = np.nan_to_num(np.abs(self.values)).sum(axis=1)
        return total

    def classes(self, links: Integers) -> Integers:
        """Of the walls of some links, −1 where there is none."""
        values = self.values[links]
        found = np.clip(np.floor(np.nan_to_num(values) / self.step), -STEPS, STEPS - 1) + STEPS
        return np.where(np.isnan(values), -1, found).astype(np.int64)


def difference_scene(
    study: Study, entry: Scenario, look: Look, changing: Changing = "delay_veh_h"
) -> dict[str, Any]:
    """The scene of what a scenario changes; arrays as those of :mod:`..space_time.scene`.

    Walls stand where and when the change is for sure (its 95 % interval leaves out 0), or, with one
    pair of runs, where there is any; on the links that change most. Raises ValueError if the base
    has no geometry.
    """
    network = joined_network(study.base, [entry.network])
    plane = MapPlane.of(network)
    changes = _Changes.of(comparison_of(entry), network, changing)
    chosen, box = _chosen(changes, plane)
    clock = look.clock([*changes.begin, changes.end[-1]])
    rows = changes.rows[chosen]
    crowded = len(network.links) > FEW_LINKS
    frame = Frame.of(plane, box, float(changes.end[-1]), crowded=crowded)
    pieces = Pieces.of(frame, rows, look.driving_side)
    link, first, last, colour = runs(changes.classes(chosen))
    half = np.full(len(link), RIBBON)
    walls = Walls(link, changes.begin[first], changes.end[last], np.zeros(len(link)), colour, half)
    labels = [changes.step * step for step in range(-STEPS, STEPS + 1)]
    return {
        "title": f"{entry.name}: change of {changes.quantity.title} in space and time",
        **_marks(network, changes, chosen, frame),
        "subtitle": _subtitle(entry, changes, len(chosen)),
        "attribution": look.attribution,
        "scale_title": f"change of {changes.quantity.title}, {changes.quantity.unit}",
        "scale_labels": np.array([f"{label:g}" for label in labels]),
        "scale_rgb": _rgb(_colours(changes.quantity)),
        **boxes("ribbons", frame, pieces, walls, _rgb(_colours(changes.quantity))),
        **_no_boxes("queues"),
        **empty_parts("trajectories"),
        "feet": feet(frame, pieces, walls),
        **road_meshes(network, frame),
        **_marked_roads(comparison_of(entry), network, frame, look),
        **axes(frame, time_marks(frame, clock), title_of(clock)),
        "ground": frame.ground,
        "corners": frame.corners(),
        "height": frame.height,
        "duration": frame.duration,
        "plane": np.nan,
        "plane_text": "",
    }


def _chosen(
    changes: _Changes, plane: MapPlane
) -> tuple[Integers, tuple[float, float, float, float]]:
    """Links that change most, the largest first, as many as there is room for, and the map."""
    sizes = changes.sizes
    order = np.argsort(-sizes, kind="stable")
    chosen = order[sizes[order] > 0][:MOST_LINKS]
    box = plane.extent
    if len(plane.lines) > FEW_LINKS and chosen.size:
        box, inside = part_of_map(plane, changes.rows[chosen], sizes[chosen])
        chosen = chosen[inside]
        there: Booleans = np.isfinite(changes.values[chosen])
        chosen = chosen[: number_with_room(plane, box, changes.rows[chosen], there)]
    return chosen, box


def _colours(quantity: Quantity) -> list[str]:
    """From the largest decrease to the largest increase; better is blue."""
    up, down = (BETTER, WORSE) if quantity.better > 0 else (WORSE, BETTER)
    return [*reversed(down), *up]


def _rgb(colours: list[str]) -> Floats:
    return np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in colours], float)


def _no_boxes(name: str) -> dict[str, Any]:
    """A mesh of walls that are none."""
    faces = np.empty((0, 4), np.int64)
    return {
        f"{name}.points": np.empty((0, 3)),
        f"{name}.faces": faces,
        f"{name}.rgb": np.empty((0, 3)),
    }


def _marks(network: Network, changes: _Changes, chosen: Integers, frame: Frame) -> dict[str, Any]:
    """Numbers on poles at the links that change most, and what they are."""
    names = street_names(network.links)
    most = chosen[:PLACES]
    rows = changes.rows[most].tolist()
    lines = []
    for at, (link, row) in enumerate(zip(most, rows, strict=True), start=1):
        sure = changes.values[link]
        total = np.nansum(sure) if changes.quantity.adds_up else np.nanmean(sure)
        what = "in all" if changes.quantity.adds_up else "on average"
        unit = changes.quantity.unit
        lines.append(
            f"{at}  {cut(str(names.iloc[row]))}: {number(total, signed=True)} {unit} {what}"
        )
    return {
        "notes": np.array((["Largest changes"] if lines else []) + lines, dtype=str),
        "marks.points": tops(_middles(rows, frame), frame),
        "marks.texts": np.array([str(at + 1) for at in range(len(rows))], dtype=str),
    }


def _middles(rows: list[int], frame: Frame) -> list[Floats]:
    import shapely

    lines = frame.plane.lines[rows]
    middles = shapely.line_interpolate_point(lines, 0.5, normalized=True)
    return list(frame.on_ground(shapely.get_coordinates(middles)))


def _marked_roads(
    comparison: Comparison, network: Network, frame: Frame, look: Look
) -> dict[str, Any]:
    """On the ground the links that one network alone has: removed black, added gold."""
    links = comparison.links
    ids = pd.Index(network.links["link_id"].astype(str))
    parts = []
    for side, colour in (("base", REMOVED), ("scenario", ADDED)):
        rows = ids.get_indexer(pd.Index(links["link_id"][links["exists"] == side]))
        pieces = Pieces.of(frame, rows, look.driving_side)
        ends = np.stack([pieces.begin, pieces.end], axis=1).reshape(-1, 2)
        parts.append((ends, np.tile(_rgb([colour]), (len(pieces.begin), 1))))
    ends = np.concatenate([part[0] for part in parts])
    points = np.column_stack([ends, np.full(len(ends), 1e-4)])
    rgb = np.concatenate([part[1] for part in parts])
    return lines_mesh("slow", points, np.arange(len(ends)).reshape(-1, 2), rgb)


def _subtitle(entry: Scenario, changes: _Changes, drawn: int) -> str:
    found = comparison_of(entry)
    exists = found.links["exists"]
    count = int((changes.sizes > 0).sum())
    which = "all" if drawn == count else f"the {drawn:,} that change most"
    sure = (
        "where the 95 % interval leaves out 0"
        if changes.is_known
        else "of one pair of runs, how sure is not known"
    )
    ground = []
    if (exists == "base").any():
        ground.append(f"black: {ONLY_BASE}")
    if (exists == "scenario").any():
        ground.append(f"gold: {ONLY_SCENARIO}")
    minutes = (changes.end[0] - changes.begin[0]) / 60
    base = "blue: better, red: worse"
    return (
        f"{len(exists):,} links, {count:,} of them change at some time; walls: {which}, "
        f"{sure}; {base}\nwall, by {minutes:g} min: a link while it changes by "
        f"{LEAST * changes.step:g} {changes.quantity.unit} or more"
        + "".join(f"; on the ground {part}" for part in ground)
    )

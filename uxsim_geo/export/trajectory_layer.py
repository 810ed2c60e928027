"""Trajectories as a layer: lines on the map with the time as their third and fourth coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.analysis.samples import check_step, numbered_from
from uxsim_geo.analysis.trajectories import LinkLines
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.layers import instants
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH
from uxsim_geo.result import Result

LINE_ZM = 3002  # type of a line with z and m in ISO WKB
NEAR = 0.35  # m, by which a way may be off when points are left out, each time
TIMES_THINNED = 4  # each leaves out half of the points at most
DEGREE = 111_320.0  # m, of latitude


@dataclass(frozen=True)
class Sample:
    """How many trips are shown, and every how many seconds their places are exact."""

    trips: int = 1000
    step_s: float = 10.0


class _Knots(NamedTuple):
    """Moments at which places are known; arrays of one length, by way, link entry and time.

    entry (number of the link entry), time (s), position (m from the start of its link).
    """

    entry: Integers
    time: Floats
    position: Floats


def trajectories_layer(
    result: Result, network: Network, run: RunPassages, sample: Sample, start: datetime
) -> pd.DataFrame:
    """Ways of some trips, spread evenly over all that drove; see ``columns.TRAJECTORIES``.

    ``start`` is what the clock shows at 0 s. Places are exact (see
    :mod:`uxsim_geo.analysis.passages`) at the ends of links and at multiples of the sample's step;
    between them the speed is even. Raises :class:`uxsim_geo.errors.InputError` for a step that is
    none, and ValueError if the network has no geometry.
    """
    import geopandas as gpd

    if "geometry" not in network.links.columns:
        raise ValueError("this network has no geometry: there are no ways to draw")
    end = result.settings.duration
    check_step("step_s", sample.step_s, end)
    vehicles = _chosen(run.drove(end), sample.trips)
    passages = run.around(np.isin(np.arange(len(result.trips)), vehicles))
    rows = _drives_of(passages, vehicles)
    lines = LinkLines.of(network.links["geometry"].to_numpy())
    crs = getattr(network.links, "crs", None)
    points, vehicle = _points(passages, rows, lines, sample.step_s)
    points, vehicle = _thinned(points, vehicle, _near(crs))
    counts = np.diff(np.searchsorted(vehicle, [*vehicles, np.inf]))
    layer = _attributes(result, network, vehicles, start)
    geometry = _lines(points, counts, pd.Timestamp(start).timestamp())
    spatial: pd.DataFrame = gpd.GeoDataFrame(layer, geometry=geometry, crs=crs)
    return spatial


def _chosen(drove: Integers, most: int) -> Integers:
    """Some of the vehicles that drove, spread evenly."""
    number = min(most, len(drove))
    return drove[((np.arange(number) + 0.5) * len(drove) / max(number, 1)).astype(np.int64)]


def _drives_of(passages: Passages, vehicles: Integers) -> Integers:
    """Rows of the passages of some vehicles, in the order of their drive."""
    seen = np.isin(passages.vehicle, vehicles) & (passages.enter < passages.end)
    rows = np.flatnonzero(seen)
    order = np.lexsort((passages.enter[rows], passages.vehicle[rows]))
    return rows[order].astype(np.int64)


def _points(
    passages: Passages, rows: Integers, lines: LinkLines, step: float
) -> tuple[Floats, Integers]:
    """Points of all ways (x, y, s), one way after the other, and whose they are.

    Links that no line is drawn of are left out.
    """
    knots = _knots(passages, rows, step)
    corners = _corners(passages, rows, lines, knots)
    entry, time, position = (
        np.concatenate([one, other]) for one, other in zip(knots, corners, strict=True)
    )
    order = np.lexsort((position, time, entry))
    entry, time, position = entry[order], time[order], position[order]
    link = passages.link[rows[entry]]
    x, y = lines.points(link, position / passages.geometry.length[link])
    points, vehicle = np.stack([x, y, time], axis=1), passages.vehicle[rows[entry]]
    new = np.ones(len(points), bool)
    new[1:] = (vehicle[1:] != vehicle[:-1]) | (np.abs(np.diff(points, axis=0)) > 1e-9).any(axis=1)
    new &= ~np.isnan(points).any(axis=1)
    return points[new], vehicle[new]


def _knots(passages: Passages, rows: Integers, step: float) -> _Knots:
    """Entry, multiples of ``step`` and exit (or the end of the run) of every link entry."""
    enter, end = passages.enter[rows], np.minimum(passages.exit[rows], passages.end)
    first = np.floor(enter / step).astype(np.int64) + 1
    counts = np.maximum(np.ceil(end / step).astype(np.int64) - first, 0)
    every = np.arange(len(rows))
    entry = np.concatenate([every, np.repeat(every, counts), every])
    time = np.concatenate([enter, numbered_from(first, counts) * step, end])
    order = np.lexsort((time, entry))
    entry, time = entry[order], time[order]
    return _Knots(entry, time, passages.positions(rows[entry], time))


def _corners(passages: Passages, rows: Integers, lines: LinkLines, knots: _Knots) -> _Knots:
    """Where the line of its link bends, and when each link entry comes there."""
    link = passages.link[rows]
    first, counts = lines.first[link] + 1, np.maximum(np.diff(lines.first)[link] - 2, 0)
    entry = np.repeat(np.arange(len(rows)), counts)
    position = lines.reach[numbered_from(first, counts)] * passages.geometry.length[link][entry]
    reached = np.zeros(len(rows))
    np.maximum.at(reached, knots.entry, knots.position)
    seen = position < reached[entry]
    entry, position = entry[seen], position[seen]
    if not entry.size:
        return _Knots(entry, position, position)
    # one scale for all: the entries one after the other, further apart than any link is long
    apart = 2.0 * float(passages.geometry.length.max(initial=1.0))
    scale = knots.entry * apart + knots.position
    time = np.interp(entry * apart + position, scale, knots.time)
    return _Knots(entry, time, position)


def _near(crs: Any) -> float:
    """:data:`NEAR` in units of the map; without a CRS they are taken for metres."""
    if crs is None:
        return NEAR
    if crs.is_geographic:
        return NEAR / DEGREE
    return NEAR / float(crs.axis_info[0].unit_conversion_factor)


def _thinned(points: Floats, vehicle: Integers, near: float) -> tuple[Floats, Integers]:
    """Leave out points beside which an even drive from the last to the next point comes ``near``.

    Of points that follow one another every other at most goes at a time, so that a slow bend of
    many points stays one.
    """
    for _ in range(TIMES_THINNED):
        before, here, after = points[:-2], points[1:-1], points[2:]
        inner = (vehicle[:-2] == vehicle[2:]) & (after[:, 2] > before[:, 2])
        share = ratio(here[:, 2] - before[:, 2], after[:, 2] - before[:, 2])[:, None]
        off = np.abs(before + share * (after - before) - here)[:, :2].max(axis=1, initial=0.0)
        gone = np.zeros(len(points), bool)
        gone[1:-1] = inner & (off < near)
        # the odd ones of each row of points that could go
        begins = gone & ~np.append(False, gone[:-1])
        since = np.arange(len(gone)) - np.maximum.accumulate(
            np.where(begins, np.arange(len(gone)), 0)
        )
        gone &= since % 2 == 0
        points, vehicle = points[~gone], vehicle[~gone]
    return points, vehicle


def _lines(points: Floats, counts: Integers, start: float) -> npt.NDArray[Any]:
    """Lines with z (s after the start) and m (Unix time, s) from their points."""
    import shapely

    coordinates = np.column_stack([points, start + points[:, 2]]).astype("<f8")
    texts: list[bytes | None] = []
    for count, end in zip(counts.tolist(), np.cumsum(counts).tolist(), strict=True):
        head = b"\x01" + np.array([LINE_ZM, count], "<u4").tobytes()
        texts.append(head + coordinates[end - count : end].tobytes() if count > 1 else None)
    lines: npt.NDArray[Any] = shapely.from_wkb(np.array(texts, dtype=object))
    return lines


def _attributes(
    result: Result, network: Network, vehicles: Integers, start: datetime
) -> pd.DataFrame:
    if not len(vehicles):
        trips = trip_summary(result, network).iloc[:0]
    else:
        trips = trip_summary(result, network, vehicles=vehicles)
    end = trips["end_s"].fillna(result.settings.duration)
    driven = (end - trips["enter_s"]).to_numpy(float)
    distance = trips["distance_m"].to_numpy(float)
    classes = trips["class"].astype("string")
    return pd.DataFrame(
        {
            "vehicle": trips["vehicle"].to_numpy(np.int64),
            "origin": trips["origin"].astype(str),
            "destination": trips["destination"].astype(str),
            "class": classes,
            "vehicles_veh": trips["vehicles"].to_numpy(np.int64),
            "status": trips["status"].astype(str),
            "begin": instants(trips["enter_s"], start),
            "end": instants(end, start),
            "distance_m": distance,
            "travel_time_s": trips["travel_time_so_far_s"],
            "delay_s": np.maximum(trips["delay_so_far_s"], 0.0),
            "speed_kmh": ratio(distance, driven) * KMH,
        }
    )

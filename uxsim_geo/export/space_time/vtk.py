"""A run in space and time as a VTK file for ParaView: x and y in metres, z in seconds.

Both formats, ``.vtp`` and ``.vtkhdf``, hold one mesh: the roads on the ground, ways of vehicles if
they are given, and ribbons: every link in every time bin in which somebody was on it, as upright
quads with the figures of the bin. The array ``part`` tells them apart. Coordinates are counted from
the middle of the map, since millions of metres are too large for the numbers that a graphics card
draws with; ``origin`` among the field data is that point in the projected CRS.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.samples import numbered_from
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.saving import checked_ending
from uxsim_geo.export.units import in_peoples_units
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network

ENDINGS = (".vtp", ".vtkhdf")
MOST_QUADS = 5_000_000  # of ribbons: some hundred MB

#: values of ``part``
ROAD, WAY, RIBBON = range(3)

#: columns of states that become arrays, beside the speed relative to free speed
FIGURES = ("begin_s", "end_s", "flow", "density", "speed", "delay", "queue", "queue_length")


def write_vtk(
    path: Path,
    network: Network,
    states: pd.DataFrame,
    ways: list[Floats] | None = None,
    attribution: str = "",
) -> None:
    """Write ``.vtp`` or ``.vtkhdf``, by the ending of ``path``.

    ``states`` as :func:`uxsim_geo.analysis.link_states.link_times` gives them, ``ways`` as
    :func:`uxsim_geo.export.space_time.ways.sampled_ways` does; ``attribution`` goes among the field
    data. Raises :class:`uxsim_geo.errors.InputError` for another ending or too many ribbons, and
    ValueError if the network has no geometry.
    """
    ending = checked_ending(path, ENDINGS, "a scene for ParaView")
    StateGrid.of_all(states, network)
    ground = _Ground.of(MapPlane.of(network))
    mesh = _mesh(network, states, ground, ways or [])
    if attribution:
        _add_texts(mesh, "attribution", [attribution])
    with replace_when_complete(path) as temporary:
        if ending == ".vtp":
            mesh.save(temporary)
        else:
            _write_hdf(temporary, mesh)


@dataclass(frozen=True)
class _Ground:
    """Points of lines in m from ``origin``, and the rows of points where each line begins."""

    points: Floats
    first: Integers
    origin: Floats
    plane: MapPlane

    @classmethod
    def of(cls, plane: MapPlane) -> _Ground:
        import shapely

        points, line = shapely.get_coordinates(plane.lines, return_index=True)
        x0, y0, x1, y1 = plane.extent
        origin = np.round([(x0 + x1) / 2, (y0 + y1) / 2])
        first = np.searchsorted(line, np.arange(len(plane.lines) + 1)).astype(np.int64)
        return cls((points - origin) * (plane.metres_per_unit or 1.0), first, origin, plane)


def _write_hdf(path: Path, mesh: Any) -> None:
    """Write with compression, which pyvista leaves off: a tenth of the size."""
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    writer = vtkHDFWriter()
    writer.SetInputData(mesh)
    writer.SetFileName(str(path))
    writer.SetCompressionLevel(1)
    if not writer.Write():
        raise OSError(f"{path.name} could not be written")


def _mesh(network: Network, states: pd.DataFrame, ground: _Ground, ways: list[Floats]) -> Any:
    """Roads, ways and ribbons as one mesh: VTK counts lines before faces."""
    import pyvista as pv

    roads = np.column_stack([ground.points, np.zeros(len(ground.points))])
    driven = np.concatenate([np.empty((0, 3)), *ways])
    driven[:, :2] = (driven[:, :2] - ground.origin) * (ground.plane.metres_per_unit or 1.0)
    corners, row = _ribbons(network, states, ground)
    counts = np.concatenate([np.diff(ground.first), [len(way) for way in ways]]).astype(np.int64)
    lines = _cells(counts, 0)
    faces = _cells(np.full(len(row), 4), len(roads) + len(driven))
    mesh = pv.PolyData(np.concatenate([roads, driven, corners]), lines=lines, faces=faces)
    parts = [len(network.links), len(ways), len(row)]
    mesh.cell_data["part"] = np.repeat(np.array([ROAD, WAY, RIBBON], np.uint8), parts)
    bins = len(states) // len(network.links)
    number = [np.arange(len(network.links)), np.full(len(ways), -1), row // bins]
    mesh.cell_data["link"] = np.concatenate(number).astype(np.int32)
    for name, values in _figures(network, states).items():
        mesh.cell_data[name] = np.concatenate([np.full(len(counts), np.nan), values[row]])
    _add_texts(mesh, "link_id", network.links["link_id"].astype(str))
    mesh.field_data["origin"] = ground.origin
    return mesh


def _add_texts(mesh: Any, name: str, texts: Iterable[str]) -> None:
    """Add texts to the field data; VTK's own arrays take all letters, pyvista's ASCII alone."""
    from vtkmodules.vtkCommonCore import vtkStringArray

    array = vtkStringArray()
    array.SetName(name)
    for text in texts:
        array.InsertNextValue(text)
    mesh.GetFieldData().AddArray(array)


def _cells(counts: Integers, first: int) -> Integers:
    """Cells in VTK's way, none sharing a point: the number of points of each, then their rows."""
    begin = np.cumsum(counts + 1) - counts - 1
    cells = np.empty(int(counts.sum()) + len(counts), np.int64)
    is_point = np.ones(len(cells), bool)
    is_point[begin] = False
    cells[begin] = counts
    cells[is_point] = first + np.arange(int(counts.sum()))
    return cells


def _ribbons(network: Network, states: pd.DataFrame, ground: _Ground) -> tuple[Floats, Integers]:
    """Corners of quads over the straight pieces of links, four each, and the state of each quad.

    Of all bins with somebody there.
    """
    bins = len(states) // len(network.links)
    there = np.flatnonzero(states["time"].to_numpy(float) > 0)
    link = there // bins
    counts = np.diff(ground.first)[link] - 1
    if counts.sum() > MOST_QUADS:
        what = (
            f"makes {counts.sum():,} ribbons for ParaView, of at most {MOST_QUADS:,}: "
            "take longer time bins"
        )
        raise InputError([Fault(what, column="bin_s")])
    row = np.repeat(there, counts)
    piece = numbered_from(ground.first[link], counts)
    corners = np.empty((len(row), 4, 3))
    corners[:, [0, 3], :2] = ground.points[piece, None]
    corners[:, [1, 2], :2] = ground.points[piece + 1, None]
    corners[:, [0, 1], 2] = states["begin_s"].to_numpy(float)[row, None]
    corners[:, [2, 3], 2] = states["end_s"].to_numpy(float)[row, None]
    return corners.reshape(-1, 3), row


def _figures(network: Network, states: pd.DataFrame) -> dict[str, Floats]:
    """Arrays of all states by names that tell their unit."""
    bins = len(states) // len(network.links)
    free = np.repeat(network.links["free_speed"].to_numpy(float), bins)
    table = in_peoples_units(states[list(FIGURES)]).rename(columns={"queue_length": "queue_m"})
    figures = {str(name): table[name].to_numpy(float) for name in table.columns}
    return figures | {"speed_percent": 100 * states["speed"].to_numpy(float) / free}

"""The lines of a table as the geometry of links: onto their nodes, turned, measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.network.length_check import length_doubt
from uxsim_geo.network.mapped_nodes import ends_of
from uxsim_geo.network.mapped_options import ColumnMapping
from uxsim_geo.network.mapped_values import Rows
from uxsim_geo.network.measure import Floats, line_lengths
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.wkt import Lines

if TYPE_CHECKING:
    from pyproj import CRS

Ints = npt.NDArray[np.int64]


def onto_nodes(lines: Lines, nodes: pd.DataFrame, at: Ints) -> Lines:
    """Lines that begin and end at their nodes: those that do not yet are moved there."""
    import shapely

    place = nodes[["x", "y"]].to_numpy(dtype=np.float64)[at]
    moved = lines.copy()
    for row in np.flatnonzero((place != ends_of(lines)).any(axis=(1, 2))).tolist():
        coordinates = shapely.get_coordinates(lines[row], include_z=lines[row].has_z)
        coordinates[[0, -1], :2] = place[row]
        moved[row] = shapely.linestrings(coordinates)
    return moved


def with_lengths(
    links: Rows, table: pd.DataFrame, mapping: ColumnMapping, crs: CRS | None, notes: Notes
) -> pd.DataFrame:
    """Lengths from the geometry where the table has none; those it has are held against it."""
    drawn = line_lengths(table["geometry"].to_numpy(), crs)
    lengths = table["length"].to_numpy(dtype=np.float64)
    missing = np.isnan(lengths)
    source = mapping.source("length")
    if source is not None and source.column is not None:
        import shapely

        places = shapely.get_coordinates(table["geometry"].to_numpy())
        doubt = length_doubt(lengths, drawn, source.unit or "m", places, crs)
        if doubt is not None and doubt.likely:
            what = f"{doubt.told}: the unit is rather {doubt.likely}"
            links.faults.add(what, column=source.column)
        elif doubt is not None:
            notes.add("lengths differ", doubt.told, severity="warning", value=doubt.ratio)
    if source is None:
        notes.add("length of geometry", "lengths are those of the lines", element="link")
    else:
        note = "no length in the table: that of the line (value, m)"
        notes.warn_each(
            "length assumed", note, table["link_id"][missing].tolist(), drawn[missing].tolist()
        )
    for row in np.flatnonzero(missing & ~(drawn > 0)).tolist():
        links.add("the line has no length, and the table none", row, "geometry")
    return table.assign(length=np.where(missing, drawn, lengths))


def add_loop_faults(
    links: Rows,
    link_id: pd.Series,
    mapping: ColumnMapping,
    place: tuple[Ints, Floats],
    notes: Notes,
) -> None:
    """Lines (their nodes, m) that lead back to their own node: too short, or real loops."""
    at, length = place
    loops = at[:, 0] == at[:, 1]
    short = loops & (length <= 2 * mapping.tolerance) & ("from_node_id" not in mapping.links)
    for row in np.flatnonzero(short).tolist():
        what = f"both ends are one node: the tolerance of {mapping.tolerance:g} m is too large"
        links.add(what, row, "geometry", f"{length[row]:.3g} m long")
    real = link_id[loops & ~short].tolist()
    note = "the link leads back to its own node"
    notes.warn_each("self-loop", note, real, [None] * len(real))


def turned(table: pd.DataFrame) -> pd.DataFrame:
    """Rows for the backward direction alone, from their last point to their first."""
    import shapely

    backward = (table["way"] < 0).to_numpy()
    if not backward.any():
        return table
    ends = ["from_node_id", "to_node_id"]
    other = table[ends[::-1]].set_axis(ends, axis=1)
    ready = table.assign(**{end: table[end].where(~backward, other[end]) for end in ends})
    shapes = table["geometry"].to_numpy(dtype=object, copy=True)
    shapes[backward] = shapely.reverse(shapes[backward])
    return ready.assign(geometry=shapes)

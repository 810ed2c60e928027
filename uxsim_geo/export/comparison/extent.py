"""The part of a large map that shows what changes."""

from __future__ import annotations

import numpy as np

from uxsim_geo.analysis.types import Booleans, Floats
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.space_time.choice import FEW_LINKS, part_of_map

#: a scenario that edits a larger share of the links is about the whole map
LOCAL = 0.05


def changed_part(
    plane: MapPlane, sizes: Floats, edited: Booleans
) -> tuple[float, float, float, float]:
    """Where nearly all changes are, and what was edited: least x and y, greatest x and y.

    ``sizes``: of the changes of the links, 0 where there is none. The whole map where the network
    is small, or nothing changes.
    """
    import shapely

    rows = np.flatnonzero(sizes > 0)
    if len(plane.lines) <= FEW_LINKS or not len(rows):
        return plane.extent
    box, _ = part_of_map(plane, rows.astype(np.int64), sizes[rows])
    if not edited.any():
        return box
    own = shapely.total_bounds(plane.lines[edited])
    low, high = np.minimum(box[:2], own[:2]), np.maximum(box[2:], own[2:])
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])

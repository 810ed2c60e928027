"""Left, right, straight on or back: what a turn is by the lines of its links."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

#: degrees: straight on up to here, to one side up to the second, back beyond
STRAIGHT, BACK = 45.0, 160.0


def turn_types(turns: pd.DataFrame, links: pd.DataFrame) -> list[str]:
    """GMNS's words thru, left, right and uturn, one a turn (from_link_id, to_link_id).

    The angle is that between the last stretch of the one line and the first of the other.
    """
    import shapely

    row = pd.Index(links["link_id"])
    lines = np.asarray(links["geometry"], dtype=object)
    crs = getattr(links, "crs", None)
    ends = []
    for side, stretch in (("from_link_id", (-2, -1)), ("to_link_id", (0, 1))):
        own = lines[row.get_indexer(turns[side])]
        points = [shapely.get_coordinates(shapely.get_point(own, place)) for place in stretch]
        ends.append(_heading(*points, degrees=crs is not None and crs.is_geographic))
    angle = (ends[1] - ends[0] + 180.0) % 360.0 - 180.0
    names = np.where(angle > 0, "left", "right").astype(object)
    names[np.abs(angle) <= STRAIGHT] = "thru"
    names[np.abs(angle) >= BACK] = "uturn"
    return [str(name) for name in names.tolist()]


def _heading(
    first: npt.NDArray[np.float64], second: npt.NDArray[np.float64], *, degrees: bool
) -> npt.NDArray[np.float64]:
    """Degrees counterclockwise from the x axis; degrees of longitude are shortened to scale."""
    step = second - first
    if degrees:
        step = step * np.column_stack([np.cos(np.radians(first[:, 1])), np.ones(len(step))])
    return np.asarray(np.degrees(np.arctan2(step[:, 1], step[:, 0])))

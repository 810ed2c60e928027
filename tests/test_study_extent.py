"""What part of a large map is shown of a study: where things change, and what was edited."""

from __future__ import annotations

import numpy as np
import shapely

from uxsim_geo.export.comparison.extent import changed_part
from uxsim_geo.export.map_plane import MapPlane


def squares(side: int) -> MapPlane:
    """Short links on a grid of so many places either way, 100 apart."""
    x, y = (axis.ravel() * 100.0 for axis in np.meshgrid(np.arange(side), np.arange(side)))
    ends = np.stack((np.stack((x, y), axis=1), np.stack((x + 50.0, y), axis=1)), axis=1)
    return MapPlane(shapely.linestrings(ends), ends[:, 0], 1.0)


def test_a_city_is_cut_to_where_it_changes_with_what_was_edited() -> None:
    plane = squares(40)
    x, y = plane.points.T
    nobody = np.zeros(len(x), bool)
    sizes = np.where((x <= 500) & (y <= 500), 3.0, 0.0)
    left, bottom, right, top = changed_part(plane, sizes, nobody)
    assert (left, bottom) == plane.extent[:2]
    assert 500 <= right < 2000
    assert 500 <= top < 2000
    far = (x == 3900) & (y == 3900)
    assert changed_part(plane, sizes, far) == (left, bottom, 3950.0, 3900.0)


def test_a_small_network_and_one_without_changes_are_shown_whole() -> None:
    for plane, change in ((squares(5), 1.0), (squares(40), 0.0)):
        sizes = np.zeros(len(plane.lines))
        sizes[0] = change
        assert changed_part(plane, sizes, sizes > 0) == plane.extent

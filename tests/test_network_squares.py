"""What lies around nodes is found square by square as by looking at all of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.csgraph import floyd_warshall

from uxsim_geo.network.incidence import Ends
from uxsim_geo.network.squares import points_by_road, shortest_roads, squares

SEEDS = range(4)


@pytest.mark.parametrize("seed", SEEDS)
def test_each_part_has_all_that_is_around_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-500.0, 900.0, (300, 2)).round(-1)  # some on the edges of squares
    some = rng.integers(0, 300, 80)
    seen = []
    for part, near in squares(points, some, 100.0, 70.0):
        at = points[some[part]]
        assert (np.floor(at / 100.0) == np.floor(at[0] / 100.0)).all()
        low, high = at.min(axis=0) - 70.0, at.max(axis=0) + 70.0
        around = ((points >= low) & (points <= high)).all(axis=1)
        assert near.tolist() == np.flatnonzero(around).tolist()
        assert part.tolist() == sorted(part.tolist())
        seen += part.tolist()
    assert sorted(seen) == list(range(80))
    assert len({tuple(cell) for cell in np.floor(points[some] / 100.0)}) > 30


def test_nobody_has_no_parts() -> None:
    assert not list(squares(np.zeros((3, 2)), np.empty(0, dtype=np.int64), 100.0, 50.0))


@pytest.mark.parametrize("seed", SEEDS)
def test_places_by_road_are_no_further_apart_than_by_road(seed: int) -> None:
    """Otherwise a part would lack what is near; and far nodes are told from one another."""
    rng = np.random.default_rng(seed)
    start = np.concatenate([np.arange(59), rng.integers(0, 60, 30)])
    end = np.concatenate([np.arange(1, 60), rng.integers(0, 60, 30)])
    ends = Ends(np.append(start, 61), np.append(end, 62), 63)  # 60 to 62 no road leads to
    length = rng.uniform(0.0, 900.0, 90)
    points = points_by_road(ends, length)
    apart = np.abs(points[:, None] - points).max(axis=2)
    by_road = floyd_warshall(shortest_roads(ends, length), directed=False)
    assert np.isfinite(points).all()
    assert (apart <= by_road + 1e-6).all()
    assert apart[:60, :60].max() == pytest.approx(by_road[:60, :60].max(), rel=0.2)
    assert apart[60, :60].min() > by_road[:60, :60].max()

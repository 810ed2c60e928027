"""Which rounding concerns which: the parts of a graph, numbered as scipy numbers them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from uxsim_geo.demand.rounding import _connected_parts


@pytest.mark.parametrize("seed", range(40))
def test_parts_are_those_of_scipy(seed: int) -> None:
    draw = np.random.default_rng(seed)
    vertices = int(draw.integers(1, 60))
    ends = draw.integers(0, vertices, size=(2, int(draw.integers(0, 2 * vertices))))
    graph = coo_array((np.ones(ends.shape[1]), (ends[0], ends[1])), shape=(vertices, vertices))
    _, expected = connected_components(graph, directed=False)
    assert _connected_parts(ends, vertices).tolist() == expected.tolist()


def test_a_long_chain_is_one_part() -> None:
    """Met from its end, where the trees of the parts are deepest."""
    vertex = np.arange(20_000, 0, -1)
    assert not _connected_parts(np.stack([vertex, vertex - 1]), 20_001).any()

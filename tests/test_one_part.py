"""One part, or several: as scipy has it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from uxsim_geo.network.one_part import is_one_part


@pytest.mark.parametrize("seed", range(60))
def test_one_part_is_what_scipy_finds_one_part(seed: int) -> None:
    draw = np.random.default_rng(seed)
    nodes = int(draw.integers(1, 12))
    start, end = draw.integers(0, nodes, size=(2, int(draw.integers(0, 5 * nodes))))
    graph = coo_array((np.ones(len(start)), (start, end)), shape=(nodes, nodes))
    parts, _ = connected_components(graph, connection="strong")
    assert is_one_part(start, end, nodes) == (parts == 1)


def test_the_examples_are_of_both_kinds() -> None:
    ring = np.arange(5)
    assert is_one_part(ring, (ring + 1) % 5, 5)
    assert not is_one_part(ring[:-1], ring[1:], 5)


def test_a_network_of_nothing_has_no_two_parts() -> None:
    nothing = np.array([], np.int64)
    assert is_one_part(nothing, nothing, 0)

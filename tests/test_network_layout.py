"""The schematic map keeps distances where distances can be kept."""

from __future__ import annotations

import numpy as np
import pytest

from uxsim_geo.network.layout import schematic_layout


def distances(place: np.ndarray) -> np.ndarray:
    return np.asarray(np.hypot(*(place[:, None, :] - place[None, :, :]).transpose(2, 0, 1)))


def test_a_chain_is_laid_out_straight_and_to_scale() -> None:
    length = np.array([100.0, 300.0, 50.0, 550.0])
    place = schematic_layout(np.arange(4), np.arange(1, 5), length, 5)
    along = np.concatenate([[0.0], np.cumsum(length)])
    assert distances(place) == pytest.approx(np.abs(along[:, None] - along), abs=1.0)


def test_a_ring_is_laid_out_round() -> None:
    place = schematic_layout(np.arange(24), np.roll(np.arange(24), -1), np.full(24, 10.0), 24)
    radius = np.hypot(*(place - place.mean(axis=0)).T)
    assert radius.std() < 0.02 * radius.mean()


def test_parts_lie_side_by_side_and_nodes_apart() -> None:
    start, end = np.array([0, 1, 2, 4]), np.array([1, 2, 0, 5])
    place = schematic_layout(start, end, np.zeros(4), 8)
    assert np.isfinite(place).all()
    apart = distances(place) + np.eye(8)
    assert apart.min() > 0


def test_coincident_leaves_are_moved_apart() -> None:
    place = schematic_layout(np.zeros(6, dtype=int), np.arange(1, 7), np.full(6, 100.0), 7)
    assert (distances(place) + np.eye(7)).min() > 0

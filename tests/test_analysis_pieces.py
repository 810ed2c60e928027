"""Analysis of events read in pieces, and of passages block by block: the same, to the bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from drives import crowded_grid
from small_networks import across, grid, network

import uxsim_geo.analysis.run_passages as blocks
from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.comparison.corridors import corridor_times
from uxsim_geo.analysis.cumulative import cumulative_curves
from uxsim_geo.analysis.link_shares import link_shares
from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.run_passages import BY_PASSAGE, RunPassages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.analysis.selection import select_link, users_of_links
from uxsim_geo.analysis.summary import summary
from uxsim_geo.analysis.trajectories import trajectories
from uxsim_geo.analysis.trips import trip_routes, trip_summary
from uxsim_geo.analysis.turns import turning_counts
from uxsim_geo.analysis.vehicles_over_time import vehicles_over_time
from uxsim_geo.control import SpeedLimit
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.events import EventTable
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

SOME = [3, 7, 40, 41, 200]
EVERY_FIFTH = np.arange(0, 300, 5)


def _corridors(result: Result, of: Network) -> pd.DataFrame:
    routes = trip_routes(result)
    long = routes["vehicle"].value_counts().idxmax()
    path = routes.loc[routes["vehicle"] == long, "link"].astype(str).tolist()
    states = link_times(result, of, bin_s=200.0)
    return corridor_times(result, of, {"all": path, "middle": path[1:3], "first": path[:1]}, states)


def _shares(result: Result, of: Network) -> pd.DataFrame:
    counts = pd.DataFrame({"link_id": of.links["link_id"].iloc[:9]})
    counts = counts.assign(start_s=100.0, end_s=500.0, vehicles=10.0)
    shares = link_shares(result, of, across(5, 40, 900.0), counts)
    return pd.DataFrame(shares.toarray())


def _users(result: Result, of: Network) -> pd.DataFrame:
    two = [str(name) for name in of.links["link_id"].iloc[[4, 11]]]
    return pd.concat([users_of_links(result, two), users_of_links(result, two, use="all")])


TABLES: dict[str, Callable[[Result, Network], pd.DataFrame]] = {
    "link times": lambda result, of: link_times(result, of, bin_s=77.0),
    "of some vehicles": lambda result, of: link_times(result, of, bin_s=77.0, vehicles=SOME),
    "cells": lambda result, of: space_time_cells(result, of, bin_s=200.0, cell_m=300.0),
    "trips": trip_summary,
    "summary": lambda result, of: pd.json_normalize(summary(result, of)),
    "routes": lambda result, _: trip_routes(result),
    "some routes": lambda result, _: trip_routes(result, vehicles=SOME),
    "turns": lambda result, of: turning_counts(result, of, bin_s=150.0),
    "vehicles": lambda result, _: vehicles_over_time(result, [0.0, 300.0, 800.0], vehicles=SOME),
    "users": _users,
    "selected": lambda result, of: select_link(result, of, str(of.links["link_id"].iloc[8])).links,
    "corridors": _corridors,
    "shares": _shares,
    "curves": lambda result, of: cumulative_curves(result, of, str(of.links["link_id"].iloc[8])),
    "trajectories": lambda result, of: trajectories(result, of, step_s=9.0, vehicles=SOME),
    "on links": lambda result, of: trajectories(
        result, of, step_s=9.0, links=[str(of.links["link_id"].iloc[8])]
    ),
}


@cache
def limited_grid() -> tuple[Network, Result]:
    """The crowded grid, with speed limits that come and go."""
    of = network(grid(5))
    some = tuple(of.links["link_id"].astype(str).iloc[::3])
    limits = [SpeedLimit(some, 6.0, begin=100.0, end=300.0), SpeedLimit(some, 9.0, begin=400.0)]
    return of, simulate(of, across(5, 40, 900.0), Settings(800.0, seed=3), control=limits)


CASES = {"free": crowded_grid, "limited": limited_grid}


@pytest.fixture(params=CASES)
def case(request: pytest.FixtureRequest) -> tuple[Network, Result]:
    """A network and a run of which some drive at the end."""
    return CASES[request.param]()


@pytest.fixture
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no more than a few passages be in memory together."""
    monkeypatch.setattr(blocks, "TOGETHER", 300)
    monkeypatch.setattr(blocks, "MOST_BLOCKS", 1000)


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("piece", [7, 1000])
def test_pieces_change_nothing(
    case: tuple[Network, Result], name: str, piece: int, request: pytest.FixtureRequest
) -> None:
    of, result = case
    whole = TABLES[name](result, of)
    request.getfixturevalue("small_blocks")
    cut = replace(result, log=EventTable(result.events, piece=piece))
    assert len(list(RunPassages(cut, of).blocks(np.arange(len(of.links))))) > 5
    assert len(whole)
    pd.testing.assert_frame_equal(TABLES[name](cut, of), whole, check_exact=True)


@pytest.mark.usefixtures("small_blocks")
def test_blocks_hold_all_links_and_no_more_passages_than_they_may(
    case: tuple[Network, Result],
) -> None:
    of, result = case
    run, whole = RunPassages(result, of), Passages.of(result, of)
    links = np.arange(0, len(of.links), 2)
    most = np.diff(whole.first).max()
    seen = []
    for own, passages in run.blocks(links):
        seen.append(own)
        assert len(passages.link) <= 300 + most
        assert set(passages.link) <= set(own)
    assert np.concatenate(seen).tolist() == links.tolist()
    assert len(seen) > 3
    for name in BY_PASSAGE:
        parts = [getattr(passages, name) for _, passages in run.blocks(links)]
        expected = getattr(whole, name)[np.isin(whole.link, links)]
        np.testing.assert_array_equal(np.concatenate(parts), expected)


@pytest.mark.usefixtures("small_blocks")
def test_around_some_vehicles_their_positions_are_what_they_are_among_all(
    case: tuple[Network, Result],
) -> None:
    of, result = case
    chosen = np.isin(np.arange(len(result.trips)), EVERY_FIFTH)
    whole = Passages.of(result, of)
    some = RunPassages(result, of).around(chosen)
    assert len(some.link) < len(whole.link)
    columns = []
    for passages in (whole, some):
        samples = Samples.of(passages, 3.0, 800.0)
        samples = samples.where(chosen[passages.vehicle[samples.row]])
        columns.append(
            (passages.vehicle[samples.row], samples.time, samples.position, samples.speed)
        )
    for one, other in zip(*columns, strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(columns[0][0]) > 1000


def test_a_run_of_few_entries_is_sorted_once() -> None:
    of, result = crowded_grid()
    run = RunPassages(result, of)
    every = np.arange(len(of.links))
    whole = run.whole
    assert whole is not None
    assert run.on(every[:2]) is whole
    assert run.around(np.zeros(len(result.trips), bool)) is whole
    assert [passages for _, passages in run.blocks(every)] == [whole]
    assert {one.name for one in fields(Passages)} >= set(BY_PASSAGE)


def test_who_drove_are_those_with_entries() -> None:
    of, result = crowded_grid()
    entered: Any = result.events.groupby("vehicle")["enter_s"].min()
    cut = replace(result, log=EventTable(result.events, piece=11))
    assert RunPassages(cut, of).drove().tolist() == entered.index.tolist()
    early = entered.index[entered < 300.0]
    assert RunPassages(cut, of).drove(300.0).tolist() == early.tolist()

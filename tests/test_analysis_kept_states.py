"""States of links that are kept for cells in which something happened are those of the table."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from small_networks import across, grid
from small_networks import network as network_of_rows

from uxsim_geo.analysis import kept_states
from uxsim_geo.analysis.kept_states import LinkStates
from uxsim_geo.analysis.link_states import link_states, link_times, link_totals
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings


@pytest.fixture(scope="module")
def crowded() -> tuple[Network, Result]:
    """Queues on some links, and links and bins in which nobody is."""
    of = network_of_rows(grid(4))
    return of, simulate(of, across(4, 15.0, 300.0), Settings(900.0))


@pytest.fixture(scope="module")
def both(crowded: tuple[Network, Result]) -> tuple[LinkStates, pd.DataFrame]:
    of, result = crowded
    return link_states(result, of, bin_s=70.0), link_times(result, of, bin_s=70.0)


def test_few_cells_are_kept_and_none_that_counts_is_missed(
    both: tuple[LinkStates, pd.DataFrame],
) -> None:
    kept, table = both
    there = (table[["time", "entries", "exits", "spillback_share"]] > 0).any(axis=1)
    assert kept.cell.tolist() == np.flatnonzero(there).tolist()
    assert 0 < len(kept.cell) < 0.9 * len(table)
    assert table["spillback_share"].max() > 0
    assert table["queue"].max() > 0


@pytest.mark.parametrize("links", [slice(None), slice(0, 1), slice(5, 30), slice(40, None)])
@pytest.mark.parametrize("bins", [slice(None), slice(0, 1), slice(3, 9), slice(12, None)])
def test_a_part_is_that_part_of_the_table(
    both: tuple[LinkStates, pd.DataFrame], links: slice, bins: slice
) -> None:
    kept, table = both
    rows = np.arange(len(table)).reshape(-1, kept.bins)[links, bins].ravel()
    assert len(rows) > 0
    pd.testing.assert_frame_equal(
        kept.table(links, bins), table.iloc[rows].reset_index(drop=True), check_exact=True
    )


def test_columns_are_those_of_the_table(both: tuple[LinkStates, pd.DataFrame]) -> None:
    kept, table = both
    ours, given = StateGrid.of(kept), StateGrid.of(table)
    assert ours.link_ids.tolist() == given.link_ids.tolist()
    for name in table.columns.drop(["link_id", "begin_s", "end_s"]):
        np.testing.assert_array_equal(ours.values(name), given.values(name))
    pd.testing.assert_frame_equal(link_totals(kept), link_totals(table), check_exact=True)
    for bins in (slice(2, 4), slice(None)):
        pd.testing.assert_frame_equal(ours.table_of(bins), given.table_of(bins))


def test_links_worked_out_one_by_one_are_those_of_all(
    crowded: tuple[Network, Result],
    both: tuple[LinkStates, pd.DataFrame],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of, result = crowded
    kept, table = both
    monkeypatch.setattr(kept_states, "AT_ONCE", 1)
    alone = link_states(result, of, bin_s=70.0)
    pd.testing.assert_frame_equal(alone.table(), table, check_exact=True)
    np.testing.assert_array_equal(alone.values("flow"), kept.values("flow"))


def test_some_links_are_as_among_all(
    crowded: tuple[Network, Result], both: tuple[LinkStates, pd.DataFrame]
) -> None:
    of, result = crowded
    ids = of.links["link_id"].iloc[[3, 17, 18, 30]].tolist()
    some = link_states(result, of, bin_s=70.0, links=ids).table()
    _, table = both
    pd.testing.assert_frame_equal(
        some, table[table["link_id"].isin(ids)].reset_index(drop=True), check_exact=True
    )

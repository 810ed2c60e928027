"""States that are filtered or sorted are no grid of links and bins: refused, not summed."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest
from mapped_network import two_way_road
from small_networks import across, grid
from small_networks import network as network_of_rows

from uxsim_geo.analysis.areas import area_states
from uxsim_geo.analysis.link_states import link_times, link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.skims import skims
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.export.layers import link_times_layer, links_layer
from uxsim_geo.export.plots import network_at_time_figure, network_state_figure
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: what makes wrong figures of states
SPOILT: dict[str, Callable[[pd.DataFrame], pd.DataFrame]] = {
    "sorted by time": lambda states: states.sort_values(["begin_s", "link_id"]),
    "backwards": lambda states: states[::-1],
    "without empty rows": lambda states: states[states["time"] > 0],
    "without a row": lambda states: states.drop(states.index[5]),
    "of one link twice": lambda states: pd.concat([states, states[:3]]),
    "of other bins at one link": lambda states: states.assign(
        begin_s=states["begin_s"] + (np.arange(len(states)) < 3)
    ),
    "empty": lambda states: states[:0],
    "of figures alone": lambda states: states[["distance", "time"]],
}


@pytest.fixture(scope="module")
def crowded() -> tuple[Network, Result, pd.DataFrame]:
    of = network_of_rows(grid(3))
    result = simulate(of, across(3, 15.0, 400.0), Settings(900.0))
    return of, result, link_times(result, of, bin_s=300.0)


@pytest.mark.parametrize("spoil", SPOILT.values(), ids=list(SPOILT))
def test_what_is_no_grid_is_refused_by_all(
    crowded: tuple[Network, Result, pd.DataFrame], spoil: Callable[[pd.DataFrame], pd.DataFrame]
) -> None:
    of, result, states = crowded
    spoilt, start = spoil(states), datetime(2000, 1, 1, tzinfo=UTC)
    for make in (
        lambda: network_states(spoilt, of),
        lambda: link_totals(spoilt),
        lambda: area_states(spoilt, of, {"one": of.links["link_id"][:2]}),
        lambda: skims(result, of, bin_s=300.0, states=spoilt),
        lambda: links_layer(of, spoilt),
        lambda: link_times_layer(of, spoilt, start),
        lambda: network_at_time_figure(of, spoilt, 0.0, ""),
    ):
        with pytest.raises(InputError, match="states"):
            make()


def test_links_and_bins_may_be_left_out_as_a_whole(
    crowded: tuple[Network, Result, pd.DataFrame],
) -> None:
    of, _, states = crowded
    later = network_states(states[states["begin_s"] >= 300], of)
    pd.testing.assert_frame_equal(later, network_states(states, of)[1:].reset_index(drop=True))
    some = of.links["link_id"].iloc[[7, 2]].tolist()
    chosen = states[states["link_id"].isin(some)]
    lanes_m = 2 * 300.0
    expected = chosen.groupby("begin_s")["time"].sum() / (lanes_m * 300.0)
    assert network_states(chosen, of)["density"].to_numpy() == pytest.approx(expected.to_numpy())
    texts = network_states(chosen.assign(link_id=chosen["link_id"].astype(str)), of)
    pd.testing.assert_frame_equal(texts, network_states(chosen, of))
    assert link_totals(chosen)["link_id"].tolist() == sorted(
        some, key=list(states["link_id"]).index
    )


def test_a_map_is_of_all_links_and_states_are_of_the_network(
    crowded: tuple[Network, Result, pd.DataFrame],
) -> None:
    of, result, states = crowded
    road = two_way_road()
    with pytest.raises(InputError, match="totals, column link_id: must hold all links"):
        network_state_figure(road, link_totals(states), "")
    some = link_times(result, of, bin_s=300.0, links=of.links["link_id"][:2])
    with pytest.raises(InputError, match="states, column link_id: must hold all links"):
        links_layer(of, some)
    with pytest.raises(InputError, match="network has no such link"):
        network_states(states, road)

"""Turning counts: by hand on a crossing, and what comes in goes out."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from drives import Drive, crowded_grid, result_of
from small_networks import link, network

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.trips import trip_routes
from uxsim_geo.analysis.turns import turning_counts
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result

NAN = np.nan

#: two ways into x, two out; then on from n. The nodes come in the order s, x, n, w.
CROSSING = network(
    [
        link("sx", "s", "x"),
        link("xn", "x", "n"),
        link("nw", "n", "w"),
        link("wx", "w", "x"),
        link("xs", "x", "s"),
    ]
)


def traffic() -> Result:
    drives = [
        Drive("s", "w", 0.0, [("sx", 0, 50), ("xn", 50, 100), ("nw", 100, 150)]),
        Drive("s", "n", 1.0, [("sx", 10, 60), ("xn", 60, 110)], vehicles=2),
        Drive("w", "s", 2.0, [("wx", 20, 70), ("xs", 70, NAN)], "running", 3),
        Drive("w", "n", 3.0, [("wx", 30, 99), ("xn", 99, NAN)], "running", 4, "heavy"),
        Drive("s", "x", 4.0, [("sx", 40, 95)], vehicles=1),
    ]
    return result_of(CROSSING, drives, 160.0)


def test_turns_by_hand() -> None:
    table = turning_counts(traffic(), CROSSING)
    assert table.astype(str).to_numpy().tolist() == [
        ["x", "sx", "xn", "7.0"],
        ["x", "wx", "xn", "4.0"],
        ["x", "wx", "xs", "3.0"],
        ["n", "xn", "nw", "5.0"],
    ]


def test_turns_by_the_time_of_the_move() -> None:
    table = turning_counts(traffic(), CROSSING, bin_s=60.0)
    assert table[["from_link", "to_link", "begin_s", "end_s", "vehicles"]].to_numpy().tolist() == [
        ["sx", "xn", 0.0, 60.0, 5.0],
        ["sx", "xn", 60.0, 120.0, 2.0],
        ["wx", "xn", 60.0, 120.0, 4.0],
        ["wx", "xs", 60.0, 120.0, 3.0],
        ["xn", "nw", 60.0, 120.0, 5.0],
    ]


def test_turns_of_some() -> None:
    table = turning_counts(traffic(), CROSSING, vehicles=[3, 4])
    assert table.astype(str).to_numpy().tolist() == [["x", "wx", "xn", "4.0"]]
    assert turning_counts(traffic(), CROSSING, vehicles=[4]).empty


@pytest.mark.parametrize("bin_s", [60.0, 333.0, 1e4])
def test_what_leaves_a_link_turns_or_has_arrived(bin_s: float) -> None:
    of, result = crowded_grid()
    turns, routes = turning_counts(result, of, bin_s=bin_s), trip_routes(result)
    states = link_times(result, of, bin_s=bin_s)
    ends = routes.drop_duplicates("vehicle", keep="last").dropna(subset="exit_s")
    starts = routes.drop_duplicates("vehicle")
    for turn_end, count, others, moment in (
        ("from_link", "exits", ends, "exit_s"),
        ("to_link", "entries", starts, "enter_s"),
    ):
        own = pd.DataFrame(
            {
                "link_id": others["link"],
                "begin_s": others[moment] // bin_s * bin_s,
                "vehicles": result.trips["vehicles"].to_numpy()[others["vehicle"]],
            }
        )
        moved = turns.rename(columns={turn_end: "link_id"})[["link_id", "begin_s", "vehicles"]]
        both = pd.concat([own, moved]).astype({"link_id": str})
        wanted = states.astype({"link_id": str}).set_index(["link_id", "begin_s"])[count]
        found = both.groupby(["link_id", "begin_s"])["vehicles"].sum().reindex(wanted.index)
        assert found.fillna(0.0).tolist() == wanted.tolist(), count


def test_turns_are_at_nodes_where_both_links_meet_and_in_their_order() -> None:
    of, result = crowded_grid()
    turns, links = turning_counts(result, of, bin_s=200.0), of.links.set_index("link_id")
    node = turns["node"].astype(str).to_numpy()
    assert (links["to_node_id"].loc[turns["from_link"]].to_numpy() == node).all()
    assert (links["from_node_id"].loc[turns["to_link"]].to_numpy() == node).all()
    names = ["node", "from_link", "to_link"]
    keys = pd.DataFrame({name: turns[name].cat.codes for name in names})
    assert keys.assign(begin=turns["begin_s"]).apply(tuple, axis=1).is_monotonic_increasing


def test_a_wrong_bin_and_nobody_are_refused() -> None:
    with pytest.raises(InputError, match="bin_s"):
        turning_counts(traffic(), CROSSING, bin_s=-5.0)
    with pytest.raises(InputError, match="names nobody"):
        turning_counts(traffic(), CROSSING, vehicles=[])
    with pytest.raises(InputError, match="another run"):
        turning_counts(traffic(), crowded_grid()[0])

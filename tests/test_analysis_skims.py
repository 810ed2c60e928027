"""Skims: paths worked out by hand, and means that are those of the trips."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from drives import Drive, crowded_grid, result_of
from small_networks import link, network

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.skims import skims
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

NAN = np.nan
EXPERIENCED = "experienced_travel_time_completed_only_s"
INSTANTANEOUS = "instantaneous_travel_time_s"
FREE_FLOW = "free_flow_travel_time_s"

#: a to d: over b in 100 s (two parallel links b to d), over c in 120 s; nothing leads from d
DIAMOND = network(
    [
        link("ab", "a", "b"),
        link("bd", "b", "d"),
        link("bd slow", "b", "d", free_speed=5.0),
        link("ac", "a", "c", 1200.0),
        link("cd", "c", "d", 1200.0),
    ]
)


def queue_on_ab() -> Result:
    """From 100 s to 200 s somebody is on ab for 100 s; before that the road is empty."""
    drives = [
        Drive("a", "d", 90.0, [("ab", 100.0, 200.0), ("bd", 200.0, 250.0)], free_time_s=100.0),
        Drive("a", "d", 130.0, [("ac", 130.0, 190.0), ("cd", 190.0, 250.0)], vehicles=2),
        Drive("a", "d", 140.0, [("ac", 150.0, 210.0), ("cd", 210.0, 280.0)], vehicles=1),
        Drive("a", "d", 210.0, [("ac", 210.0, 270.0), ("cd", 270.0, NAN)], "running"),
        Drive("a", "c", 290.0, (), "waiting"),
        Drive("a", "c", 310.0, (), "waiting"),
    ]
    return result_of(DIAMOND, drives, 300.0)


def of_pair(table: pd.DataFrame, origin: str, destination: str) -> pd.DataFrame:
    own = (table["origin"] == origin) & (table["destination"] == destination)
    return table[own].reset_index(drop=True)


def test_times_between_two_nodes_by_hand() -> None:
    table = of_pair(skims(queue_on_ab(), DIAMOND, bin_s=100.0), "a", "d")
    assert table["begin_s"].tolist() == [0.0, 100.0, 200.0]
    assert table["end_s"].tolist() == [100.0, 200.0, 300.0]
    assert table["vehicles_departed"].tolist() == [5.0, 3.0, 5.0]
    assert table["vehicles_completed"].tolist() == [5.0, 3.0, 0.0]
    assert table[EXPERIENCED].to_numpy() == pytest.approx(
        [160.0, (2 * 120 + 140) / 3, NAN], nan_ok=True
    )
    assert table[FREE_FLOW].tolist() == [100.0] * 3
    # 1 km at 10 m/s and 50 s would make 150 s: the other road takes 120 s
    assert table[INSTANTANEOUS].to_numpy()[:2] == pytest.approx([100.0, 120.0])


def test_no_path_and_no_trips() -> None:
    table = skims(queue_on_ab(), DIAMOND, bin_s=300.0, nodes=["d", "a"])
    assert table["origin"].tolist() == ["a", "d"]  # as in the nodes table, not as asked
    assert table["destination"].tolist() == ["d", "a"]
    back = table.iloc[1]
    assert np.isnan([back[FREE_FLOW], back[INSTANTANEOUS], back[EXPERIENCED]]).all()
    assert back["vehicles_departed"] == 0
    # those who never arrived leave no time, those who departed after the end no trace
    waiting = of_pair(skims(queue_on_ab(), DIAMOND, bin_s=300.0), "a", "c").iloc[0]
    assert waiting[["vehicles_departed", "vehicles_completed"]].tolist() == [5, 0]
    assert np.isnan(waiting[EXPERIENCED])


def test_standing_traffic_takes_a_hundred_times_as_long() -> None:
    of = network([link("ab", "a", "b")])
    drives = [
        Drive("a", "b", 0.0, [("ab", 0.0, NAN)], "running", 200),
        Drive("a", "b", 1.0, [("ab", 60.0, NAN)], "running", 5),
    ]
    result = result_of(of, drives, 2000.0)
    # the first stand at the end of the link from 50 s on, the others at its start from 60 s on
    table = skims(result, of, bin_s=1000.0)
    assert table[INSTANTANEOUS].to_numpy()[1] == pytest.approx(5000.0)


def no_passing(node: str) -> Network:
    through = DIAMOND.nodes["node_id"] != node
    return replace(DIAMOND, nodes=DIAMOND.nodes.assign(through_traffic=through))


@pytest.mark.parametrize(("node", "time"), [("b", 120.0), ("c", 100.0)])
def test_paths_end_at_nodes_without_through_traffic_but_do_not_pass(node: str, time: float) -> None:
    barred = no_passing(node)
    table = skims(result_of(barred, [Drive("a", "d", 0.0, (), "waiting")], 100.0), barred,
                  bin_s=100.0, nodes=["a", "d", node])  # fmt: skip
    assert of_pair(table, "a", "d")[FREE_FLOW].tolist() == [time]
    assert of_pair(table, "a", node)[FREE_FLOW].notna().all()
    assert of_pair(table, node, "d")[FREE_FLOW].notna().all()


@pytest.mark.parametrize("bin_s", [100.0, 333.0, 1e4])
def test_means_of_a_run_are_those_of_its_trips(bin_s: float) -> None:
    of, result = crowded_grid()
    table = skims(result, of, bin_s=bin_s)
    trips = result.trips[result.trips["status"] == "completed"].copy()
    trips["begin_s"] = trips["depart_s"] // bin_s * bin_s
    trips["time"] = trips["vehicles"] * (trips["arrive_s"] - trips["depart_s"])
    sums = trips.groupby(["origin", "destination", "begin_s"])[["vehicles", "time"]].sum()
    rows = table.set_index(["origin", "destination", "begin_s"])
    found = rows[rows["vehicles_completed"] > 0]
    assert len(found) == len(sums)
    assert found["vehicles_completed"].tolist() == sums["vehicles"].loc[found.index].tolist()
    mean = (sums["time"] / sums["vehicles"]).loc[found.index]
    assert found[EXPERIENCED].to_numpy() == pytest.approx(mean.to_numpy())
    departed = result.trips["depart_s"] <= result.settings.duration
    assert table["vehicles_departed"].sum() == result.trips.loc[departed, "vehicles"].sum()


def test_free_flow_is_the_engine_s_and_a_lower_bound() -> None:
    of, result = crowded_grid()
    table = skims(result, of, bin_s=200.0)
    free = table.drop_duplicates(["origin", "destination"]).set_index(["origin", "destination"])
    trips = result.trips
    own = free.loc[pd.MultiIndex.from_frame(trips[["origin", "destination"]]), FREE_FLOW]
    # the engine looks for its paths in milliseconds
    assert own.to_numpy() == pytest.approx(trips["free_time_s"].to_numpy(), abs=0.01)
    assert (table[INSTANTANEOUS] >= table[FREE_FLOW] - 1e-9).all()
    assert (table[INSTANTANEOUS] > table[FREE_FLOW] + 10).any()
    with_trips = table.dropna(subset=EXPERIENCED)
    assert (with_trips[EXPERIENCED] >= with_trips[FREE_FLOW] - 0.01).all()


def test_every_pair_has_every_slice_in_order() -> None:
    of, result = crowded_grid()
    table = skims(result, of, bin_s=300.0)
    assert len(table) == (16 * 16 - 16) * 3  # nodes on the four sides; 0, 300 and 600 s
    keys = [table["origin"].cat.codes, table["destination"].cat.codes, table["begin_s"]]
    assert pd.DataFrame(dict(enumerate(keys))).apply(tuple, axis=1).is_monotonic_increasing


def test_given_states_are_taken_as_they_are() -> None:
    of, result = crowded_grid()
    states = link_times(result, of, bin_s=150.0)
    pd.testing.assert_frame_equal(
        skims(result, of, bin_s=150.0, states=states), skims(result, of, bin_s=150.0)
    )
    crawling = skims(result, of, bin_s=150.0, states=states.assign(instantaneous_travel_time=150.0))
    assert crawling[INSTANTANEOUS].to_numpy() == pytest.approx(10 * crawling[FREE_FLOW].to_numpy())
    with pytest.raises(InputError, match="states"):
        skims(result, of, bin_s=160.0, states=states)


@pytest.mark.parametrize(
    ("nodes", "bin_s", "message"),
    [
        (["a", "x"], 100.0, "nodes: there is none of this name"),
        ([], 100.0, "nodes: is empty"),
        (None, 0.0, "bin_s"),
    ],
)
def test_wrong_questions_are_refused(
    nodes: Iterable[str] | None, bin_s: float, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        skims(queue_on_ab(), DIAMOND, bin_s=bin_s, nodes=nodes)


def test_the_result_of_another_network_is_refused() -> None:
    with pytest.raises(InputError, match="is no node of the network"):
        skims(queue_on_ab(), crowded_grid()[0], bin_s=100.0)
    fewer = replace(DIAMOND, links=DIAMOND.links.drop(index=2))
    with pytest.raises(InputError, match="its links are not those"):
        skims(queue_on_ab(), fewer, bin_s=100.0)


def test_a_table_that_no_memory_holds_is_refused() -> None:
    of, result = crowded_grid()
    with pytest.raises(InputError, match="rows: choose fewer nodes"):
        skims(result, of, bin_s=0.005)

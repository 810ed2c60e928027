"""Plans for the signals of a network: which nodes get one, and what traffic makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from signal_sites import greens_of, junction, network_of, phases_of, road
from small_networks import demand, exits

from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.signal_options import SignalOptions
from uxsim_geo.network.signal_plans import signal_plans
from uxsim_geo.network.signal_rows import COLUMNS
from uxsim_geo.network.signal_table import signals_of_table
from uxsim_geo.settings import Settings

Q = 0.8  # veh/s of one lane of `road`


def topics(notes: Notes) -> dict[str, str]:
    table = notes.table()
    return dict(zip(table["element_id"], table["topic"], strict=True))


def test_the_table_has_its_columns_and_follows_the_nodes_and_links() -> None:
    """Two crossings, whose nodes stand in the table the other way round than their links."""
    first, second = junction([0, 90, 180, 270]), junction([0, 90, 180, 270])
    renamed = second.links.assign(
        link_id="z" + second.links["link_id"],
        from_node_id="z" + second.links["from_node_id"],
        to_node_id="z" + second.links["to_node_id"],
    )
    nodes = pd.concat([second.nodes.assign(node_id="z" + second.nodes["node_id"]), first.nodes])
    plans = signal_plans(Network(nodes, pd.concat([first.links, renamed])))
    assert tuple(plans.columns) == COLUMNS
    assert plans["node_id"].tolist() == ["zX"] * 4 + ["X"] * 4
    assert plans["phase"].tolist() == [1, 1, 2, 2] * 2
    assert plans["link_id"].tolist() == ["za", "zc", "zb", "zd", "a", "c", "b", "d"]
    assert plans["cycle_s"].tolist() == [60] * 8
    assert [str(kind) for kind in plans.dtypes] == ["str", "int64", "str", *["float64"] * 4, "str"]


def test_a_network_without_signals_gives_a_table_without_rows() -> None:
    network = junction([0, 90, 180])
    for nodes in (network.nodes.assign(control="none"), network.nodes.drop(columns="control")):
        plans = signal_plans(replace(network, nodes=nodes))
        assert plans.empty
        assert tuple(plans.columns) == COLUMNS
        assert [str(kind) for kind in plans.dtypes][:3] == ["str", "int64", "str"]
        assert signals_of_table(plans) == []


def test_signals_that_need_no_plan_are_left_out_and_noted() -> None:
    links = pd.DataFrame(
        [
            road("1", "A", "one"),
            road("2", "one", "B"),
            road("3", "one", "C"),
            road("4", "A", "middle"),
            road("5", "middle", "A"),
            road("6", "B", "middle"),
            road("7", "middle", "B"),
            road("8", "source", "A"),
        ]
    )
    notes = Notes()
    assert signal_plans(network_of(links, ["one", "middle", "source"]), notes=notes).empty
    assert topics(notes) == {
        "one": "signal needs no plan",
        "source": "signal needs no plan",
        "middle": "signal at no junction",
    }


def test_opposite_streams_alone_are_no_conflict() -> None:
    """Two that meet head on, and a street that only leads away."""
    network = junction([90, 270], one_way=True)
    notes = Notes()
    assert signal_plans(network, notes=notes).empty
    assert topics(notes) == {"X": "signal without conflict"}


@pytest.mark.parametrize("ways", [1, 2])
def test_a_crossing_in_mid_block_may_stop_all_for_pedestrians(ways: int) -> None:
    links = [road("4", "A", "middle"), road("7", "middle", "B")]
    links += [road("6", "B", "middle"), road("5", "middle", "A")] if ways == 2 else []
    options = SignalOptions(crossings="pedestrians", pedestrian_green=12.5)
    plans = signal_plans(network_of(pd.DataFrame(links), ["middle"]), options)
    assert phases_of(plans, "middle")[0] == ({"4"} if ways == 1 else {"4", "6"})
    assert plans["link_id"].isna().tolist() == [False] * ways + [True]
    assert greens_of(plans, "middle") == [40, 12.5]  # 60 s less 8 and 12.5, in whole seconds
    assert plans["cycle_s"].unique().tolist() == [60.5]


def test_links_without_a_capacity_are_refused() -> None:
    network = junction([0, 90, 180, 270])
    network.links.loc[network.links["link_id"].isin(["a", "b"]), "free_speed"] = np.nan
    with pytest.raises(InputError, match=r"2 rows have no capacity \(link_id a, b\): give lanes"):
        signal_plans(network)
    network.links["capacity"] = 0.5
    assert greens_of(signal_plans(network)) == [26, 26]


def test_the_input_is_left_as_it_was_and_the_plans_are_the_same_again() -> None:
    network = junction([0, 90, 180, 270], lanes=[1, 2, 3, 1])
    links, nodes = network.links.copy(), network.nodes.copy()
    first = signal_plans(network)
    pd.testing.assert_frame_equal(signal_plans(network), first)
    pd.testing.assert_frame_equal(network.links, links)
    pd.testing.assert_frame_equal(network.nodes, nodes)


@pytest.mark.parametrize(
    "lanes", [[1, 1, 1, 1], [3, 1, 3, 1], [1, 2, 1, 2]], ids=["equal", "3 to 1", "1 to 2"]
)
def test_queues_that_never_end_discharge_in_proportion_to_green(lanes: list[int]) -> None:
    """Platoons of one vehicle leave at 0, 1/Q, 2/Q … of each green, Q that of their link."""
    network = junction([0, 90, 180, 270], lanes=lanes)
    plans = signal_plans(network)
    duration = 4000
    streams = [("A", "C"), ("B", "D"), ("C", "A"), ("D", "B")]
    rows = [
        (start, end, 0.0, float(duration), 2.0 * duration * max(lanes)) for start, end in streams
    ]
    settings = Settings(duration=duration, platoon_size=1)
    signals = signals_of_table(plans)
    result = simulate(network, demand(*rows), settings, control=signals)
    begin = 0.0
    cycle = plans["cycle_s"].iloc[0]
    for links, green in zip(phases_of(plans), greens_of(plans), strict=True):
        for link_id in sorted(links):
            times = exits(result, link_id)
            assert ((times - begin) % cycle < green + 1e-6).all()
            own_lanes = lanes["abcd".index(link_id)]
            whole = times[(times >= 10 * cycle) & (times < 60 * cycle)]
            assert len(whole) / 50 == pytest.approx(green * Q * own_lanes, abs=1.0)
        begin += green + plans["all_red_s"].iloc[0]


def test_the_engine_runs_a_corridor_of_signals_with_pedestrians() -> None:
    """All arrive though a crossing stops them, and nobody passes while pedestrians walk."""
    links = pd.DataFrame([road("in", "A", "X"), road("out", "X", "B")])
    options = SignalOptions(crossings="pedestrians")
    plans = signal_plans(network_of(links, ["X"]), options)
    network = network_of(links, ["X"])
    told = demand(("A", "B", 0.0, 1800.0, 500.0))
    result = simulate(network, told, Settings(3600, 1), control=signals_of_table(plans))
    assert (result.trips["status"] == "completed").all()
    green, cycle = greens_of(plans)[0], plans["cycle_s"].iloc[0]
    times = exits(result, "in")
    assert (times % cycle < green).all()
    assert len(times) == 500

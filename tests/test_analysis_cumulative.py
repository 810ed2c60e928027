"""Cumulative curves of a link: counts by hand, theory of a bottleneck, and order of the curves."""

from __future__ import annotations

import numpy as np
import pytest
from drives import Drive, crowded_grid, result_of
from small_networks import demand, link, network, on_link, run_streams

from uxsim_geo.analysis.cumulative import cumulative_curves
from uxsim_geo.control import SpeedLimit
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

NAN = np.nan

#: 1 km each, 50 s at free flow
ROAD = network([link("ab", "a", "b"), link("bc", "b", "c")])


def three_platoons() -> Result:
    """One free, one held up for 30 s, one that has not left at the end, 120 s."""
    drives = [
        Drive("a", "b", 0.0, [("ab", 10, 60)], vehicles=5),
        Drive("a", "b", 0.0, [("ab", 20, 100)], vehicles=3),
        Drive("a", "b", 0.0, [("ab", 60, NAN)], "running", 2),
    ]
    return result_of(ROAD, drives, 120.0)


def test_curves_by_hand() -> None:
    table = cumulative_curves(three_platoons(), ROAD, "ab", [100, 0, 10, 69.9, 70, 120, 60])
    assert list(table) == ["time_s", "entries", "virtual_departures", "exits", "queue"]
    assert table.to_numpy().tolist() == [
        [100.0, 10.0, 8.0, 8.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [10.0, 5.0, 0.0, 0.0, 0.0],
        [69.9, 10.0, 5.0, 5.0, 0.0],
        [70.0, 10.0, 8.0, 5.0, 3.0],
        [120.0, 10.0, 10.0, 8.0, 2.0],
        [60.0, 10.0, 5.0, 5.0, 0.0],
    ]


def test_every_moment_at_which_a_curve_rises() -> None:
    table = cumulative_curves(three_platoons(), ROAD, "ab")
    assert table["time_s"].tolist() == [0.0, 10.0, 20.0, 60.0, 70.0, 100.0, 110.0, 120.0]
    assert table["queue"].tolist() == [0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 2.0, 2.0]


def test_rounding_lets_no_exit_come_before_its_virtual_departure() -> None:
    early = float(np.nextafter(60.0, 0.0))
    result = result_of(ROAD, [Drive("a", "b", 0.0, [("ab", 10, early)])], 120.0)
    table = cumulative_curves(result, ROAD, "ab", [early])
    assert table[["virtual_departures", "exits"]].to_numpy().tolist() == [[5.0, 5.0]]


def test_a_link_that_nobody_uses_has_flat_curves() -> None:
    table = cumulative_curves(three_platoons(), ROAD, "bc")
    assert table["time_s"].tolist() == [0.0, 120.0]
    assert not table.drop(columns="time_s").to_numpy().any()


def test_the_queue_before_a_bottleneck_grows_by_what_it_does_not_serve() -> None:
    links = [link("ab", "a", "b", 4000.0), link("bc", "b", "c", capacity=0.4)]
    result = run_streams(links, [("a", "c", 0.0, 500.0, 0.7)], 800.0, 1)
    times = np.array([250.0, 400.0, 550.0, 690.0])
    table = cumulative_curves(result, network(links), "ab", times)
    # 0.7 veh/s come to the end from 200 s on, 0.4 leave; each curve is in whole vehicles
    assert table["queue"].to_numpy() == pytest.approx(0.3 * (times - 200.0), abs=2.0)


def test_the_area_of_the_queue_is_the_delay() -> None:
    links = [link("ab", "a", "b"), link("bc", "b", "c", capacity=0.4)]
    result = run_streams(links, [("a", "c", 0.0, 300.0, 0.7)], 900.0, 5)
    events = on_link(result, "ab")
    assert events["exit_s"].notna().all()
    delay = 5 * (events["exit_s"] - events["enter_s"] - 50.0).sum()
    assert delay > 1000
    table = cumulative_curves(result, network(links), "ab")
    area = (table["queue"].to_numpy()[:-1] * np.diff(table["time_s"])).sum()
    assert area == pytest.approx(delay)


def test_curves_rise_never_cross_and_count_the_events() -> None:
    of, result = crowded_grid()
    sizes = result.trips["vehicles"].to_numpy()
    times = np.linspace(0.0, 800.0, 37)
    queues = 0.0
    for link_id in of.links["link_id"]:
        events = on_link(result, link_id)
        weights = sizes[events["vehicle"]]
        for table in (
            cumulative_curves(result, of, link_id),
            cumulative_curves(result, of, link_id, times),
        ):
            entered, could, left = (
                table[name].to_numpy() for name in ("entries", "virtual_departures", "exits")
            )
            assert (entered >= could).all()
            assert (could >= left).all()
            assert min(np.diff(curve).min() for curve in (entered, could, left)) >= 0
            queues = max(queues, table["queue"].max())
            for curve, moments in ((entered, events["enter_s"]), (left, events["exit_s"])):
                here = moments.to_numpy()[:, None] <= table["time_s"].to_numpy()
                assert curve.tolist() == (weights[:, None] * here).sum(axis=0).tolist()
    assert queues > 20


def test_free_flow_is_that_of_the_limit_at_the_entry() -> None:
    # 20 m/s until 100 s, then 10: nobody is in anybody's way
    control = [SpeedLimit("ab", 10.0, begin=100.0)]
    told = Settings(400.0, 5, deterministic=True)
    result = simulate(ROAD, demand(("a", "b", 0.0, 200.0, 40.0)), told, control=control)
    events = on_link(result, "ab")
    taken = (events["exit_s"] - events["enter_s"]).round(6)
    assert set(taken) == {50.0, 100.0}
    assert cumulative_curves(result, ROAD, "ab")["queue"].max() == 0


@pytest.mark.parametrize(
    ("link_id", "times", "column"),
    [("ac", None, "link"), ("ab", [], "times"), ("ab", [-1.0], "times"), ("ab", 121.0, "times")],
)
def test_what_is_not_there_is_refused(
    link_id: str, times: list[float] | float | None, column: str
) -> None:
    with pytest.raises(InputError) as error:
        cumulative_curves(three_platoons(), ROAD, link_id, times)
    assert [fault.column for fault in error.value.faults] == [column]


def test_a_result_of_another_network_is_refused() -> None:
    with pytest.raises(InputError, match="another run"):
        cumulative_curves(three_platoons(), network([link("ab", "a", "b")]), "ab")

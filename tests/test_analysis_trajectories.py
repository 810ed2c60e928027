"""Trajectories as tables: by hand, against the closed form and the events, and on the map."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from drives import Drive, crowded_grid, result_of
from mapped_network import two_way_road
from small_networks import Q, demand, link, network, run_streams

import uxsim_geo.analysis.trajectories as module
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.trajectories import LinkLines, trajectories
from uxsim_geo.control import SpeedLimit
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

NAN = np.nan

#: 1 km each, 50 s at free flow
ROAD = network([link("ab", "a", "b"), link("bc", "b", "c")])


def two_platoons() -> Result:
    """The first drives through; the second meets it nowhere and is on bc at the end, 150 s."""
    drives = [
        Drive("a", "c", 0.0, [("ab", 10, 60), ("bc", 60, 110)]),
        Drive("a", "c", 0.0, [("ab", 55, 105), ("bc", 105, NAN)], "running"),
    ]
    return result_of(ROAD, drives, 150.0)


def test_trajectories_by_hand() -> None:
    table = trajectories(two_platoons(), ROAD, step_s=25.0)
    assert list(table) == ["vehicle", "link", "time_s", "position", "speed"]
    assert table.drop(columns="speed").astype({"link": str}).to_numpy().tolist() == [
        [0, "ab", 25.0, 300.0],
        [0, "ab", 50.0, 800.0],
        [0, "bc", 75.0, 300.0],
        [0, "bc", 100.0, 800.0],
        [1, "ab", 75.0, 400.0],
        [1, "ab", 100.0, 900.0],
        [1, "bc", 125.0, 400.0],
        [1, "bc", 150.0, 900.0],
    ]
    speed = table["speed"].to_numpy()
    assert speed[:-1] == pytest.approx(np.full(7, 20.0))
    assert np.isnan(speed[-1])  # nothing is known of what comes after the end


def test_chosen_moments_vehicles_and_links() -> None:
    def look(**choice: object) -> list[list[object]]:
        table = trajectories(two_platoons(), ROAD, **choice)  # type: ignore[arg-type]
        return table[["vehicle", "time_s"]].to_numpy().tolist()

    assert look(times=[75.0, 50.0, 75.0, 130.0]) == [[0, 50], [0, 75], [1, 75], [1, 130]]
    assert look(times=[50.0, 75.0], vehicles=[1]) == [[1, 75]]
    assert look(times=[50.0, 75.0], links="bc") == [[0, 75]]
    assert look(times=[50.0, 75.0, 130.0], links=["bc"], vehicles=[1]) == [[1, 130]]
    assert look(times=5.0) == []
    # on a link from the entry on and before the exit
    assert look(times=[10.0, 60.0, 110.0], vehicles=[0]) == [[0, 10], [0, 60]]


def test_a_vehicle_enters_every_link_at_its_start_when_the_events_say_so() -> None:
    of, result = crowded_grid()
    entered = result.events["enter_s"].to_numpy()
    table = trajectories(result, of, times=entered[entered <= 800.0])
    keys = ["vehicle", "link", "time_s"]
    events = result.events.rename(columns={"enter_s": "time_s"})
    met = events.merge(table.astype({"link": str}), on=keys, how="left")
    assert (met["position"] == 0.0).all()
    assert len(table) > len(met)


def test_positions_and_presence_are_those_of_the_closed_form_and_the_events() -> None:
    of, result = crowded_grid()
    table = trajectories(result, of, step_s=7.0)
    assert (table["time_s"] % 7 == 0).all()
    keys = ["vehicle", "time_s"]
    assert table[keys].equals(table[keys].sort_values(keys, ignore_index=True))
    assert not table.duplicated(keys).any()
    leave = result.events["exit_s"].fillna(np.inf).to_numpy()
    for time in (0.0, 77.0, 700.0, 798.0):
        there = result.events[(result.events["enter_s"] <= time) & (leave > time)]
        there = there.sort_values("vehicle")
        here = table[table["time_s"] == time]
        assert here["vehicle"].tolist() == there["vehicle"].tolist()
        assert here["link"].tolist() == there["link"].tolist()

    passages = Passages.of(result, of)
    for row in range(0, passages.link.size, 97):
        link_id = of.links["link_id"][passages.link[row]]
        own = (table["vehicle"] == passages.vehicle[row]) & (table["link"] == link_id)
        own &= table["time_s"].between(passages.enter[row], passages.exit[row], inclusive="left")
        times = table.loc[own, "time_s"].to_numpy()
        expected = passages.positions(np.full(times.size, row), times)
        assert table.loc[own, "position"].tolist() == expected.tolist()


def test_speeds_add_up_to_the_way() -> None:
    # Δt = 5 s: at this step each speed holds from one row to the next of the same link
    of, result = crowded_grid()
    step = result.settings.step
    table = trajectories(result, of, step_s=step)
    speed, free = table["speed"].to_numpy(), 20.0
    assert np.nanmin(speed) >= 0
    assert np.nanmax(speed) <= free
    same = (table["vehicle"].diff() == 0) & (table["link"].astype(str) == table["link"].shift())
    same &= table["position"].diff() >= 0
    driven = table["position"].diff()[same]
    assert speed[np.flatnonzero(same) - 1] * step == pytest.approx(driven.to_numpy(), abs=1e-9)
    assert (speed < 1.0).sum() > 1000
    # and does not depend on what else is asked for
    other = trajectories(result, of, times=[400.0, 795.0])
    at_those = table[table["time_s"].isin([400.0, 795.0])].reset_index(drop=True)
    pd.testing.assert_frame_equal(other, at_those)


def test_a_queue_creeps_at_the_speed_of_the_diagram() -> None:
    links = [link("ab", "a", "b"), link("bc", "b", "c", capacity=Q / 2)]
    result = run_streams(links, [("a", "c", 0.0, 600.0, 0.7)], 600.0, 1)
    table = trajectories(result, network(links), step_s=1.0, links="ab")
    queue = table[table["time_s"].between(300, 500) & table["position"].between(700, 900)]
    # flow 0.4 veh/s: density 0.2 - 0.4 / 5 = 0.12 veh/m, speed 0.4 / 0.12; one platoon in 200 m
    assert queue["speed"].mean() == pytest.approx(0.4 / 0.12, rel=0.02)


def test_who_enters_under_a_limit_drives_at_the_limit() -> None:
    control = [SpeedLimit("ab", 10.0, begin=100.0)]
    told = Settings(300.0, 5, deterministic=True)
    result = simulate(ROAD, demand(("a", "b", 0.0, 200.0, 40.0)), told, control=control)
    table = trajectories(result, ROAD, step_s=5.0)
    table = table[table["time_s"] < 300.0]
    entered = result.events.set_index("vehicle")["enter_s"][table["vehicle"]].to_numpy()
    speed = np.where(entered < 100.0, 20.0, 10.0)
    assert {10.0, 20.0} == set(speed)
    assert table["speed"].to_numpy() == pytest.approx(speed)
    assert table["position"].to_numpy() == pytest.approx(
        speed * (table["time_s"].to_numpy() - entered)
    )


def test_blocks_leave_no_seam(monkeypatch: pytest.MonkeyPatch) -> None:
    of, result = crowded_grid()
    whole = trajectories(result, of, step_s=40.0)
    for size in (1, 37):
        monkeypatch.setattr(module, "BLOCK", size)
        few = {"vehicles": np.arange(0, len(result.trips), 10)}
        pieces = trajectories(result, of, step_s=40.0, **few)
        expected = whole[whole["vehicle"] % 10 == 0].reset_index(drop=True)
        pd.testing.assert_frame_equal(pieces, expected)


def bent_road() -> Network:
    """A kilometre drawn as two legs of 30 and 40 m at a right angle, and back by a link unseen."""
    road = two_way_road()
    lines = [shapely.LineString([(0, 0), (30, 0), (30, 40)]), None]
    return Network(road.nodes, gpd.GeoDataFrame(road.links.assign(geometry=lines), crs=25832))


def test_places_follow_the_line_by_the_share_of_its_length() -> None:
    road = bent_road()
    drives = [Drive("a", "b", 0.0, [("link 0", 0, 50)]), Drive("b", "a", 0.0, [("link 1", 0, 50)])]
    table = trajectories(result_of(road, drives, 60.0), road, times=[0.0, 15.0, 25.0, 45.0])
    own = table[table["vehicle"] == 0]
    assert own["position"].tolist() == [0.0, 300.0, 500.0, 900.0]
    # 0, 30, 50 and 90 % of 70 m
    places = [[0, 0], [21, 0], [30, 5], [30, 33]]
    assert own[["x", "y"]].to_numpy() == pytest.approx(np.array(places, float), abs=1e-12)
    assert table.loc[table["vehicle"] == 1, ["x", "y"]].isna().all().all()


def test_places_on_lines_are_those_of_shapely() -> None:
    random = np.random.default_rng(7)
    lines = [shapely.LineString(random.normal(0, 500, (n, 2))) for n in random.integers(2, 9, 40)]
    again = [(0, 0), (1, 0), (1, 0), (1, 2)]
    standing = shapely.LineString([(3, 4), (3, 4)])
    up = shapely.LineString([(0, 0, 5), (6, 8, 9)])
    lines += [shapely.LineString(), None, shapely.LineString(again), standing, up]
    kept = np.array(lines, dtype=object)
    rows = random.integers(0, len(lines), 5000)
    shares = random.choice([0.0, 1.0, 0.5, *random.random(200)], 5000)
    x, y = LinkLines.of(kept).points(rows, shares)
    points = shapely.line_interpolate_point(kept[rows], shares, normalized=True)
    there = ~(shapely.is_missing(points) | shapely.is_empty(points))
    assert x[there] == pytest.approx(shapely.get_x(points[there]), abs=1e-9)
    assert y[there] == pytest.approx(shapely.get_y(points[there]), abs=1e-9)
    assert np.isnan(x[~there]).all()
    assert np.isnan(y[~there]).all()
    assert set(rows[~there]) == {40, 41}


@pytest.mark.parametrize(
    ("choice", "column"),
    [
        ({}, "times"),
        ({"times": [1.0], "step_s": 1.0}, "times"),
        ({"times": []}, "times"),
        ({"times": [150.1]}, "times"),
        ({"times": [NAN]}, "times"),
        ({"step_s": 0.0}, "step_s"),
        ({"step_s": NAN}, "step_s"),
        ({"step_s": 1e-5}, "step_s"),
        ({"step_s": 1.0, "vehicles": []}, "vehicles"),
        ({"step_s": 1.0, "vehicles": [2]}, "vehicles"),
        ({"step_s": 1.0, "links": ["ab", "ac"]}, "links"),
    ],
)
def test_what_cannot_be_shown_is_refused(choice: dict[str, object], column: str) -> None:
    with pytest.raises(InputError) as error:
        trajectories(two_platoons(), ROAD, **choice)  # type: ignore[arg-type]
    assert [fault.column for fault in error.value.faults] == [column]


def test_a_result_of_another_network_is_refused() -> None:
    with pytest.raises(InputError, match="another run"):
        trajectories(two_platoons(), network([link("ab", "a", "b")]), step_s=1.0)

"""Signals of measured networks: each is planned or its absence noted, by the angles on the map."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_networks import demand, exits

from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.signal_plans import signal_plans
from uxsim_geo.network.signal_table import (
    read_signal_table,
    signals_of_table,
    write_signal_table,
)
from uxsim_geo.settings import Settings

#: plans by their number of phases
FILES = {
    "heidelberg.osm.pbf": {2: 234, 3: 3},
    "portland-central-filtered.osm.pbf": {2: 467, 3: 7},
    "monaco-latest.osm.pbf": {2: 5},
    "reisterstown-via-restriction.osm.pbf": {2: 92},
}

LEFT_OUT = ("signal needs no plan", "signal at no junction", "signal without conflict")


@pytest.fixture(scope="module", params=FILES)
def planned(
    request: pytest.FixtureRequest, shared: Path
) -> tuple[str, Network, pd.DataFrame, pd.DataFrame]:
    """Name of the file, its network, the plans and the notes."""
    network = read_osm_network(shared / "data" / "osm" / request.param, OsmOptions())
    notes = Notes()
    plans = signal_plans(network, notes=notes)
    return request.param, network, plans, notes.table()


Planned = tuple[str, Network, pd.DataFrame, pd.DataFrame]


def test_every_signal_has_a_plan_or_a_note(planned: Planned) -> None:
    name, network, plans, notes = planned
    signals = network.nodes.loc[network.nodes["control"] == "signal", "node_id"].tolist()
    left = notes.loc[notes["topic"].isin(LEFT_OUT), "element_id"].tolist()
    with_plan = plans["node_id"].drop_duplicates().tolist()
    assert sorted(with_plan + left) == sorted(signals)
    assert [node for node in signals if node in set(with_plan)] == with_plan
    assert plans.groupby("node_id")["phase"].max().value_counts().to_dict() == FILES[name]


def test_every_in_link_has_green_in_one_phase_and_the_cycle_is_full(planned: Planned) -> None:
    _, network, plans, _ = planned
    ends = network.links.loc[network.links["to_node_id"].isin(plans["node_id"])]
    assert sorted(plans["link_id"]) == sorted(ends["link_id"])
    phases = plans.drop_duplicates(["node_id", "phase"])
    assert phases["green_s"].min() >= 8
    total = (phases["green_s"] + phases["all_red_s"]).groupby(phases["node_id"]).sum()
    assert (plans["node_id"].map(total) == plans["cycle_s"]).all()
    assert set(plans["cycle_s"]) <= {60.0, 90.0}


def test_links_of_a_phase_come_from_one_direction_or_its_opposite(planned: Planned) -> None:
    """Azimuths by the geodesic from a point 25 m back, found in the UTM zone of the place."""
    import shapely
    from pyproj import Geod

    _, network, plans, _ = planned
    lines = network.links.set_index("link_id").loc[plans["link_id"], "geometry"]
    metric = lines.to_crs(lines.estimate_utm_crs())
    back = metric.interpolate(np.maximum(metric.length - 25.0, 0.0)).to_crs(4326)
    end = shapely.get_coordinates(shapely.get_point(lines.to_numpy(), -1))
    azimuth, _, _ = Geod(ellps="WGS84").inv(back.x, back.y, end[:, 0], end[:, 1])
    by_phase = pd.Series(azimuth).groupby([plans["node_id"], plans["phase"]])
    for _, angles in by_phase:
        for one, other in itertools.combinations(angles, 2):
            apart = abs((one - other + 180.0) % 360.0 - 180.0)
            assert apart <= 20.5 or 180.0 - apart <= 45.0 + 20.5
    sizes = by_phase.size().groupby(level=0)
    for node_id in sizes.size()[sizes.size() == 2].index:
        angles = pd.Series(azimuth)[plans["node_id"] == node_id]
        spread = [abs((a - b + 180) % 360 - 180) for a, b in itertools.combinations(angles, 2)]
        assert any(20.0 <= apart <= 160.0 for apart in spread)  # there is something to part


def test_the_table_comes_back_and_makes_a_signal_of_every_plan(
    planned: Planned, tmp_path: Path
) -> None:
    _, network, plans, _ = planned
    write_signal_table(plans, tmp_path / "signals.csv")
    notes = Notes()
    back = read_signal_table(tmp_path / "signals.csv", network, notes=notes)
    pd.testing.assert_frame_equal(back, plans)
    assert notes.rows == []
    signals = signals_of_table(back)
    assert [signal.node_id for signal in signals] == plans["node_id"].drop_duplicates().tolist()


def test_traffic_passes_the_signals_of_monaco_in_their_greens(shared: Path) -> None:
    """From both ends of every link at a signal: trips go on, and none leaves at red."""
    network = read_osm_network(shared / "data" / "osm" / "monaco-latest.osm.pbf", OsmOptions())
    network = replace(network, movements=network.movements[:0])
    plans = signal_plans(network)
    signals = signals_of_table(plans)
    ends = network.links.set_index("link_id")
    rows = []
    for link_id in plans["link_id"]:
        start, node = ends.loc[link_id, "from_node_id"], ends.loc[link_id, "to_node_id"]
        onward = ends.loc[(ends["from_node_id"] == node) & (ends["to_node_id"] != start)]
        rows += [(start, goal, 0.0, 900.0, 20.0) for goal in onward["to_node_id"]]
    settings = Settings(3600, platoon_size=1, seed=3)
    result = simulate(network, demand(*rows), settings, control=signals)
    assert result.trips["status"].eq("completed").mean() > 0.9
    goals = result.trips["destination"].astype(str)
    passed = 0
    for signal in signals:
        for link_id, own in signal.greens().items():
            events = result.events[result.events["link"] == link_id].dropna()
            through = goals.iloc[events["vehicle"]].to_numpy() != signal.node_id
            at = events["exit_s"].to_numpy()[through] % signal.cycle
            good = [(at > begin - 1e-6) & (at < end + 1e-6) for begin, end in own]
            good.append(at > signal.cycle - 1e-6)
            assert np.logical_or.reduce(good).all()
            passed += len(at)
    assert passed > 100
    assert len(exits(result, plans["link_id"].iloc[0])) > 0

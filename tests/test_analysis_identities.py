"""Identities that hold to rounding on every sample run, and positions against the slow twin."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from conftest import REPOSITORY
from drawn_networks import row_of
from newell_link import events_of, result_of, trips_of
from small_networks import network as network_of_rows
from test_engine_twin import CASES, run_engine, twin_case
from twin import run_twin_for_positions

from pipeline.config_file import load_config
from pipeline.ingest import read_sources
from uxsim_geo.analysis.areas import area_states
from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.cumulative import curves_of_passages
from uxsim_geo.analysis.link_states import link_times, link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.skims import skims
from uxsim_geo.analysis.summary import summary
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.analysis.turns import turning_counts
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: all but studies and those whose roads are downloaded, which test_osm_download.py and
#: test_heidelberg_study_shared.py run
SAMPLES = sorted(
    name
    for name in (path.stem for path in (REPOSITORY / "configs").glob("*.yaml"))
    if name not in ("osm_place", "heidelberg") and not name.startswith("study_")
)


@cache
def sample(name: str) -> tuple[Network, Result]:
    config = load_config(REPOSITORY / f"configs/{name}.yaml")
    network, demand = read_sources(config.ingest)
    control = [entry.measure() for _, _, entry in config.simulate.control.entries()]
    classes = [entry.driver_class() for entry in config.simulate.classes]
    settings = config.simulate.settings()
    return network, simulate(network, demand, settings, control=control, classes=classes)


def vehicles_of_events(result: Result) -> np.ndarray:
    return result.trips["vehicles"].to_numpy(float)[result.events["vehicle"].to_numpy()]


@pytest.mark.parametrize("name", SAMPLES)
@pytest.mark.parametrize("bin_s", [300.0, 77.7])
def test_time_and_distance_by_edie_are_those_of_the_events(name: str, bin_s: float) -> None:
    network, result = sample(name)
    events, end = result.events, result.settings.duration
    states = link_times(result, network, bin_s=bin_s)
    on_link = vehicles_of_events(result) * (events["exit_s"].fillna(end) - events["enter_s"])
    by_link = states.groupby("link_id", observed=False)
    spent = on_link.groupby(events["link"], observed=False).sum()
    assert by_link["time"].sum().to_numpy() == pytest.approx(spent.to_numpy(), abs=1e-6)
    driven = (result.trips["vehicles"] * result.trips["distance_m"]).sum()
    assert states["distance"].sum() == pytest.approx(driven, rel=1e-9)
    product = states["density"] * states["speed"]
    there = states["time"] > 0
    assert states["flow"][there].to_numpy() == pytest.approx(product[there].to_numpy(), rel=1e-9)
    assert ((states["spillback_share"] >= 0) & (states["spillback_share"] <= 1)).all()
    # Edie's flow counts the way driven: it passes capacity by a platoon in a bin at most
    driven = states["flow"] * (states["end_s"] - states["begin_s"])
    share = states["volume_to_capacity"]
    beyond = (driven * (1 - 1 / share))[share > 0]
    assert (beyond <= result.settings.platoon_size + 1e-6).all()


@pytest.mark.parametrize("name", SAMPLES)
def test_link_tables_add_up_to_the_figures_of_the_run(name: str) -> None:
    network, result = sample(name)
    figures, states = summary(result, network), link_times(result, network, bin_s=300.0)
    totals, mfd = link_totals(states), network_states(states, network)
    for table in (totals, mfd, states):
        assert table["distance"].sum() == pytest.approx(figures["total_distance_veh_m"], rel=1e-9)
    trips = trip_summary(result, network)
    departed = trips[trips["depart_s"] <= result.settings.duration]
    waited = (departed["vehicles"] * departed["origin_wait_s"]).sum()
    assert totals["time"].sum() + waited == pytest.approx(figures["total_travel_time_veh_s"])
    ids = network.links["link_id"].astype(str).tolist()
    parts = area_states(states, network, {"a": ids[::2], "b": ids[1::2]})
    assert parts["time"].sum() == pytest.approx(mfd["time"].sum())
    cells = space_time_cells(result, network, bin_s=300.0, cell_m=250.0)
    for column in ("distance", "time"):
        assert cells[column].sum() == pytest.approx(totals[column].sum()), column


@pytest.mark.parametrize("name", SAMPLES)
def test_who_enters_came_from_home_or_by_a_turn(name: str) -> None:
    network, result = sample(name)
    states = link_times(result, network, bin_s=300.0)
    entered = states.groupby("link_id", observed=False)["entries"].sum()
    turned = turning_counts(result, network).groupby("to_link", observed=False)["vehicles"].sum()
    from_home = vehicles_of_events(result) * ~result.events.duplicated("vehicle").to_numpy()
    started = np.bincount(result.events["link"].cat.codes, from_home, minlength=len(network.links))
    by_turn = turned.reindex(entered.index, fill_value=0.0)
    assert entered.to_numpy() == pytest.approx(by_turn.to_numpy() + started)


@pytest.mark.parametrize("name", SAMPLES)
def test_cumulative_curves_never_cross(name: str) -> None:
    network, result = sample(name)
    passages = Passages.of(result, network)
    states = link_times(result, network, bin_s=300.0)
    for link, link_id in enumerate(network.links["link_id"].astype(str)):
        curves = curves_of_passages(passages, link)
        assert (curves["entries"] >= curves["virtual_departures"]).all()
        assert (curves["virtual_departures"] >= curves["exits"]).all()
        assert (curves[["entries", "virtual_departures", "exits"]].diff().dropna() >= 0).all(
            axis=None
        )
        own = states[states["link_id"] == link_id]
        assert curves["entries"].iloc[-1] == own["entries"].sum()
        assert curves["exits"].iloc[-1] == own["exits"].sum()


@pytest.mark.parametrize("name", SAMPLES)
def test_skims_are_the_means_of_the_trips(name: str) -> None:
    network, result = sample(name)
    table = skims(result, network, bin_s=600.0)
    pairs = od_table(result, network, bin_s=600.0)
    keys = ["origin", "destination", "begin_s"]
    both = table.merge(pairs, on=keys, suffixes=("", "_of_pairs"))
    column = "experienced_travel_time_completed_only_s"
    assert len(both) == (pairs["begin_s"] < result.settings.duration).sum() > 0
    np.testing.assert_allclose(both[column], both[f"{column}_of_pairs"], rtol=1e-9)
    trips = result.trips[result.trips["status"] == "completed"]
    time = (trips["vehicles"] * (trips["arrive_s"] - trips["depart_s"])).sum()
    assert (both[column] * both["vehicles_completed"]).sum() == pytest.approx(time)


@pytest.mark.parametrize("name", CASES)
def test_positions_are_those_of_the_twin_within_a_step(name: str) -> None:
    links, routes, streams = CASES[name]
    result = run_engine(links, streams, Settings(1200.0))
    case = twin_case(links, routes, result, substeps=12)
    network = network_of_rows([row_of(one) for one in links])
    rows, stays = [], []
    for link, (_, own) in enumerate(run_twin_for_positions(case)):
        for stay in own:
            left = np.nan if stay.left is None else stay.left
            rows.append((len(rows), link, stay.entered, left))
            stays.append(stay)
    # the link's closed form, of the entries and exits that the twin has
    trips = trips_of([{"vehicles": case.platoon_size} for _ in rows])
    passages = Passages.of(result_of(events_of(network, rows), trips, Settings(1200.0)), network)
    number = np.argsort(passages.vehicle)
    for row, stay in enumerate(stays):
        times = (stay.first_step + np.arange(len(stay.positions))) * case.step
        times = times[times < (np.inf if stay.left is None else stay.left)]
        expected = np.array(stay.positions[: len(times)])
        found = passages.positions(np.full(len(times), number[row]), times)
        travel = passages.geometry.free_speed[passages.link[number[row]]] * case.step
        assert np.abs(found - expected).max(initial=0.0) <= travel + 1e-6

"""The ring that locks itself: its tables against UXsim's, under the numbers of its nodes."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from uxsim_csv import read_uxsim_demand, read_uxsim_network

from pipeline.config_file import load_config
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.tntp import read_tntp_trips
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import Network
from uxsim_geo.network.overrides import apply_overrides
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

FOLDER = Path(__file__).resolve().parents[1] / "data" / "uroboros"
NUMBERS = {
    name: str(number) for number, name in enumerate(["N_in", "E_in", "S_in", "W_in", *"NESW"], 1)
}
CURES = ("merge_priority", "perimeter", "ramp_metering")
LINK_KEY = ["from_node_id", "to_node_id"]
LINK_FIGURES = ["length", "free_speed", "jam_density", "merge_priority"]


def read_network(overrides: str) -> Network:
    options = TntpOptions(length_unit="m", time_unit="s", crs="none", capacity="diagram")
    read = read_tntp_network(
        FOLDER / "uroboros_net.tntp", options, nodes=FOLDER / "uroboros_node.tntp"
    )
    return apply_overrides(read, FOLDER / overrides)


def read_demand(network: Network) -> Demand:
    west = TripsOptions(period_s=4800)
    east = TripsOptions(period_s=3600, start_s=1200)
    tables = [
        read_tntp_trips(FOLDER / f"uroboros_trips_{name}.tntp", options, network).table
        for name, options in (("west", west), ("east", east))
    ]
    return Demand(pd.concat(tables, ignore_index=True))


@pytest.mark.parametrize("overrides", ["overrides.csv", "overrides_prevented.csv"])
def test_it_can_be_simulated(overrides: str) -> None:
    network = read_network(overrides)
    check_network(network)
    check_demand(read_demand(network), network)
    assert (len(network.nodes), len(network.links)) == (8, 12)
    assert network.nodes["through_traffic"].all()


def test_lines_on_the_map_are_as_long_as_the_links() -> None:
    links = read_network("overrides.csv").links
    drawn = [line.length for line in links["geometry"]]
    assert drawn == pytest.approx(links["length"].tolist(), abs=0.01)


def test_the_cure_changes_two_priorities_and_nothing_else() -> None:
    locked = read_network("overrides.csv").links.set_index("link_id")
    cured = read_network("overrides_prevented.csv").links.set_index("link_id")
    changed = locked["merge_priority"] != cured["merge_priority"]
    north_east = f"{NUMBERS['N']}-{NUMBERS['E']}"
    south_west = f"{NUMBERS['S']}-{NUMBERS['W']}"
    assert set(changed.index[changed]) == {north_east, south_west}
    assert set(cured.loc[changed, "merge_priority"]) == {2}
    rest = [column for column in LINK_FIGURES if column != "merge_priority"]
    assert cured[rest].equals(locked[rest])


@pytest.mark.parametrize("seed", range(4))
def test_it_locks_by_itself_and_never_under_control(seed: int) -> None:
    network = read_network("overrides.csv")
    demand = read_demand(network)
    configs = FOLDER.parents[1] / "configs"
    for name in ("gridlock", *(f"gridlock_{cure}" for cure in CURES)):
        section = load_config(configs / f"{name}.yaml", [f"simulate.seed={seed}"]).simulate
        control = [entry.measure() for _, _, entry in section.control.entries()]
        result = simulate(network, demand, section.settings(), control=control)
        done = result.trips["status"] == "completed"
        assert result.trips["vehicles"].sum() == 4200
        assert (result.locked_vehicles > 0) == (name == "gridlock")
        assert done.all() == (name != "gridlock")


def test_links_and_demand_are_those_of_uxsim(shared: Path) -> None:
    folder = shared / "data" / "uxsim"
    theirs = read_uxsim_network(folder / "uroboros_nodes.csv", folder / "uroboros_links.csv").links
    theirs[LINK_KEY] = theirs[LINK_KEY].replace(NUMBERS)
    network = read_network("overrides.csv")
    columns = LINK_KEY + LINK_FIGURES
    ours = network.links[columns].sort_values(LINK_KEY).to_numpy().tolist()
    assert ours == theirs[columns].sort_values(LINK_KEY).to_numpy().tolist()

    wanted = read_uxsim_demand(folder / "uroboros_demand.csv").table
    wanted = wanted.replace({"origin": NUMBERS, "destination": NUMBERS})
    found = read_demand(network).table
    assert found.to_numpy().tolist() == wanted[found.columns].to_numpy().tolist()

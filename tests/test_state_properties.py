"""Edie's states of every run, on networks and demands drawn by hypothesis: their bounds."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_networks import Tables, webs
from hypothesis import given, settings
from small_networks import demand, link, network

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.settings import Settings

HAIR = 1e-9


@pytest.mark.parametrize("platoon_size", [1, 5])
@pytest.mark.parametrize("bins", [4, 37])
def test_densities_and_speeds_stay_within_the_diagram(platoon_size: int, bins: int) -> None:
    """0 ≤ k ≤ m κ, or one platoon where that is more; 0 ≤ v ≤ u; q = k v; nobody is lost."""
    densest = [0.0]

    @settings(derandomize=True, deadline=None, max_examples=40)
    @given(webs(platoon_size))
    def check(tables: Tables) -> None:
        links, rows = tables
        net, duration = network(links), 200.0 * platoon_size
        result = simulate(net, demand(*rows), Settings(duration, platoon_size))
        states = link_times(result, net, bin_s=duration / bins).set_index("link_id")
        table = net.links.set_index("link_id").loc[states.index]
        jam = table["lanes"] * table["jam_density"]
        most = np.maximum(jam, platoon_size / table["length"])
        assert states["density"].between(0.0, most * (1 + HAIR)).all()
        driven = states["speed"].dropna()
        assert driven.between(0.0, table["free_speed"][states["speed"].notna()] * (1 + HAIR)).all()
        used = states["density"] > 0
        flow = (states["density"] * states["speed"])[used]
        assert np.allclose(states["flow"][used], flow, rtol=1e-9, atol=1e-12)
        trips = result.trips
        spent = trips["arrive_s"].fillna(duration) - trips["enter_s"]
        spent = (spent * trips["vehicles"]).where(trips["status"] != "waiting")
        assert states["time"].sum() == pytest.approx(spent.sum(), rel=1e-9, abs=1e-6)
        densest[0] = max(densest[0], float((states["density"] / jam).max()))

    check()
    assert densest[0] > 0.8  # some links stand full


def test_a_bin_in_which_a_link_stands_full_has_its_jam_density() -> None:
    """The bound is reached: before a road that lets nobody in there are m κ L vehicles."""
    net = network([link("a", "0", "1"), link("b", "1", "2", capacity=1e-9)])
    result = simulate(net, demand(("0", "2", 0.0, 100.0, 400)), Settings(3000, 1))
    states = link_times(result, net, bin_s=1000.0).set_index("link_id")
    assert states.loc["a", "density"].iloc[-1] == pytest.approx(0.2)

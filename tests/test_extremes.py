"""What is far beyond any road, and still allowed: links, platoons and times at their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_networks import demand, exits, link, network

from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.settings import Settings


def test_memory_follows_the_demand_and_not_the_room_on_links() -> None:
    """A link of 10,000 km with 100 lanes has room for 10⁹ vehicles, of which 100 are there."""
    rows = [link(f"{n}", f"{n}", f"{n + 1}", 1e7, lanes=100, jam_density=1.0) for n in range(20)]
    run = Simulation(network(rows), demand(("0", "20", 0, 60, 100)), Settings(600, 1))
    held = run.world.links.platoon.nbytes + run.world.log.event.nbytes
    assert held < 10e6


@pytest.mark.parametrize("added", [False, True], ids=["from the start", "added on the way"])
def test_a_link_may_hold_more_platoons_than_any_buffer(added: bool) -> None:
    """20,000 set out within 100 s on a link of 5,000 s, and all are on it at the end."""
    net = network([link("a", "0", "1", 1e5, lanes=100, free_speed=20.0, jam_density=1.0)])
    everybody = demand(("0", "1", 0.0, 100.0, 20_000))
    run = Simulation(net, demand() if added else everybody, Settings(1000, 1, reaction_time=0.01))
    if added:
        run.add(everybody)
    run.advance(1000)
    result = run.result()
    assert (result.trips["status"] == "running").all()
    assert len(result.events) == len(result.trips) == 20_000
    assert result.events["exit_s"].isna().all()

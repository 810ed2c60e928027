"""The library as a user meets it: by the names of its first page."""

from __future__ import annotations

import subprocess
import sys

import pytest
from small_networks import demand, link, network

import uxsim_geo


def test_the_parts_most_used_are_there_by_name() -> None:
    from uxsim_geo import Demand, Network, Result, Settings, simulate

    tables = network([link("a", "1", "2")])
    result = simulate(
        Network(tables.nodes, tables.links),
        Demand(demand(("1", "2", 0, 60, 20)).table),
        Settings(duration=600),
    )
    assert isinstance(result, Result)
    assert (result.trips["status"] == "completed").all()
    assert set(uxsim_geo.__all__) == set(dir(uxsim_geo))
    for name in uxsim_geo.__all__:
        assert getattr(uxsim_geo, name) is not None


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Wrold'"):
        uxsim_geo.Wrold  # noqa: B018


def test_importing_the_library_is_light() -> None:
    program = "import sys, uxsim_geo; print([m for m in ('pandas', 'numba') if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("vehicles", [0.3, 1e-12])
def test_a_demand_of_nobody_gives_an_empty_result(vehicles: float) -> None:
    rows = [("1", "2", 0.0, 10.0, vehicles)] if vehicles > 1e-9 else []
    result = uxsim_geo.simulate(
        network([link("a", "1", "2")]), demand(*rows), uxsim_geo.Settings(duration=600)
    )
    assert len(result.trips) == int(result.trips["vehicles"].sum()) <= 1
    assert len(result.events) == len(result.trips)

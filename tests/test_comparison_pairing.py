"""Common random numbers: what a small change does is seen more sharply in pairs of runs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from conftest import REPOSITORY

from pipeline.config_file import load_config
from pipeline.ingest import read_sources
from uxsim_geo.analysis.comparison.comparing import compare
from uxsim_geo.analysis.comparison.comparison import Comparison, Facts
from uxsim_geo.analysis.comparison.measured import Measured
from uxsim_geo.analysis.comparison.measuring import MeasureOptions, measure
from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

SEEDS = range(10)

Job = tuple[Network, Demand, Settings]


@cache
def sioux_falls() -> Job:
    config = load_config(REPOSITORY / "configs/sioux_falls.yaml")
    return (*read_sources(config.ingest), config.simulate.settings())


def run(job: Job, seed: int) -> Measured:
    network, demand, settings = job
    result = simulate(network, demand, replace(settings, seed=seed))
    return measure(result, network, MeasureOptions(600.0))


@cache
def base(seed: int) -> Measured:
    return run(sioux_falls(), seed)


def narrowed(link_id: str, share: float) -> Job:
    """A link that lets so much of its capacity pass."""
    network, demand, settings = sioux_falls()
    links = network.links.copy()
    own = links["link_id"] == link_id
    capacity = effective_capacity(links, settings.reaction_time)
    links["capacity"] = np.where(own, share * capacity, links["capacity"])
    return replace(network, links=links), demand, settings


def compared(job: Job) -> Comparison:
    return compare(((base(seed), run(job, seed)) for seed in SEEDS), Facts())


@pytest.mark.parametrize("link_id", ["6-8", "13-24", "3-1"])
def test_pairing_makes_the_interval_a_third_of_the_unpaired_one_or_less(link_id: str) -> None:
    found = compared(narrowed(link_id, 0.9))
    delay = found.totals.set_index("figure").loc["total_delay_veh_h"]
    assert delay["seeds"] == 10
    # seeds do differ, and the change does something
    assert delay["unpaired_half_width"] > 0.01 * delay["base"]
    assert delay["half_width"] > 0
    assert delay["half_width"] <= delay["unpaired_half_width"] / 3
    assert delay["narrowing"] == pytest.approx(delay["unpaired_half_width"] / delay["half_width"])
    assert found.links.loc[found.links["changed"], "link_id"].tolist() == [link_id]
    assert set(found.trip_statuses["status_base"]) <= {"completed", "running", "waiting"}


def test_a_scenario_without_edits_differs_by_exactly_nothing() -> None:
    network, demand, settings = sioux_falls()
    again = replace(network, links=network.links.copy()), demand, settings
    found = compare(((base(seed), run(again, seed)) for seed in range(2)), Facts())
    assert (found.totals["difference"] == 0.0).all()
    assert (found.totals["p"] == 1.0).all()
    assert (found.links.filter(like="_difference").fillna(0.0) == 0.0).all(axis=None)
    assert not found.links["changed"].any()

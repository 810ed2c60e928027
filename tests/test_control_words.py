"""Measures of a configuration in words, for those who read the results."""

from __future__ import annotations

import math

import pytest
import yaml
from small_networks import link, network
from small_run import CONFIG, write_small_run

from pipeline.config_file import load_config
from pipeline.control_words import changes_of
from uxsim_geo.export.run_description import Change
from uxsim_geo.network.network import Network


def roads() -> Network:
    names = ["High Street", "High Street", None, "Lane", "Lane"]
    return network([link(f"{i}", f"{i}", f"{i + 1}", name=name) for i, name in enumerate(names)])


@pytest.mark.parametrize(
    ("key", "entry", "what", "where"),
    [
        ("closures", {"links": ["2"]}, "closed", "link 2"),
        ("closures", {"links": ["0", "1", "3", "4"]}, "closed", "High Street, Lane (4 links)"),
        ("closures", {"links": ["3"], "classes": ["x"]}, "closed to class x", "Lane (link 3)"),
        (
            "incidents",
            {"links": ["0"], "lanes_closed": 1},
            "1 lane blocked",
            "High Street (link 0)",
        ),
        ("speed_limits", {"links": ["2"], "speed_kmh": 30}, "speed limit of 30 km/h", "link 2"),
        ("tolls", {"links": ["2"], "amount": [[0, 1], [9, 4]]}, "toll of 1 to 4", "link 2"),
        (
            "node_capacities",
            {"nodes": ["1", "2", "3", "4"], "capacity_veh_per_h": 900},
            "at most 900 veh/h may pass",
            "nodes 1, 2, 3 and 1 more",
        ),
        (
            "link_capacities",
            {"where": "length > 1", "exit_veh_per_h": 600, "entry_veh_per_h": 700},
            "at most 600 veh/h may leave and 700 veh/h may enter",
            "High Street, Lane (5 links)",
        ),
        (
            "ramp_meters",
            {"links": ["2"], "rate_veh_per_h": 300},
            "metered to 300 veh/h",
            "link 2",
        ),
        (
            "perimeters",
            {"region": {"links": ["2"]}, "target_vehicles": 40},
            "perimeter that aims at 40 vehicles inside",
            "round link 2",
        ),
        (
            "signals",
            {"node_id": "1", "phases": [{"duration_s": 30, "links": ["0"]}]},
            "signal plan of 1 phase",
            "node 1",
        ),
        (
            "enforced_routes",
            {"origin": "0", "destination": "2", "links": ["0", "1"], "share": 0.5},
            "given route for 50 % of drivers",
            "from node 0 to node 2",
        ),
    ],
)
def test_measures_say_what_and_where(tmp_path, key, entry, what, where) -> None:
    config = yaml.safe_load(CONFIG)
    config["simulate"]["control"] = {key: [entry | {"begin_s": 60}]}
    path = write_small_run(tmp_path, yaml.safe_dump(config))
    (change,) = changes_of(load_config(path), roads())
    assert change == Change(what, where, 60.0, math.inf)

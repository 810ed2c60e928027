"""A base and a scenario of a few links, simulated and compared: with a link more, and one less."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import geopandas as gpd
import pandas as pd
import shapely
from small_networks import Row, demand, link

from uxsim_geo.analysis.comparison.comparing import compare
from uxsim_geo.analysis.comparison.comparison import Comparison, Facts
from uxsim_geo.analysis.comparison.measured import Measured
from uxsim_geo.analysis.comparison.measuring import MeasureOptions, measure
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

#: two ways from a to d, over b and over c, and one that starts at e and meets nobody; UTM zone 32
PLACES = {"a": (0, 0), "b": (1000, 800), "c": (1000, -800), "d": (2000, 0), "e": (-1000, 0)}
CRS = "EPSG:32632"

BOTH: list[Row] = [
    link("ab", "a", "b"),
    link("ac", "a", "c", free_speed=15.0),
    link("cd", "c", "d"),
    link("ea", "e", "a"),
    link("de", "d", "e", 3000.0),
]
BASE = [*BOTH, link("bd", "b", "d", capacity=0.5)]
#: without the link from b to d, with one from b to c
SCENARIO = [*BOTH, link("bc", "b", "c")]

TRIPS = demand(("a", "d", 0.0, 600.0, 300.0), ("e", "d", 0.0, 600.0, 60.0))

OPTIONS = MeasureOptions(bin_s=300.0, corridors={"north": ["ab", "bd"], "south": ["ac", "cd"]})


def placed(links: list[Row]) -> Network:
    """A network of these links, on the map."""
    table = pd.DataFrame(links)
    lines = [
        shapely.LineString((PLACES[start], PLACES[end]))
        for start, end in zip(table["from_node_id"], table["to_node_id"], strict=True)
    ]
    points = gpd.GeoDataFrame(
        {"node_id": list(PLACES), "zone_id": list(PLACES)},
        geometry=[shapely.Point(place) for place in PLACES.values()],
        crs=CRS,
    )
    return Network(points, gpd.GeoDataFrame(table, geometry=lines, crs=CRS))


def run(network: Network, seed: int, duration: float = 1800.0) -> Measured:
    """Measures of one run with the trips above."""
    return measure(simulate(network, TRIPS, Settings(duration, seed=seed)), network, OPTIONS)


@cache
def example_comparison(seeds: int = 4) -> tuple[Network, Network, Comparison]:
    """The network of the base, that of the scenario, and both compared over some seeds."""
    base, scenario = placed(BASE), placed(SCENARIO)
    pairs = ((run(base, seed), run(scenario, seed)) for seed in range(seeds))
    return base, scenario, compare(pairs, Facts("base", "other way"))


def example_without_intervals() -> tuple[Network, Network, Comparison]:
    """The same of one seed, with a link that is changed by other means than its attributes."""
    base, scenario, found = example_comparison(1)
    return base, scenario, replace(found, facts=replace(found.facts, changed_links=("ac",)))

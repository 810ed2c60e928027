"""Real cities from the map to the figures, by one configuration each, at the load of a busy hour.

Vehicles: about 0.12 an inhabitant of the area of the map in the hour, 0.06 in Porto Alegre.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.cli import main
from uxsim_geo.network.files import read_network

#: file, country, vehicles in the hour, size of the zones in m
CITIES = {
    "monaco": ("monaco-latest.osm.pbf", "FR", 8_000, 250),
    "bad hersfeld": ("bad-hersfeld.osm.xml.gz", "DE", 6_000, 500),
    "portland": ("portland-central-filtered.osm.pbf", "US", 30_000, 500),
    "heidelberg": ("heidelberg.osm.pbf", "DE", 20_000, 1000),
    "porto alegre": ("porto-alegre.osm.pbf", "BR", 40_000, 1000),
    "columbus": ("otp_columbus.osm.pbf", "US", 100_000, 2000),
}
HOUR = 3600.0


def config_of(name: str, shared: Path) -> dict[str, Any]:
    """One hour of a gravity model between cells, by their roads, and one hour to arrive."""
    file, country, vehicles, cell = CITIES[name]
    gravity = {
        "zones": {"cell_m": cell},
        "productions": {"road_km": 1},
        "attractions": {"road_km": 1},
        "total_vehicles": vehicles,
    }
    osm = {"file": str(shared / "data" / "osm" / file), "country": country}
    demand = [{"gravity": gravity, "demand_period_s": HOUR}]
    return {
        "name": name.replace(" ", "_"),
        "ingest": {"format": "osm", "osm": osm, "demand": demand},
        "simulate": {"duration_s": 2 * HOUR},
        "report": {"outputs": [], "plots": []},
    }


@pytest.mark.parametrize("name", CITIES)
def test_a_busy_hour_passes_and_nearly_all_arrive(name: str, shared: Path, tmp_path: Path) -> None:
    config = config_of(name, shared)
    path = tmp_path / "city.yaml"
    path.write_text(yaml.safe_dump(config), encoding="utf-8")
    assert main(["run", str(path), "--out", str(tmp_path), "--quiet"]) == 0
    run = tmp_path / config["name"]
    figures = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    demanded = CITIES[name][2]
    assert figures["vehicles_demanded"] == pytest.approx(demanded, rel=0.001)
    assert figures["vehicles_completed"] >= 0.95 * demanded
    assert not figures["gridlocked"]
    assert figures["vehicles_aborted"] == 0
    # neither empty roads nor a crawl: there are delays, and people move
    assert 0 < figures["completed"]["average_delay_s"] < HOUR / 2
    links = read_network(run / "network").links
    km = figures["total_distance_veh_m"] / figures["vehicles_demanded"] / 1000
    assert 0.3 < km < (links["length"].sum() / 1000) ** 0.5

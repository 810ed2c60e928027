"""Hashes of what the shipped examples give, kept in data/example_hashes.json.

    python tests/example_hashes.py           works all of them out and writes them anew
    python tests/example_hashes.py NAME ...  prints those of some examples, and writes nothing

They are of the values of events and trips, not of files, so that another version of the library
that writes the files is not taken for another model.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.config import Config
from pipeline.config_file import load_config
from pipeline.ingest import read_sources
from pipeline.scenarios import BASE, Tables, read_scenarios, resolve
from pipeline.study_config import read_study
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.files import replace_when_complete
from uxsim_geo.result import Result

HERE = Path(__file__).resolve().parent
CONFIGS = HERE.parent / "configs"
KEPT = HERE / "data/example_hashes.json"

#: configurations that read data which are downloaded
DOWNLOADED = ("heidelberg", "osm_place", "study_heidelberg_bridge")

Hashes = dict[str, str]


def names() -> list[str]:
    """The examples whose data are shipped, studies with each of their scenarios."""
    return [name for path in _configs() for name, *_ in _told(path)]


def _configs() -> list[Path]:
    return sorted(path for path in CONFIGS.glob("*.yaml") if path.stem not in DOWNLOADED)


def _told(path: Path) -> Iterator[tuple[str, Config, Tables | None]]:
    """The runs of an example: name, configuration, tables if they are not its sources as read."""
    if not path.stem.startswith("study_"):
        yield path.stem, load_config(path), None
        return
    study = read_study(path)
    read = Tables(*read_sources(load_config(study.config.base).ingest))
    scenarios = resolve(study.base, study.reading, read_scenarios(study.reading), read)
    for name, scenario in scenarios.items():
        if name != BASE:
            yield f"{path.stem}:{name}", scenario.config, scenario.tables


def simulations() -> Iterator[tuple[str, Config, Tables]]:
    """Every run of the examples: its name, what it is told, and its tables."""
    for path in _configs():
        for name, config, tables in _told(path):
            yield name, config, tables or Tables(*read_sources(config.ingest))


def simulation_of(config: Config, tables: Tables) -> Simulation:
    """The simulation of an example, before its first step."""
    told = config.simulate.settings()
    return Simulation(tables.network, tables.demand, told, **beside_the_tables(config))


def beside_the_tables(config: Config) -> dict[str, Any]:
    """The control and the classes of drivers of an example."""
    section = config.simulate
    return {
        "control": [entry.measure() for _, _, entry in section.control.entries()],
        "classes": [entry.driver_class() for entry in section.classes],
    }


def hashes_of(result: Result) -> Hashes:
    """SHA-256 of the values of both tables."""
    return {"events": hash_of(result.events), "trips": hash_of(result.trips)}


def hash_of(table: pd.DataFrame) -> str:
    """SHA-256 of the values of a table, column by column: numbers as float64, others as text."""
    digest = hashlib.sha256()
    for name in table.columns:
        column = table[name]
        digest.update(f"{name}\n".encode())
        if pd.api.types.is_numeric_dtype(column.dtype):
            digest.update(column.to_numpy().astype(np.dtype("<f8")).tobytes())
        else:
            digest.update("\n".join(column.astype(str)).encode())
    return digest.hexdigest()


def kept() -> dict[str, Hashes]:
    """What the examples gave when this was last written, by name."""
    found: dict[str, Hashes] = json.loads(KEPT.read_text(encoding="utf-8"))
    return found


def worked_out(wanted: list[str]) -> dict[str, Hashes]:
    """What these examples give now, by name."""
    return {
        name: hashes_of(finished(simulation_of(config, tables)))
        for name, config, tables in simulations()
        if name in wanted
    }


def finished(simulation: Simulation) -> Result:
    """Go on to the end."""
    simulation.advance(simulation.settings.duration)
    return simulation.result()


if __name__ == "__main__":
    if sys.argv[1:]:
        sys.stdout.write(json.dumps(worked_out(sys.argv[1:])))
    else:
        with replace_when_complete(KEPT) as temporary:
            text = json.dumps(worked_out(names()), indent=2)
            temporary.write_text(f"{text}\n", encoding="utf-8")

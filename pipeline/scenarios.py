"""Scenarios of a study: lists of edits over one base, resolved to configurations of runs."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pipeline.config import Config
from pipeline.config_file import config_of, keys_of_lists
from pipeline.config_keys import Reading
from pipeline.edits_config_study import StudyEdit
from pipeline.yaml_source import put_value
from uxsim_geo.errors import Faults

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network

#: the scenario without edits
BASE = "base"


@dataclass(frozen=True)
class Tables:
    """Network and demand as the stage ingest leaves them."""

    network: Network
    demand: Demand


@dataclass(frozen=True)
class Scenario:
    """A scenario that is ready to run.

    config
        with its table edits under ``edits`` and all others in their place; its name is that of the
        base with that of the scenario behind it
    tables
        with the edits made; those of the base, the same objects, where it changes none; None: it
        changes ``ingest`` and must be read anew
    changes
        what it changes: scenario, element (link, node, turn, demand, control, setting), id,
        attribute, before, after, edit (its place in the study file), line
    cut_off
        pairs of the demand that had a way in the base and have none: origin, destination, vehicles
    """

    name: str
    config: Config
    tables: Tables | None
    changes: pd.DataFrame
    cut_off: pd.DataFrame


def read_scenarios(reading: Reading, place: str = "scenarios") -> dict[str, tuple[StudyEdit, ...]]:
    """Interim: edits `simulate` and `config` alone."""
    told: Any = reading.document.values.get(place) or {}
    return {
        name: tuple(StudyEdit.model_validate(edit, context=reading) for edit in edits or [])
        for name, edits in told.items()
    }


def resolve(
    base: Reading,
    study: Reading,
    scenarios: Mapping[str, tuple[StudyEdit, ...]],
    tables: Tables,
) -> dict[str, Scenario]:
    """Interim: edits `simulate` and `config` alone."""
    import pandas as pd

    first = config_of(Reading(deepcopy(base.document), base.folder))
    found = {BASE: Scenario(BASE, first, tables, pd.DataFrame(), pd.DataFrame())}
    for name, edits in scenarios.items():
        document = deepcopy(base.document)
        faults = Faults(study.document.source)
        for edit in edits:
            changes = {f"simulate.{key}": value for key, value in (edit.simulate or {}).items()}
            for dotted, value in (changes | (edit.config or {})).items():
                put_value(document, dotted.split("."), value, faults, keys_of_lists())
        faults.raise_if_any()
        document.values["name"] = f"{first.name}_{name}"
        config = config_of(Reading(document, base.folder))
        same = config.ingest == first.ingest
        found[name] = Scenario(
            name, config, tables if same else None, pd.DataFrame(), pd.DataFrame()
        )
    return found

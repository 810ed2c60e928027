"""Scenarios of a study: lists of edits over one base, resolved to configurations of runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipeline.config import Config
from pipeline.config_keys import Reading
from pipeline.edits_config_study import StudyEdit

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
    """Read the lists of edits of a study file, by the names of the scenarios.

    ``reading``: the study file as read_yaml gives it, and its folder. Raises
    :class:`uxsim_geo.errors.InputError` with the faults of all scenarios, each at its line.
    """
    raise NotImplementedError


def resolve(
    base: Reading,
    study: Reading,
    scenarios: Mapping[str, tuple[StudyEdit, ...]],
    tables: Tables,
) -> dict[str, Scenario]:
    """Resolve all scenarios of a study against its base; the first is ``base`` itself.

    ``base``: as :func:`pipeline.config_file.read_config` gives it, with what the study sets;
    ``study``: as given to :func:`read_scenarios`, which knows the lines; ``tables``: of the base.

    Raises :class:`uxsim_geo.errors.InputError` with the faults of all scenarios at once, each at
    the line of the study (or base) file: names that are not known, circles of build_on, edits that
    choose nothing or contradict one another, what the configuration and the engine would refuse.
    """
    raise NotImplementedError

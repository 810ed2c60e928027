"""Scenarios of a study: lists of edits over one base, resolved to configurations of runs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pipeline.config import Config
from pipeline.config_file import At, config_of, validated
from pipeline.config_keys import Reading
from pipeline.control_config_faults import as_written
from pipeline.edits import EDITS, Edited, PlacedEdit, apply_edits
from pipeline.edits_config_study import StudyEdit
from pipeline.scenario_control import ControlEdits
from pipeline.scenario_names import Composition, StudyPlace
from pipeline.scenario_settings import with_settings
from pipeline.yaml_source import Place, place_in_words
from uxsim_geo.errors import Fault, InputError, told_in_part

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network

#: the scenario without edits
BASE = "base"

_NAME = re.compile(r"\w[\w.-]*")


@dataclass(frozen=True)
class Tables:
    """Network and demand: as they were read, or with edits made."""

    network: Network
    demand: Demand


@dataclass(frozen=True)
class Scenario:
    """A scenario that is ready to run.

    config
        with its table edits under ``edits`` and all others in their place; its name is that of the
        base with that of the scenario behind it
    edits
        what it consists of, in the order in which it is made, and where it stands in the study
    tables
        with the edits made; None: it changes ``ingest`` and must be read anew
    changes
        of the tables, as :class:`pipeline.edits.Edited` has them; edit is the position in
        ``config.edits``
    cut_off
        pairs of the demand without any way: origin, destination, vehicles, had_way (in the base)
    """

    name: str
    config: Config
    edits: Sequence[StudyPlace]
    tables: Tables | None
    changes: pd.DataFrame
    cut_off: pd.DataFrame


def read_scenarios(
    study: Reading, place: Place = ("scenarios",)
) -> dict[str, tuple[StudyEdit, ...]]:
    """Read the lists of edits of a study file, by the names of the scenarios.

    ``study``: the study file as :func:`pipeline.yaml_source.read_yaml` gives it, and its folder.
    Raises :class:`uxsim_geo.errors.InputError` with the faults of all scenarios, each at its line.
    """
    faults: list[Fault] = []
    values: object = study.document.values
    for part in place:
        values = values.get(part) if isinstance(values, dict) else None
    if not isinstance(values, dict) or not values:
        what = "must be a section: the name of each scenario, and its list of edits"
        raise InputError([Fault(f"{place_in_words(place)}: {what}", *study.document.origin(place))])
    scenarios = {
        name: _read_edits(edits, (*place, name), study, faults) for name, edits in values.items()
    }
    if not faults:
        faults += Composition(scenarios, study, place).faults()
    if faults:
        raise InputError(told_in_part(sorted(faults, key=lambda fault: fault.line or 0)))
    return scenarios


def _read_edits(
    values: object, place: Place, study: Reading, faults: list[Fault]
) -> tuple[StudyEdit, ...]:
    """Read the edits of a scenario; what is wrong is noted."""
    name, origin = str(place[-1]), study.document.origin(place)
    what = None
    if not _NAME.fullmatch(name):
        what = "a scenario's name consists of letters, digits, _ - and ."
    elif name == BASE:
        what = "is the name of the scenario without edits; choose another"
    elif not isinstance(values, list):
        what = "must be a list of edits, each an item of its own (- close: ...)"
    if what:
        faults.append(Fault(f"{place_in_words(place)}: {what}", *origin))
        return ()
    assert isinstance(values, list)
    read = (
        validated(StudyEdit, one, study, faults, At((*place, number), StudyEdit, len(place) + 1))
        for number, one in enumerate(values)
    )
    return tuple(edit for edit in read if edit is not None)


def resolve(
    base: Reading,
    study: Reading,
    scenarios: Mapping[str, tuple[StudyEdit, ...]],
    tables: Tables,
    place: Place = ("scenarios",),
) -> dict[str, Scenario]:
    """Resolve all scenarios of a study against its base; the first is ``base`` itself.

    ``base``: as :func:`pipeline.config_file.read_config` gives it, with what the study sets;
    ``study`` and ``place``: as given to :func:`read_scenarios`; ``tables``: of the base, as
    :func:`pipeline.ingest.read_sources` gives them.

    Raises :class:`uxsim_geo.errors.InputError` with the faults of all scenarios at once, each at
    the line of the study (or base) file: edits that choose nothing or contradict one another, what
    the configuration and the engine would refuse.
    """
    resolver = _Resolver(base, study, tables, config_of(_copy(base, study)))
    composition = Composition(scenarios, study, place)
    found: dict[str, Scenario] = {}
    faults: dict[str, Fault] = {}
    for name in (BASE, *scenarios):
        try:
            edits = [] if name == BASE else composition.edits_of(name)
            found[name] = resolver.scenario(name, edits)
        except InputError as error:
            # edits that several scenarios build on are at fault once
            faults |= {str(fault): fault for fault in error.faults if str(fault) not in faults}
    if faults:
        raise InputError(faults.values())
    return found


def _copy(base: Reading, study: Reading) -> Reading:
    return with_settings(base, (), study, [])


@dataclass(frozen=True)
class _Resolver:
    """What all scenarios of a study are resolved with."""

    base: Reading
    study: Reading
    tables: Tables
    config: Config

    def scenario(self, name: str, edits: Sequence[StudyPlace]) -> Scenario:
        """Resolve one; raises :class:`uxsim_geo.errors.InputError` with all its faults."""
        faults: list[Fault] = []
        reading = with_settings(self.base, edits, self.study, faults)
        try:
            config = config_of(reading)
        except InputError as error:
            raise InputError([*faults, *error.faults]) from None
        own = config.ingest != self.config.ingest
        edited = self._edited(config, edits, faults, own_tables=own)
        control = ControlEdits.of(config, edited.network, self.study)
        for placed in edits:
            control.make(placed)
        faults += control.faults
        if faults:
            raise InputError(faults)
        control.into(reading.document)
        self._put_edits(reading, edits)
        if name != BASE:
            reading.document.values["name"] = f"{self.config.name}_{name}"
        config = config_of(reading)
        if not own:
            _check(config, edited, name)
        return self._ready(name, edits, config, None if own else edited)

    def _edited(
        self,
        config: Config,
        edits: Sequence[StudyPlace],
        faults: list[Fault],
        *,
        own_tables: bool,
    ) -> Edited:
        """Make the edits of tables; the tables as they are where these are of other files."""
        import pandas as pd

        nothing = Edited(self.tables.network, self.tables.demand, pd.DataFrame())
        if own_tables:
            return nothing
        placed = [
            PlacedEdit(edit, (*EDITS, number), config.origin)
            for number, edit in enumerate(config.edits)
        ]
        placed += [
            PlacedEdit(edit, one.place, self.study.document.origin)
            for one in edits
            if (edit := one.edit.table_edit()) is not None
        ]
        try:
            return apply_edits(self.tables.network, self.tables.demand, placed)
        except InputError as error:
            faults += error.faults
        return nothing

    def _put_edits(self, reading: Reading, edits: Sequence[StudyPlace]) -> None:
        """Write the edits of tables into the document of the configuration."""
        document = reading.document
        written = document.values.get("edits")
        values: list[object] = list(written) if isinstance(written, list) else []
        for one in edits:
            if (edit := one.edit.table_edit()) is not None:
                document.take_origins(self.study.document, one.place, (*EDITS, len(values)))
                values.append(edit)
        document.values["edits"] = values

    def _ready(
        self, name: str, edits: Sequence[StudyPlace], config: Config, edited: Edited | None
    ) -> Scenario:
        import pandas as pd

        from uxsim_geo.scenario.cut_off import cut_off_pairs

        if edited is None:
            return Scenario(name, config, edits, None, pd.DataFrame(), pd.DataFrame())
        network, demand = edited.network, edited.demand
        closed = closed_links(config, network)
        lost = cut_off_pairs(self.tables.network, network, demand, closed)
        tables = Tables(network, demand)
        return Scenario(name, config, edits, tables, edited.changes, lost)


def _check(config: Config, edited: Edited, name: str) -> None:
    """See that the engine would take the tables and the control, as far as no run is needed."""
    from uxsim_geo.engine.setting import set_up

    section = config.simulate
    measures = [entry.measure() for _, _, entry in section.control.entries()]
    classes = [entry.driver_class() for entry in section.classes]
    try:
        set_up(edited.network, edited.demand, section.settings(), measures, classes)
    except InputError as error:
        told = as_written(error.faults, section)
        found = [replace(fault, what=f"scenario {name}: {fault.what}") for fault in told]
        raise InputError(found) from None


def closed_links(config: Config, network: Network) -> set[str]:
    """Return the links that nobody may ever enter."""
    from uxsim_geo.network.selection import select_links

    closed: set[str] = set()
    for entry in config.simulate.control.closures:
        always = entry.begin_s <= 0 and entry.end >= config.simulate.duration_s
        if always and not entry.classes:
            rows = select_links(network, entry.target())
            closed |= set(network.links["link_id"].iloc[rows].astype(str))
    return closed

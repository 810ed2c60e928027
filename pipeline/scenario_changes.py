"""Everything that a scenario changes, one row an attribute: tables, control and settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from pipeline.config import Config
from pipeline.config_keys import ChosenLinks, Period, Section
from pipeline.control_config_flow import SignalEntry
from pipeline.edits import EDITS
from pipeline.scenario_names import StudyPlace
from pipeline.scenarios import Scenario, Tables
from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.network.network import Network

#: columns of the table; ``line`` is null for an edit of the base
COLUMNS = ("line", "edit", "element", "id", "attribute", "before", "after")

#: attributes of links as people read them: their name with the unit, and its factor
PEOPLES = {
    "length": ("length_m", 1.0),
    "free_speed": ("free_speed_kmh", KMH),
    "jam_density": ("jam_density_vpkm", PER_KM),
    "capacity": ("capacity_vph", PER_HOUR),
}

#: attribute of links that a closure keeps everybody, or some, from
CLOSED = "closed"

Row = tuple[int | None, str, str, str, str, str | None, str | None]


def all_changes(scenario: Scenario, base: Scenario, read: Tables) -> pd.DataFrame:
    """Return what a scenario changes of its base, in the order of its edits.

    ``read``: the tables of the base, for scenarios that have none yet. Columns :data:`COLUMNS`; the
    edit is its key, the element link, node, turn, demand, control or setting; numbers are in the
    units that their names say.
    """
    import pandas as pd

    tables = scenario.tables or base.tables or read
    rows = list(_of_tables(scenario))
    for placed in scenario.edits:
        rows += _of_control(placed, tables.network)
        rows += _of_settings(placed, scenario.config, base.config)
    table = pd.DataFrame(rows, columns=list(COLUMNS)).astype({"line": "Int64"})
    return table.sort_values("line", kind="stable", na_position="first").reset_index(drop=True)


def _of_tables(scenario: Scenario) -> Iterator[Row]:
    config = scenario.config
    for change in scenario.changes.to_dict("records"):
        number = int(change["edit"])
        key = config.edits[number].only()[0]
        _, line = config.origin((*EDITS, number))
        if key == "remove_signals":  # told with those of control
            continue
        name, factor = PEOPLES.get(change["attribute"], (change["attribute"], 1.0))
        before, after = (_scaled(change[when], factor) for when in ("before", "after"))
        yield (line, key, change["element"], change["id"], name, before, after)


def _scaled(value: Any, factor: float) -> str | None:
    if not isinstance(value, str):
        return None
    return value if factor == 1.0 else f"{float(value) * factor:.6g}"


def _of_control(placed: StudyPlace, network: Network) -> Iterator[Row]:
    """Yield what an edit of control does, link by link where it is one of links."""
    key, value = placed.edit.only()
    line = placed.line
    if key in ("close", "reopen"):
        what = f"lanes_{CLOSED}" if getattr(value, "lanes", None) else CLOSED
        told = _when(value)
        before, after = (None, told) if key == "close" else (told, None)
        yield from _by_link(value, network, (line, key), (what, before, after))
    elif key == "incident":
        told = f"{value.lanes_closed}, {_when(value)}"
        yield from _by_link(value, network, (line, key), (f"lanes_{CLOSED}", None, told))
    elif key == "control":
        for kind, _, entry in value.entries():
            if isinstance(entry, ChosenLinks):
                yield from _by_link(entry, network, (line, key), (kind, None, _words(entry)))
            else:
                yield (line, key, "control", kind, kind, None, _words(entry))
    elif key in ("signal", "remove_signals"):
        yield from _of_signals(value, (line, key))


def _of_signals(value: Any, edit: tuple[int | None, str]) -> Iterator[Row]:
    if edit[1] == "signal":
        for entry in value:
            yield (*edit, "node", entry.node_id, "signal", None, _plan(entry))
    else:
        for node in value.nodes:
            yield (*edit, "node", node, "signal", "yes", None)


def _plan(entry: SignalEntry) -> str:
    """A signal's plan in short: how long each phase is green, and which links have it."""
    phases = "; ".join(f"{phase.duration_s:g} s {', '.join(phase.links)}" for phase in entry.phases)
    cycle = entry.measure().cycle
    return f"{_when(entry)}, cycle {cycle:g} s: {phases}"


def _by_link(
    section: ChosenLinks,
    network: Network,
    edit: tuple[int | None, str],
    told: tuple[str, str | None, str | None],
) -> Iterator[Row]:
    from uxsim_geo.network.selection import select_links

    rows = select_links(network, section.target())
    for link_id in network.links["link_id"].iloc[rows].astype(str):
        yield (*edit, "link", link_id, *told)


def _of_settings(placed: StudyPlace, config: Config, base: Config) -> Iterator[Row]:
    key, values = placed.edit.only()
    if key not in ("simulate", "config"):
        return
    above = "simulate." if key == "simulate" else ""
    for own in values:
        dotted = f"{above}{own}"
        told = (_value_at(one, dotted.split(".")) for one in (base, config))
        before, after = told
        yield (placed.line, key, "setting", dotted, dotted, before, after)


def _value_at(value: Any, keys: Sequence[str]) -> str | None:
    """What a configuration says under some keys, as text; None: nothing."""
    for key in keys:
        if isinstance(value, Section):
            fields = type(value).model_fields
            names = {field.alias or name: name for name, field in fields.items()}
            value = getattr(value, names.get(key, key), None)
        elif isinstance(value, tuple) and key.isdecimal() and int(key) < len(value):
            value = value[int(key)]
        elif isinstance(value, tuple) and len(value) == 1:
            value = getattr(value[0], key, None)
        else:
            return None
    if isinstance(value, tuple) and any(isinstance(one, Section) for one in value):
        return "; ".join(_words(one) for one in value)
    return None if value is None else _words(value) if isinstance(value, Section) else str(value)


def _when(period: Period) -> str:
    """``always``, or from when to when, s."""
    end = "" if period.end_s is None else f" to {period.end_s:g}"
    if not period.begin_s and not end:
        return "always"
    return f"from {period.begin_s:g}{end} s"


def _words(section: Section) -> str:
    """Keys of a section with their values, but for the links that it chooses."""
    told = section.model_dump(by_alias=True, exclude_defaults=True, mode="json")
    chosen = ChosenLinks.model_fields
    return ", ".join(f"{key} {value}" for key, value in told.items() if key not in chosen)

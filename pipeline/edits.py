"""Edits of a configuration made on tables, with faults and conflicts at the lines of the edits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pipeline.config import Config
from pipeline.edits_config import TableEdit
from pipeline.yaml_source import Place, place_in_words
from uxsim_geo.errors import Fault, InputError, told_in_part
from uxsim_geo.network.rows import count

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network
    from uxsim_geo.network.notes import Notes

    #: tables with an edit made, and what it changes
    NetworkEdited = tuple[Network, pd.DataFrame]
    DemandEdited = tuple[Demand, pd.DataFrame]

#: where a configuration holds its edits
EDITS: Place = ("edits",)

Origin = tuple[str, int | None]


@dataclass(frozen=True)
class PlacedEdit:
    """An edit and where it stands: its place, and source and line of every place below."""

    edit: TableEdit
    place: Place
    origin: Callable[[Place], Origin]

    def fault(self, what: str, keys: Place = (), value: object = None) -> Fault:
        """Return a fault of the edit, or of one of its keys."""
        place = (*self.place, self.edit.only()[0], *keys)
        return Fault(f"{place_in_words(place)}: {what}", *self.origin(place), None, value)

    def __str__(self) -> str:
        source, line = self.origin(self.place)
        words = place_in_words((*self.place, self.edit.only()[0]))
        return f"{words} (line {line})" if line else f"{words} ({source})" if source else words


@dataclass(frozen=True)
class Edited:
    """Tables with edits made; ``changes`` as of the library, with the number of the edit in front.

    ``gone``: links taken out; ``unsignalled``: nodes without their signals.
    """

    network: Network
    demand: Demand
    changes: pd.DataFrame
    gone: tuple[str, ...] = ()
    unsignalled: tuple[str, ...] = ()


@dataclass
class _Work:
    """Tables on which one edit after the other is made."""

    network: Network
    demand: Demand
    demand_edits: int = 0
    changes: list[pd.DataFrame] = field(default_factory=list)
    gone: dict[str, PlacedEdit] = field(default_factory=dict)
    unsignalled: list[str] = field(default_factory=list)
    owners: dict[tuple[str, str, str], tuple[PlacedEdit, str | None]] = field(default_factory=dict)


def placed_edits(config: Config) -> list[PlacedEdit]:
    """Return the edits of a configuration, which knows the lines of all of them."""
    return [
        PlacedEdit(edit, (*EDITS, number), config.origin)
        for number, edit in enumerate(config.edits)
    ]


def notes_of(edits: Sequence[PlacedEdit], changes: pd.DataFrame) -> Notes:
    """Say of every edit how much it changed."""
    from uxsim_geo.network.notes import Notes

    notes = Notes()
    for number, placed in enumerate(edits):
        own = changes[changes["edit"] == number]
        counts = own.groupby(["element", "attribute"], sort=False)["id"].nunique()
        told = [
            f"{key[1]} of {count(n, key[0])}" for key, n in zip(counts.index, counts, strict=True)
        ]
        what = f"edit {number + 1}, {placed.edit.only()[0]}: {', '.join(told) or 'no change'}"
        notes.add("edits", what)
    return notes


def apply_edits(network: Network, demand: Demand, edits: Sequence[PlacedEdit]) -> Edited:
    """Make edits one after the other.

    An edit that is at fault is left out, so that those behind it are looked at, too. Raises
    :class:`uxsim_geo.errors.InputError` with the faults of all: what is not there, what chooses
    nothing, what contradicts an edit before, and what cannot be simulated afterwards.
    """
    import pandas as pd

    from uxsim_geo.demand.check import check_demand
    from uxsim_geo.network.check import check_network
    from uxsim_geo.scenario.links_removed import without_routes_over

    work, faults = _Work(network, demand), []
    for number, placed in enumerate(edits):
        try:
            changes = _make(work, placed)
        except InputError as error:
            faults += [_told(fault, placed, work) for fault in error.faults]
            continue
        faults += _conflicts(work, placed, changes)
        work.changes.append(changes.assign(edit=number))
    if work.gone:
        work.demand, changes = without_routes_over(work.demand, work.gone)
        work.changes.append(changes.assign(edit=_last_removal(edits)))
    if faults:
        raise InputError(told_in_part(faults))
    if edits:
        check_network(work.network)
        check_demand(work.demand, work.network)
    made = [table for table in work.changes if len(table)]
    columns = ["element", "id", "attribute", "before", "after", "edit"]
    table = pd.concat(made, ignore_index=True) if made else pd.DataFrame(columns=columns)
    gone, unsignalled = tuple(work.gone), tuple(work.unsignalled)
    return Edited(work.network, work.demand, table, gone, unsignalled)


def _last_removal(edits: Sequence[PlacedEdit]) -> int:
    return max(n for n, placed in enumerate(edits) if placed.edit.remove_links is not None)


def _make(work: _Work, placed: PlacedEdit) -> pd.DataFrame:
    """Make one edit; return the changes."""
    key, section = placed.edit.only()
    if key in _OF_NETWORK:
        work.network, changes = _OF_NETWORK[key](work.network, section)
        if key == "remove_links":
            names = changes.loc[changes["element"] == "link", "id"]
            work.gone |= dict.fromkeys(names, placed)
        if key == "remove_signals":
            work.unsignalled += section.nodes
        return changes
    # its number is that of the draws, which must not depend on other edits being at fault
    work.demand_edits += 1
    work.demand, changes = _OF_DEMAND[key](work, section)
    return changes


def _told(fault: Fault, placed: PlacedEdit, work: _Work) -> Fault:
    """Tell what the library finds wrong by the keys and lines of the edit."""
    _, section = placed.edit.only()
    known = {key.alias or name for name, key in type(section).model_fields.items()}
    column = _KEYS.get(str(fault.column), str(fault.column))
    keys: Place = (column,) if column in known else ()
    what = fault.what
    if fault.source and fault.source != "where":
        what = f"{fault.source}: {what}"
    if isinstance(fault.value, str) and fault.value in work.gone:
        what = f"the link is taken out by {work.gone[fault.value]}"
    return placed.fault(what, keys, fault.value)


#: keys by the names of the library, where they differ
_KEYS = {
    "part": "polygon_part",
    "between": "between_s",
    "origin_area": "origin_polygon",
    "destination_area": "destination_polygon",
}


def _conflicts(work: _Work, placed: PlacedEdit, changes: pd.DataFrame) -> Iterator[Fault]:
    """Yield a fault for every edit before that this one contradicts, and note whose changes are."""
    key, _ = placed.edit.only()
    against: dict[str, tuple[PlacedEdit, list[str], str]] = {}
    for change in changes.itertuples(index=False):
        whose = (str(change.element), str(change.id), str(change.attribute))
        after = change.after if isinstance(change.after, str) else None
        if whose in work.owners and key in _SETS and whose[0] != "demand":
            earlier, _ = work.owners[whose]
            _, ids, _ = against.setdefault(f"{earlier} {whose[2]}", (earlier, [], whose[2]))
            ids.append(whose[1])
        work.owners[whose] = (placed, after)
    for earlier, ids, attribute in against.values():
        more = f" and {len(ids) - 5} more" if len(ids) > 5 else ""
        what = f"contradicts {earlier}: both change {attribute} of {', '.join(ids[:5])}{more}"
        yield placed.fault(f"{what}; keep one, or choose other links")


#: edits that leave nothing of what one before made of the same; others multiply it or add to it
_SETS = ("set", "ban_turn", "allow_turn", "add_link", "add_node")


def _set(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.link_attributes import set_attributes

    return set_attributes(network, section.target(), section.values())


def _scale(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.link_attributes import scale_attributes

    return scale_attributes(network, section.target(), section.factors())


def _add(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.link_attributes import add_lanes

    return add_lanes(network, section.target(), section.lanes)


def _add_link(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.links_added import NewLink, add_link

    link = NewLink(
        section.id,
        section.from_node,
        section.to_node,
        section.along,
        section.values(),
        section.both_ways,
    )
    return add_link(network, link)


def _remove_links(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.links_removed import remove_links

    return remove_links(network, section.target())


def _add_node(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.nodes_added import add_node

    return add_node(network, section.id, (section.x, section.y), section.crs)


def _ban_turn(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.turns import ban_turn

    return ban_turn(network, section.way())


def _allow_turn(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.turns import allow_turn

    return allow_turn(network, section.way())


def _remove_signals(network: Network, section: Any) -> NetworkEdited:
    from uxsim_geo.scenario.nodes_added import remove_signals

    return remove_signals(network, section.nodes)


def _scale_demand(work: _Work, section: Any) -> DemandEdited:
    from uxsim_geo.scenario.demand import scale_demand

    chosen = section.trips().rows(work.demand, work.network)
    return scale_demand(work.demand, chosen, section.factor, work.demand_edits)


def _shift_demand(work: _Work, section: Any) -> DemandEdited:
    from uxsim_geo.scenario.demand import shift_demand

    chosen = section.trips().rows(work.demand, work.network)
    return shift_demand(work.demand, chosen, section.by_s, section.share, work.demand_edits)


def _replace_demand(work: _Work, section: Any) -> DemandEdited:
    from pipeline.demand_sources import read_demand_entries
    from uxsim_geo.scenario.demand import replace_demand

    chosen = section.trips().rows(work.demand, work.network)
    rows = None
    if section.source is not None:
        rows = read_demand_entries((section.source,), work.network)[0].table
    return replace_demand(work.demand, chosen, rows, work.demand_edits)


#: one function a key
_OF_NETWORK: dict[str, Callable[[Network, Any], NetworkEdited]] = {
    "set": _set,
    "scale": _scale,
    "add": _add,
    "add_link": _add_link,
    "remove_links": _remove_links,
    "add_node": _add_node,
    "ban_turn": _ban_turn,
    "allow_turn": _allow_turn,
    "remove_signals": _remove_signals,
}
_OF_DEMAND: dict[str, Callable[[_Work, Any], DemandEdited]] = {
    "scale_demand": _scale_demand,
    "shift_demand": _shift_demand,
    "replace_demand": _replace_demand,
}

"""Edits of control: measures of a base with others added, taken out, or in other times."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pipeline.config import Config
from pipeline.config_keys import ChosenLinks, Period, Reading
from pipeline.control_config import ControlSection, MeasureEntry
from pipeline.control_config_faults import CONTROL
from pipeline.control_config_flow import ClosureEntry, IncidentEntry, SignalEntry
from pipeline.edits_config_study import CloseEdit, ReopenEdit
from pipeline.scenario_names import StudyPlace
from pipeline.yaml_source import Place, YamlSource, place_in_words
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    from uxsim_geo.network.network import Network

#: the kinds of measures that an edit reopen may end
CLOSING = ("closures", "incidents")


@dataclass(frozen=True)
class PlacedMeasure:
    """A measure, and the document and place where it is written."""

    kind: str
    entry: MeasureEntry
    document: YamlSource | None
    place: Place


@dataclass
class ControlEdits:
    """Measures of a configuration, changed by one edit after the other."""

    network: Network
    study: Reading
    measures: list[PlacedMeasure] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)

    @classmethod
    def of(cls, config: Config, network: Network, study: Reading) -> ControlEdits:
        """Start with the measures of a configuration."""
        section = config.simulate.control
        measures = [
            PlacedMeasure(kind, entry, section.document, (*CONTROL, kind, number))
            for kind, number, entry in section.entries()
        ]
        return cls(network, study, measures)

    def make(self, placed: StudyPlace) -> None:
        """Make an edit, if it is one of control; what is wrong with it is noted."""
        key, value = placed.edit.only()
        place = (*placed.place, key)
        if isinstance(value, CloseEdit | IncidentEntry):
            if self._links(value, place):
                self._add(*_closing(value), place)
        elif isinstance(value, ControlSection):
            for kind, number, entry in value.entries():
                self._add(kind, entry, (*place, kind, number))
        elif isinstance(value, ReopenEdit):
            self._reopen(value, place)
        elif key == "signal":
            self._drop_signals({entry.node_id for entry in value})
            for number, entry in enumerate(value):
                at = self.study.document.as_written((*place, number))
                self._add("signals", entry, at)
        elif key == "remove_signals":
            self._remove_signals(value.nodes, place)

    def into(self, document: YamlSource) -> None:
        """Put the measures into the document of a configuration, each with where it is written."""
        document.forget_origins(CONTROL)
        values: dict[str, list[MeasureEntry]] = {}
        for kind in ControlSection.model_fields:
            own = [measure for measure in self.measures if measure.kind == kind]
            for number, measure in enumerate(own):
                values.setdefault(kind, []).append(measure.entry)
                if measure.document is not None:
                    place = (*CONTROL, kind, number)
                    document.take_origins(measure.document, measure.place, place)
        document.values["simulate"]["control"] = values  # type: ignore[index]

    def _add(self, kind: str, entry: MeasureEntry, place: Place) -> None:
        self.measures.append(PlacedMeasure(kind, entry, self.study.document, place))

    def _fault(self, what: str, place: Place, value: object = None) -> None:
        origin = self.study.document.origin(place)
        self.faults.append(Fault(f"{place_in_words(place)}: {what}", *origin, None, value))

    def _drop_signals(self, nodes: set[str]) -> None:
        self.measures = [
            one
            for one in self.measures
            if not (isinstance(one.entry, SignalEntry) and one.entry.node_id in nodes)
        ]

    def _remove_signals(self, nodes: Sequence[str], place: Place) -> None:
        """Drop the signals of nodes; those of the network are dropped from its tables."""
        own = {one.entry.node_id for one in self.measures if isinstance(one.entry, SignalEntry)}
        table = self.network.nodes
        signalled = (
            set(table.loc[table["control"] == "signal", "node_id"]) if "control" in table else set()
        )
        known = set(table["node_id"].astype(str))
        for number, node in enumerate(nodes):
            if node in known - own - signalled:
                self._fault("this node has no signal", (*place, "nodes", number), node)
        self._drop_signals(set(nodes))

    def _reopen(self, section: ReopenEdit, place: Place) -> None:
        chosen = self._links(section, place)
        if chosen is None:
            return
        found, kept = False, []
        for measure in self.measures:
            closed = None
            if measure.kind in CLOSING and isinstance(measure.entry, ClosureEntry | IncidentEntry):
                closed = self._links(measure.entry, None)
            both = [link_id for link_id in closed or () if link_id in chosen]
            if not both or not _meet(measure.entry, section):
                kept.append(measure)
                continue
            found = True
            assert closed is not None
            kept += _parts(measure, [one for one in closed if one not in chosen], both, section)
        if not found:
            self._fault("none of these links is closed then: there is nothing to reopen", place)
        self.measures = kept

    def _links(self, section: ChosenLinks, place: Place | None) -> dict[str, None] | None:
        """Return the ids of chosen links; None where there are none, with faults of a place."""
        from uxsim_geo.network.selection import select_links

        try:
            rows = select_links(self.network, section.target())
        except InputError as error:
            for fault in error.faults if place is not None else ():
                keys = (str(fault.column),) if fault.column in ChosenLinks.model_fields else ()
                self._fault(fault.what, (*(place or ()), *keys), fault.value)
            return None
        if not len(rows) and place is not None:
            self._fault("no link of the network is meant", place, str(section.target()))
        ids = self.network.links["link_id"].iloc[rows].astype(str)
        return dict.fromkeys(ids) or None


def _closing(section: CloseEdit | IncidentEntry) -> tuple[str, MeasureEntry]:
    """Return the measure that closes links, or lanes of them, and its kind."""
    if isinstance(section, IncidentEntry):
        return "incidents", section
    names = (*ChosenLinks.model_fields, *Period.model_fields)
    told = {name: getattr(section, name) for name in names}
    if section.lanes is None:
        return "closures", ClosureEntry(**told, classes=section.classes)
    return "incidents", IncidentEntry(**told, lanes_closed=section.lanes)


def _meet(entry: Period | MeasureEntry, other: Period) -> bool:
    begin, end = entry.begin_s, entry.end
    return max(begin, other.begin_s) < min(end, other.end)


def _parts(
    measure: PlacedMeasure, apart: Sequence[str], both: Sequence[str], section: Period
) -> Iterator[PlacedMeasure]:
    """Yield a measure in pieces: of links that stay as they are, and before and after the time."""
    entry = measure.entry
    assert isinstance(entry, ClosureEntry | IncidentEntry)
    periods = [(apart, entry.begin_s, entry.end)]
    periods.append((both, entry.begin_s, section.begin_s))
    periods.append((both, section.end, entry.end))
    for links, begin, end in periods:
        if links and begin < end:
            told = {
                "links": tuple(links),
                "where": None,
                "polygon": None,
                "polygon_part": "touching",
                "street": None,
                "begin_s": begin,
                "end_s": None if end == math.inf else end,
            }
            own = entry.model_copy(update=told)
            yield PlacedMeasure(measure.kind, own, measure.document, measure.place)

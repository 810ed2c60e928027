"""Which edits a scenario consists of: its own, after those of the scenarios that it builds on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from pipeline.config_keys import Reading
from pipeline.edits_config_study import StudyEdit
from pipeline.yaml_source import Place, place_in_words
from uxsim_geo.errors import Fault, did_you_mean

#: keys of edits that name scenarios
NAMING = ("build_on", "require", "exclude")

Scenarios = Mapping[str, Sequence[StudyEdit]]


@dataclass(frozen=True)
class StudyPlace:
    """An edit of a study, and where it stands in the study file."""

    edit: StudyEdit
    place: Place
    line: int | None

    @property
    def key(self) -> str:
        """The key that the edit has."""
        return self.edit.only()[0]


@dataclass(frozen=True)
class Composition:
    """Scenarios of a study that build on one another; ``place``: where they stand in its file."""

    scenarios: Scenarios
    study: Reading
    place: Place

    def edits_of(self, name: str) -> list[StudyPlace]:
        """Return the edits of a scenario in the order in which they are made, each once."""
        found: list[StudyPlace] = []
        for member in self.members(name):
            for number, edit in enumerate(self.scenarios[member]):
                place = (*self.place, member, number)
                placed = StudyPlace(edit, place, self.study.document.origin(place)[1])
                if placed.key not in NAMING:
                    found.append(placed)
        return found

    def members(self, name: str) -> list[str]:
        """Return the scenarios whose edits a scenario has, itself the last."""
        order: list[str] = []
        self._visit(name, order, set())
        return order

    def faults(self) -> list[Fault]:
        """Return what is wrong with names: unknown, in circles, missing beside, or excluded."""
        faults = list(self._unknown())
        if faults:
            return faults
        faults = list(self._circles())
        return faults or [fault for name in self.scenarios for fault in self._unfit(name)]

    def _visit(self, name: str, order: list[str], seen: set[str]) -> None:
        if name in seen:
            return
        seen.add(name)
        for other, _ in self._named(name, "build_on"):
            self._visit(other, order, seen)
        order.append(name)

    def _named(self, name: str, key: str) -> Iterator[tuple[str, Place]]:
        """Yield the scenarios that one names under a key, and where."""
        for number, edit in enumerate(self.scenarios[name]):
            for position, other in enumerate(getattr(edit, key) or ()):
                place = (*self.place, name, number, key, position)
                yield other, self.study.document.as_written(place)

    def _fault(self, place: Place, what: str, value: object = None) -> Fault:
        return Fault(
            f"{place_in_words(place)}: {what}", *self.study.document.origin(place), None, value
        )

    def _unknown(self) -> Iterator[Fault]:
        for name in self.scenarios:
            for key in NAMING:
                for other, place in self._named(name, key):
                    if other == name:
                        yield self._fault(place, "names the scenario itself", other)
                    elif other not in self.scenarios:
                        advice = did_you_mean(other, self.scenarios)
                        known = advice or f"; there are {', '.join(self.scenarios)}"
                        yield self._fault(place, f"no such scenario{known}", other)

    def _circles(self) -> Iterator[Fault]:
        told: set[frozenset[str]] = set()
        for name in self.scenarios:
            circle = self._circle(name, (name,))
            if circle and frozenset(circle) not in told:
                told.add(frozenset(circle))
                place = next(at for other, at in self._named(name, "build_on") if other in circle)
                way = " on ".join([*circle, circle[0]])
                yield self._fault(place, f"a scenario cannot build on itself: {way}")

    def _circle(self, start: str, way: tuple[str, ...]) -> tuple[str, ...]:
        """Return a way over build_on that leads back to where it starts; none: there is none."""
        for other, _ in self._named(way[-1], "build_on"):
            if other == start:
                return way
            if other not in way and (found := self._circle(start, (*way, other))):
                return found
        return ()

    def _unfit(self, name: str) -> Iterator[Fault]:
        members = self.members(name)
        for member in members:
            whose = "" if member == name else f", on which {name} builds,"
            for other, place in self._named(member, "require"):
                if other not in members:
                    what = f"{member}{whose} requires {other}: let {name} build on it, too"
                    yield self._fault(place, what)
            for other, place in self._named(member, "exclude"):
                if other in members:
                    what = f"{member}{whose} excludes {other}, and {name} builds on it"
                    yield self._fault(place, what)

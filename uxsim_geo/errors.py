"""Faults in what a user gave us: collected while reading, raised all at once."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input, and where it stands.

    ``what`` says what is wrong and what to do about it. ``line`` counts from 1; ``column`` is a
    column's name or a character position; ``value`` is the offending text as it was found.
    """

    what: str
    source: str = ""
    line: int | None = None
    column: str | int | None = None
    value: object = None

    def __str__(self) -> str:
        place = self.source
        if self.line is not None:
            place += f":{self.line}" if place else f"line {self.line}"
        if self.column is not None:
            place += f", column {self.column}" if place else f"column {self.column}"
        found = "" if self.value is None else f" (found {_shorten(self.value)!r})"
        return f"{place}: {self.what}{found}" if place else f"{self.what}{found}"


class InputError(ValueError):
    """The input cannot be used; ``faults`` lists every reason found, in the order of the input."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = list(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


#: faults that are told in full where there are many: more than a reader can take in
MOST_FAULTS = 50


def told_in_part(faults: Sequence[Fault]) -> list[Fault]:
    """The first faults, and how many more there are, so that a message can be read."""
    more = len(faults) - MOST_FAULTS
    if more <= 0:
        return list(faults)
    return [*faults[:MOST_FAULTS], Fault(f"and {more:,} more faults", faults[MOST_FAULTS].source)]


@dataclass
class Faults:
    """Collects faults so that a reader can go on to the end before it gives up.

    At most ``limit`` faults are kept in full; the rest are counted, so that a file which is wrong
    in every row still gives a message that can be read.
    """

    source: str = ""
    limit: int = MOST_FAULTS
    found: list[Fault] = field(default_factory=list)
    more: int = 0

    def add(
        self,
        what: str,
        *,
        line: int | None = None,
        column: str | int | None = None,
        value: object = None,
    ) -> None:
        """Note one fault in this source."""
        if len(self.found) < self.limit:
            self.found.append(Fault(what, self.source, line, column, value))
        else:
            self.more += 1

    def extend(self, other: Faults) -> None:
        """Take over the faults of another source."""
        self.found.extend(other.found)
        self.more += other.more

    def add_of_entry(self, number: int, own: Faults) -> None:
        """Take over the faults of one entry of this source, whose number is their line."""
        for fault in own.found:
            self.add(fault.what, line=number, column=fault.column, value=fault.value)
        self.more += own.more

    def raise_if_any(self) -> None:
        """Raise :class:`InputError` with all that was found, or return."""
        if not self.found:
            return
        faults = list(self.found)
        if self.more:
            faults.append(Fault(f"and {self.more} more faults of the same kinds", self.source))
        raise InputError(faults)


def did_you_mean(name: str, known: Iterable[str], most: int = 3) -> str:
    """Return ``; did you mean a or b?`` of the names nearest to one, or nothing.

    Large and small letters count as the same.
    """
    # of names that differ in these alone the first stands for all
    folded = {one.casefold(): one for one in reversed(list(dict.fromkeys(known)))}
    near = difflib.get_close_matches(name.casefold(), folded, n=most)
    return f"; did you mean {' or '.join(sorted(folded[one] for one in near))}?" if near else ""


def _shorten(value: object, limit: int = 60) -> str:
    text = str(value)
    return text if len(text) <= limit else text[: limit - 1] + "…"

"""What a user must know before the figures of a run are believed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from uxsim_geo.network.note_words import (
    amount_in_words,
    notes_in_words,
    number_of,
    what_is_told,
)

if TYPE_CHECKING:
    import pandas as pd

#: share of the vehicles demanded; where more are aborted, the figures say little
MOST_ABORTED = 0.1

#: different notes of a topic that a line tells
NOTES_TOLD = 3

#: what can be summed over notes
SUMMED = ("km", "trips", "vehicles")


def warnings_in(notes: pd.DataFrame) -> list[str]:
    """Return a line for every topic of the notes that warns: what, how much, and why.

    What of a topic stands behind a colon (``dropped: no path``) is told in one line with the rest.
    """
    warned = notes[notes["severity"] == "warning"]
    topics = warned["topic"].map(lambda topic: str(topic).partition(":")[0])
    return [
        f"warning: {topic}{_how_much(found)}: {_what(found)}"
        for topic, found in warned.groupby(topics, sort=False)
    ]


def warning_of_aborted(figures: dict[str, Any]) -> str | None:
    """Return a line where so many vehicles found no way that the other figures say little."""
    aborted, demanded = figures["vehicles_aborted"], figures["vehicles_demanded"]
    if aborted <= MOST_ABORTED * demanded:
        return None
    return (
        f"warning: {aborted:,} of {demanded:,} vehicles ({aborted / demanded:.0%}) were aborted, "
        "for no path led to their destination: the figures are those of the others"
    )


def _how_much(found: pd.DataFrame) -> str:
    """How many notes there are, and the sum of what they count; nothing of a single one."""
    if len(found) < 2:
        return ""
    told = {what_is_told(note) for note in found["note"]}
    numbers = [number_of(value) for value in found["value"]]
    known = [number for number in numbers if number is not None]
    summed = len(told) == 1 and told <= set(SUMMED) and len(known) == len(numbers)
    amount = [f"{amount_in_words(sum(known), *told)} in all"] if summed else []
    return f" ({', '.join([f'{len(found):,} notes', *amount])})"


def _what(found: pd.DataFrame) -> str:
    """The different notes, the greatest first where they count something; how many more."""
    size = found["value"].map(lambda value: number_of(value) or 0.0)
    order = found.assign(size=size).sort_values("size", ascending=False, kind="stable")
    said = [
        notes_in_words(str(note), same["value"]) for note, same in order.groupby("note", sort=False)
    ]
    more = len(said) - NOTES_TOLD
    rest = [f"and {more:,} more in import_notes.html"] if more > 0 else []
    return "; ".join([*said[:NOTES_TOLD], *rest])

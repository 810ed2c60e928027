"""Notes on many elements: each with its place, or their number where they are too many to read."""

from __future__ import annotations

from collections.abc import Sequence

from uxsim_geo.network.note_words import note_in_words
from uxsim_geo.network.notes import Element, Notes

#: the same remark on more elements than this is one note with their number
MOST_SINGLE_NOTES = 1000


def note_places(
    notes: Notes,
    remark: tuple[str, str],
    ids: Sequence[str],
    *,
    element: Element = "link",
    values: Sequence[object] | None = None,
) -> None:
    """Note the same of every element in ``ids``, or once with their number.

    ``remark``: topic and note, which says where the value belongs
    (:mod:`uxsim_geo.network.note_words`).
    """
    topic, note = remark
    if len(ids) <= MOST_SINGLE_NOTES:
        notes.add_each(topic, note, ids, element=element, values=values)
        return
    many = f"{note_in_words(note)}; value: how many {element}s"
    notes.add(topic, many, element=element, value=len(ids))

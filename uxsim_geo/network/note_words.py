"""Notes in words: what a note says, and the figure that it is about, as one sentence.

A note is kept as a sentence and a value apart (:mod:`uxsim_geo.network.notes`), so that notes of
one kind can be counted and their values be reckoned with. The sentence says where the value
belongs, and what it is, in one of these ways:

- ``several speed limits (value): the lowest is used``: the value stands there as it is;
- ``the length (value, m) is that of the geometry``: so it does, as a number with its unit;
- ``links are left out; value: km``: the number and what it counts follow the sentence;
- ``; value: share of the links``: the number is a share, and is told in percent;
- ``; value: before, here, after``: the value is a text of several parts, and is told with these;
- no word of it: the value follows the sentence as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

#: where a sentence says that the value belongs, and what it is
_PLACE = re.compile(r" ?\(value(?:[,:] (?P<unit>[^)]*))?\)|; value: (?P<what>.*)$")

#: numbers from here on are told without decimals
LARGE = 1000


def note_in_words(note: str, value: object = None) -> str:
    """Return the sentence of a note with its value in it; without one, the sentence alone."""
    return notes_in_words(note, [value])


def notes_in_words(note: str, values: Iterable[object]) -> str:
    """Return the sentence of several notes that differ in their values alone.

    Of numbers the smallest and the largest are told, of texts the first.
    """
    found = _PLACE.search(note)
    told = _values_in_words([*dict.fromkeys(filter(None, map(_text, values)))], what_is_told(note))
    told = f" ({told})" if told else ""
    return note + told if found is None else note[: found.start()] + told + note[found.end() :]


def what_is_told(note: str) -> str:
    """Return what the sentence says that its value is: a unit, things counted; or nothing."""
    found = _PLACE.search(note)
    return "" if found is None else found["unit"] or found["what"] or ""


def amount_in_words(number: float, what: str) -> str:
    """Return a number with what it counts or measures, as :func:`what_is_told` has it."""
    if what.startswith("share"):
        return f"{percent(number)} {what.removeprefix('share').strip()}".strip()
    thing = what.removeprefix("how many").strip()
    return f"{number_in_words(number)} {_of_one(thing) if number == 1 else thing}".strip()


def number_in_words(number: float) -> str:
    """Return a number as people write it: large ones whole, others with four digits."""
    whole = abs(number) >= LARGE or number == round(number)
    return f"{number:,.0f}" if whole else f"{number:.4g}"


def percent(share: float) -> str:
    """A share with a decimal; never 100 or 0 where it is not whole, ``–`` where it is not known."""
    if share != share:
        return "–"
    shown = round(100.0 * share, 1)
    if shown == 100.0 and share < 1.0:
        return "> 99.9 %"
    return "< 0.1 %" if shown == 0.0 and share > 0.0 else f"{shown:.1f} %"


def number_of(value: object) -> float | None:
    """Return the value of a note as a number; None where it is none."""
    try:
        number = float(_text(value))
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _values_in_words(values: Sequence[str], what: str) -> str:
    numbers = [number for number in map(number_of, values) if number is not None]
    if not what or not numbers or len(numbers) < len(values):
        told = ", ".join([*values[:1], *(["..."] if len(values) > 1 else [])])
        return f"{told}: {what}" if told and ", " in what else told
    if len(numbers) == 1:
        return amount_in_words(numbers[0], what)
    least = (percent if what.startswith("share") else number_in_words)(min(numbers))
    return f"{least} to {amount_in_words(max(numbers), what)}"


def _of_one(things: str) -> str:
    """``links gone`` as ``link gone``; units stay as they are."""
    thing, blank, rest = things.partition(" ")
    plural = thing.isalpha() and thing.endswith("s") and len(thing) > len("ms")
    return (thing[:-1] if plural else thing) + blank + rest


def _text(value: object) -> str:
    """A value of the table of notes as text, nothing where it is missing."""
    if isinstance(value, str):
        return value
    return "" if value is None or str(value) in ("<NA>", "nan") else str(value)

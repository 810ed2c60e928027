"""Notes as sentences: the value stands where the note says, with its unit."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pandas as pd
import pytest

import uxsim_geo
from uxsim_geo.network.note_words import note_in_words, notes_in_words

LENGTH = "the length (value, m) is that of the geometry"
LOST = "no path leads there; value: trips"


@pytest.mark.parametrize(
    ("note", "value", "words"),
    [
        (
            "several limits (value): the lowest",
            "maxspeed=50;30",
            "several limits (maxspeed=50;30): the lowest",
        ),
        ("has conditions: relation (value)", "1234567", "has conditions: relation (1234567)"),
        (LENGTH, "12.3456", "the length (12.35 m) is that of the geometry"),
        (LENGTH, None, "the length is that of the geometry"),
        ("links left out; value: km", "1234.5678", "links left out (1,235 km)"),
        (LOST, "360600.0", "no path leads there (360,600 trips)"),
        (LOST, "1.0", "no path leads there (1 trip)"),
        (LOST, float("nan"), "no path leads there"),
        (LOST, pd.NA, "no path leads there"),
        ("the place (value) was taken", "nan", "the place (nan) was taken"),
        ("joined; value: how many nodes gone", "1", "joined (1 node gone)"),
        (
            "too many to list; value: how many",
            "12",
            "too many to list (12)",
        ),
        (
            "2 parts; value: share of the km in the greatest",
            "0.98765",
            "2 parts (98.8 % of the km in the greatest)",
        ),
        ("greatest change; value: s", "1", "greatest change (1 s)"),
        (
            "fewer lanes than around; value: before, here, after",
            "3-1-3 lanes",
            "fewer lanes than around (3-1-3 lanes: before, here, after)",
        ),
        (
            "a street ends before another; value: gap",
            "8.2 m to 7",
            "a street ends before another (8.2 m to 7)",
        ),
        ("recorded only", "right", "recorded only (right)"),
        ("recorded only", None, "recorded only"),
    ],
)
def test_a_note_says_its_value_with_its_unit(note: str, value: object, words: str) -> None:
    assert note_in_words(note, value) == words


@pytest.mark.parametrize(
    ("note", "values", "words"),
    [
        (LENGTH, ["7.5", "100", "12.25"], "the length (7.5 to 100 m) is that of the geometry"),
        (LOST, ["3", "3"], "no path leads there (3 trips)"),
        ("assumed; value: share", ["0.5", "1.0"], "assumed (50.0 % to 100.0 %)"),
        ("a limit (value) is used", ["50;30", "a"], "a limit (50;30, ...) is used"),
        ("has conditions: relation (value)", ["9", "12"], "has conditions: relation (9, ...)"),
        ("nothing to tell", [None, None], "nothing to tell"),
    ],
)
def test_notes_of_one_kind_say_from_where_to_where(
    note: str, values: list[object], words: str
) -> None:
    assert notes_in_words(note, values) == words


def test_every_note_of_the_library_says_in_a_known_way_where_its_value_belongs() -> None:
    marks = re.compile(r"\(value|; value:")
    texts = {
        node.value
        for path in Path(uxsim_geo.__file__).parent.rglob("*.py")
        if path.name != "note_words.py"
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if marks.search(node.value) and "\n" not in node.value
    }
    assert len(texts) > 50
    left = [text for text in texts if marks.search(note_in_words(text, 1))]
    assert left == []

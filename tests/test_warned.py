"""The lines about what warns: what, how much in all, and why."""

from __future__ import annotations

from pipeline.warned import warnings_in
from uxsim_geo.network.notes import Notes


def test_what_was_dropped_is_told_with_its_sum_and_every_reason() -> None:
    notes = Notes()
    for reason, trips in (("no path", 12.5), ("intrazonal", 1000.0), ("unknown place", 1.0)):
        note = f"trips were left out, since {reason}; value: trips"
        told = {"element": "demand", "severity": "warning", "value": trips}
        notes.add(f"dropped: {reason}", note, **told)  # type: ignore[arg-type]
    notes.add("dropped: nothing", "no matter; value: trips", element="demand", value=7.0)
    assert warnings_in(notes.table()) == [
        "warning: dropped (3 notes, 1,014 trips in all): "
        "trips were left out, since intrazonal (1,000 trips); "
        "trips were left out, since no path (12.5 trips); "
        "trips were left out, since unknown place (1 trip)"
    ]


def test_where_nothing_warns_nothing_is_told() -> None:
    assert warnings_in(Notes().table()) == []


def test_a_single_warning_is_its_sentence() -> None:
    notes = Notes()
    notes.add("no CRS", "coordinates of no known reference system", severity="warning")
    assert warnings_in(notes.table()) == [
        "warning: no CRS: coordinates of no known reference system"
    ]


def test_the_same_of_many_links_is_told_once() -> None:
    notes = Notes()
    note = "the file says length 0: a length (value, m) assumed"
    notes.warn_each("length assumed", note, ["1", "2", "3"], [3.0, 17.25, 5.0])
    assert warnings_in(notes.table()) == [
        "warning: length assumed (3 notes): the file says length 0: a length (3 to 17.25 m) assumed"
    ]


def test_of_many_different_ones_the_greatest_are_told_and_the_rest_counted() -> None:
    notes = Notes()
    for zone in range(1, 8):
        note = f"no path leads to zone {zone}; value: trips"
        notes.add("unreachable", note, element="demand", severity="warning", value=10.0 * zone)
    (line,) = warnings_in(notes.table())
    assert line == (
        "warning: unreachable (7 notes, 280 trips in all): no path leads to zone 7 (70 trips); "
        "no path leads to zone 6 (60 trips); no path leads to zone 5 (50 trips); "
        "and 4 more in import_notes.html"
    )


def test_what_cannot_be_added_is_not_summed() -> None:
    notes = Notes()
    notes.add("distortion", "length; value: share", severity="warning", value=0.02)
    notes.add("distortion", "time; value: share", severity="warning", value=0.5)
    assert warnings_in(notes.table()) == [
        "warning: distortion (2 notes): time (50.0 %); length (2.0 %)"
    ]

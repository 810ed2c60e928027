"""What a user must know before the figures of a run are believed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

#: share of the vehicles demanded; where more are aborted, the figures say little
MOST_ABORTED = 0.1


def warnings_in(notes: pd.DataFrame) -> list[str]:
    """Return a line for every topic of the notes that warns: the first note, how many, how much.

    The values of notes on the demand are trips, and are summed.
    """
    import pandas as pd

    lines = []
    for topic, found in notes[notes["severity"] == "warning"].groupby("topic", sort=False):
        first = found.iloc[0]
        trips = float(pd.to_numeric(found["value"], errors="coerce").sum())
        amounts = [f"{len(found):,} times"] if len(found) > 1 else []
        amounts += [f"{number_in_words(trips)} trips"] if first["element"] == "demand" else []
        amount = f" ({', '.join(amounts)})" if amounts else ""
        lines.append(f"warning: {topic}{amount}: {first['note']}")
    return lines


def warning_of_aborted(figures: dict[str, Any]) -> str | None:
    """Return a line where so many vehicles found no way that the other figures say little."""
    aborted, demanded = figures["vehicles_aborted"], figures["vehicles_demanded"]
    if aborted <= MOST_ABORTED * demanded:
        return None
    return (
        f"warning: {aborted:,} of {demanded:,} vehicles ({aborted / demanded:.0%}) were aborted, "
        "for no path led to their destination: the figures are those of the others"
    )


def number_in_words(number: float) -> str:
    """Return a number of trips, with a decimal where it is not whole."""
    return f"{number:,.0f}" if abs(number - round(number)) < 0.05 else f"{number:,.1f}"

"""What a results file says beside the traffic: when, whose, how it came about."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, NamedTuple

import pandas as pd

from uxsim_geo.network.driving_side import DrivingSide

#: second 0 in layers, which cannot do without a date, where nobody gave one
STAND_IN = datetime(2000, 1, 1, tzinfo=UTC)


class Change(NamedTuple):
    """What was closed or changed during the run, where, and when.

    begin, end in s after the start; inf where it does not end.
    """

    what: str
    where: str
    begin: float
    end: float


def origin_of(start: datetime | None) -> datetime:
    """Second 0 in layers."""
    return STAND_IN if start is None else start


@dataclass(frozen=True)
class RunDescription:
    """Of one run.

    start
        what the clock shows at 0 s, with its time zone; None: nobody told it
    notes
        of the import, with the columns of :data:`uxsim_geo.network.network.NOTE_COLUMNS`
    information
        names and values for ``run_info``: configuration, versions, seed, figures; without a number
        ``reaction_time_s`` among them the capacity of the diagram is not known and stays empty
    name
        of the run, for titles
    driving_side
        the side of the road that traffic is drawn on
    attribution
        who is to be named where the results are shown
    changes
        measures that controlled traffic
    provenance
        what the results were made of and by, in the terms of JSON
    """

    start: datetime | None
    notes: pd.DataFrame
    information: Mapping[str, object]
    name: str = ""
    driving_side: DrivingSide = "right"
    attribution: str = ""
    changes: Sequence[Change] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.start is not None and self.start.tzinfo is None:
            raise ValueError(f"start needs a time zone, for instance UTC: {self.start.isoformat()}")

    @property
    def run_info(self) -> dict[str, object]:
        """What ``run_info`` holds: the information, and who is to be named."""
        named = {"attribution": self.attribution} if self.attribution else {}
        return {**self.information, **named}

    @property
    def origin(self) -> datetime:
        """Second 0 in layers."""
        return origin_of(self.start)

    @property
    def reaction_time(self) -> float | None:
        """τ of the run in s, as ``information`` tells it; None if it does not."""
        value = self.information.get("reaction_time_s")
        return float(value) if isinstance(value, (int, float)) else None

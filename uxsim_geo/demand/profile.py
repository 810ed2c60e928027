"""When the trips of a demand period depart."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Slice:
    """A part of the demand period: its times (s after the start) and its share of all trips."""

    start_s: float
    end_s: float
    share: float


@dataclass(frozen=True)
class TripsOptions:
    """What a trips file does not say itself: how many of its trips depart, and when.

    period_s
        demand_period_s of a configuration: s within which the file's trips depart; required,
        since the numbers alone may be those of an hour or of a day
    factor
        every number of the file is multiplied by it
    start_s
        s after the start of the simulation at which the period begins
    profile
        pairs (until_s, share), times counted from start_s: each share of the trips departs evenly
        between the time before (at first 0) and its own, of which the last is period_s; shares
        need not sum to 1, only their ratios count; empty: all evenly over the period
    """

    period_s: float | None = None
    factor: float = 1.0
    start_s: float = 0.0
    profile: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        faults = Faults("options of the trips")
        if self.period_s is None:
            faults.add(
                "must be stated: the file does not say whether its trips are those of an hour, "
                "a day or another time",
                column="demand_period_s",
            )
        elif not 0 < self.period_s < math.inf:
            what = "must be a finite number of seconds above 0"
            faults.add(what, column="demand_period_s", value=self.period_s)
        if not 0 < self.factor < math.inf:
            faults.add("must be a finite number above 0", column="factor", value=self.factor)
        if not 0 <= self.start_s < math.inf:
            faults.add("must be a finite number, 0 or more", column="start_s", value=self.start_s)
        if self.profile and not faults.found:
            self._add_profile_faults(faults)
        faults.raise_if_any()

    def _add_profile_faults(self, faults: Faults) -> None:
        before = 0.0
        for place, (until, share) in enumerate(self.profile, start=1):
            pair = f"profile, pair {place}"
            if not before < until:
                what = f"the time must be above that of the pair before, {before:g} s"
                faults.add(what, column=pair, value=until)
            if not 0 <= share < math.inf:
                faults.add("the share must be finite, 0 or more", column=pair, value=share)
            before = until
        if before != self.period_s:
            what = f"the last time must be the end of the period, {self.period_s} s"
            faults.add(what, column=f"profile, pair {len(self.profile)}", value=before)
        if all(share == 0 for _, share in self.profile):
            faults.add("one share at least must be above 0", column="profile")

    def slices(self) -> list[Slice]:
        """The parts of the period in which trips depart; their shares sum to 1."""
        assert self.period_s is not None, "checked when the options were made"
        pairs = self.profile or ((self.period_s, 1.0),)
        total = math.fsum(share for _, share in pairs)
        slices: list[Slice] = []
        begin = 0.0
        for until, share in pairs:
            if share > 0:
                slices.append(Slice(self.start_s + begin, self.start_s + until, share / total))
            begin = until
        return slices

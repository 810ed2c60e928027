"""What the sheet to print says of times and streets, by the clock of QGIS's time slider, in UTC."""

from __future__ import annotations

from typing import NamedTuple

from uxsim_geo.export.clock import Clock
from uxsim_geo.export.findings import Findings
from uxsim_geo.export.lost_time import NONE, in_words
from uxsim_geo.export.qgis_parts import Project

STREETS = 8  # for which there is room


class SheetTimes(NamedTuple):
    """Findings, and the clock that tells their times: that of QGIS's time slider, in UTC."""

    findings: Findings
    clock: Clock

    @classmethod
    def of(cls, project: Project) -> SheetTimes:
        """Those of a project."""
        findings, edges = project.findings, [*project.findings.lost.begin]
        is_told = findings.begin and project.description.start is not None
        start = findings.begin[0].to_pydatetime() if is_told else None
        return cls(findings, Clock.of(start, [*edges, findings.lost.end[-1]]))

    @property
    def period(self) -> str:
        """Of the whole run, as the end of a title."""
        begin, end = self.findings.begin, self.findings.lost.end
        if not begin:
            return ""
        day = f", {begin[0]:%Y-%m-%d}" if self.clock.start is not None else ""
        return f"{day}, {self.clock.span(0.0, end[-1])}{self.zone}"

    @property
    def zone(self) -> str:
        """What stands behind times."""
        return f" {self.clock.zone}" if self.clock.zone else " after the start"

    @property
    def worst(self) -> str:
        """When the network as a whole is at its worst, a sentence."""
        bin_ = self.findings.lost.worst_bin
        if in_words(self.findings.lost.in_bins[bin_]) == NONE:
            return f"Nobody loses time on links; {self.of_bin(bin_)}{self.zone}."
        return f"Most time is lost {self.of_bin(bin_)}{self.zone}."

    def of_bin(self, number: int) -> str:
        """From when to when it goes."""
        return self.clock.span(self.findings.lost.begin[number], self.findings.lost.end[number])


def streets_in_words(times: SheetTimes) -> str:
    """Where most is lost, how much, and when most."""
    lost = times.findings.lost
    streets = lost.streets(STREETS)
    if not streets:
        return "Nobody lost time on the links."
    lines = [
        f"{lost.unit.text(street.lost)}  ({100 * street.share:.1f} %)  "
        + (f"{times.of_bin(street.bin)}  " if times.findings.begin else "")
        + street.name
        for street in streets
    ]
    when = f", and each when it was worst ({times.zone.strip()})" if times.findings.begin else ""
    return "\n".join([f"Where most time is lost in the whole run{when}:", *lines])

"""Where the cycle of a signal stands, and how a script may move it on."""

from __future__ import annotations

from collections.abc import Sequence

#: s: a time that rounding has put this much before a change of phase counts as after it
ROUNDING = 1e-9


class SignalClock:
    """A cycle of phases, each exactly as long as it says, that begins again for ever.

    durations
        of the phases, s
    start
        a time at which the first phase begins, s after the start of the simulation
    """

    __slots__ = ("durations", "start")

    def __init__(self, durations: Sequence[float], start: float) -> None:
        self.durations = tuple(durations)
        self.start = start

    @property
    def cycle(self) -> float:
        """Time until the first phase comes again, s."""
        return sum(self.durations)

    def at(self, time: float) -> tuple[int, float]:
        """Give the phase at a time, and for how many seconds it has lasted."""
        position = (time - self.start + ROUNDING) % self.cycle
        for phase, duration in enumerate(self.durations[:-1]):
            if position < duration:
                return phase, max(position - ROUNDING, 0.0)
            position -= duration
        return len(self.durations) - 1, max(position - ROUNDING, 0.0)

    def next_change(self, time: float) -> float:
        """Give the time at which the phase that holds at ``time`` ends, s."""
        phase, elapsed = self.at(time)
        return time + self.durations[phase] - elapsed

    def move(self, time: float, phase: int, elapsed: float) -> None:
        """Let a phase have lasted ``elapsed`` s at a time; the cycle goes on from there."""
        self.start = time - elapsed - sum(self.durations[:phase])

"""Which seeds a study runs, and when there are enough of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from pipeline.scenarios import BASE
from pipeline.study_config import SeedsKey, SeedsSection, UntilSection

#: the figure of a run, by scenario and seed; None where the run failed or the figure is of nobody
Figures = Mapping[tuple[str, int], float | None]


@dataclass
class Seeds:
    """The seeds of a study in their order, a batch at a time; what follows hangs on results.

    A batch is done as a whole before anything is decided, and then in the order of the seeds, so
    that their number does not hang on which run was finished first.
    """

    key: SeedsKey
    first: int
    done: list[int] = field(default_factory=list)

    def batches(self) -> Iterator[tuple[int, ...]]:
        """Yield lists of further seeds; who no longer needs more stops asking."""
        while len(self.done) < self.most:
            batch = self.all[len(self.done) :][: self._batch()]
            self.done += batch
            yield batch

    @property
    def most(self) -> int:
        """How many there can be."""
        return len(self.all)

    @property
    def until(self) -> UntilSection | None:
        """What is asked of the interval, if that decides."""
        return self.key.until if isinstance(self.key, SeedsSection) else None

    def _batch(self) -> int:
        if not isinstance(self.key, SeedsSection):
            return self.most
        return self.key.step if self.done else self.key.minimum

    @property
    def all(self) -> tuple[int, ...]:
        """Those that there can be, in their order."""
        if isinstance(self.key, tuple):
            return self.key
        number = self.key.maximum if isinstance(self.key, SeedsSection) else self.key
        return tuple(range(self.first, self.first + number))


@dataclass(frozen=True)
class Width:
    """Half the width of the interval of a scenario's difference from the base, and what is asked.

    ``base`` itself, where there is no other scenario, has the interval of its mean.
    """

    scenario: str
    half_width: float
    most: float

    @property
    def is_narrow(self) -> bool:
        """Whether that suffices; an interval that is not known never does."""
        return self.half_width <= self.most

    def __str__(self) -> str:
        return f"{self.scenario} ± {self.half_width:.4g} (asked: {self.most:.4g})"


def widths(
    until: UntilSection, figures: Figures, scenarios: Sequence[str], seeds: Sequence[int]
) -> list[Width]:
    """Return the width of every scenario's interval over the seeds done so far."""
    base = [figures.get((BASE, seed)) for seed in seeds]
    known = [value for value in base if value is not None]
    most = until.half_width
    if most is None:
        assert until.relative_half_width is not None
        most = abs(math.fsum(known)) / len(known) * until.relative_half_width if known else 0.0
    others = [name for name in scenarios if name != BASE]
    if not others:
        return [Width(BASE, half_width(known), most)]
    found = []
    for name in others:
        pairs = zip(base, (figures.get((name, seed)) for seed in seeds), strict=True)
        differences = [b - a for a, b in pairs if a is not None and b is not None]
        found.append(Width(name, half_width(differences), most))
    return found


def half_width(values: Sequence[float]) -> float:
    """Return half the width of the 95 % interval of the mean; inf for fewer than two values."""
    from uxsim_geo.analysis.comparison.inference import half_width_of_mean

    return half_width_of_mean(values) if len(values) > 1 else math.inf

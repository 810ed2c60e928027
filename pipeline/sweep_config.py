"""Keys of a sweep: parameters of the base that take several values, each point a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from pipeline.config_keys import Ids, Section
from pipeline.yaml_source import Place, YamlSource
from uxsim_geo.analysis.comparison.quantities import TOTALS
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.sweeps import Range, grid_points, latin_hypercube

#: what a sweep's points are called: point_001, point_002, ...
POINT = "point_{number:0{digits}d}"

#: more runs than these nobody waits for
MOST_POINTS = 10_000


class RangeEntry(Section):
    """What a parameter may be."""

    low: float = Field(description="the least, in the key's unit")
    high: float = Field(description="the most, in the key's unit")
    logarithmic: bool = Field(
        False, description="equal ratios are equally likely, not equal differences"
    )
    whole: bool = Field(False, description="whole numbers only")

    def range(self) -> Range:
        """Return it for the library."""
        return Range(self.low, self.high, self.logarithmic, self.whole)


class SweepSection(Section):
    """Points in the space of some keys of the base; each is run with all seeds.

    Their figures stand in sweep.csv, a row a run, and in plots against every parameter.
    """

    grid: dict[str, Annotated[tuple[Any, ...], Field(strict=False)]] = Field(
        {},
        description="by key, as simulate.route_update_weight, its values: all combinations are run",
    )
    latin_hypercube: dict[str, RangeEntry] = Field(
        {}, description="by key its range; so few runs as samples cover all ranges evenly"
    )
    samples: int = Field(20, ge=1, le=MOST_POINTS, description="points of the Latin hypercube")
    seed: int = Field(0, ge=0, lt=2**63, description="of the Latin hypercube's draws")
    build_on: Ids = Field((), description="names of scenarios that every point begins with")
    figures: Ids = Field(
        ("total_delay_veh_h",), description="columns of figures.csv that are drawn"
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if bool(self.grid) == bool(self.latin_hypercube):
            raise ValueError("needs grid or latin_hypercube, one of them")
        known = [quantity.name for quantity in TOTALS]
        for name in self.figures:
            if name not in known:
                raise ValueError(f"figures: {name} is none of {', '.join(known)}")
        if len(self.points()) > MOST_POINTS:
            raise ValueError(f"makes more than {MOST_POINTS:,} points; give fewer values")
        return self

    @property
    def parameters(self) -> tuple[str, ...]:
        """The keys that take several values, in the order of the file."""
        return tuple(self.grid or self.latin_hypercube)

    def points(self) -> dict[str, dict[str, Any]]:
        """Return the value of every parameter at each point, by the point's name."""
        found: list[dict[str, Any]]
        if self.grid:
            found = grid_points(self.grid)
        else:
            ranges = {name: entry.range() for name, entry in self.latin_hypercube.items()}
            found = list(latin_hypercube(ranges, self.samples, self.seed))
        digits = max(3, len(str(len(found))))
        return {
            POINT.format(number=number, digits=digits): point
            for number, point in enumerate(found, start=1)
        }


def add_points(document: YamlSource, sweep: SweepSection) -> None:
    """Write the points into a study as scenarios of their names; faults are at the sweep's lines.

    Raises :class:`uxsim_geo.errors.InputError` for a scenario that has the name of a point.
    """
    scenarios = document.values.setdefault("scenarios", {})
    if not isinstance(scenarios, dict):
        return  # that is told where scenarios are read
    points = sweep.points()
    taken = [
        Fault("is the name of a point of the sweep; choose another", *_origin(document, name))
        for name in points
        if name in scenarios
    ]
    if taken:
        raise InputError(taken)
    for name, point in points.items():
        scenarios[name] = _edits(document, ("scenarios", name), sweep, point)


def _origin(document: YamlSource, name: str) -> tuple[str, int | None, None, str]:
    return (*document.origin(("scenarios", name)), None, name)


def _edits(
    document: YamlSource, place: Place, sweep: SweepSection, point: Mapping[str, Any]
) -> list[dict[str, Any]]:
    kind = "grid" if sweep.grid else "latin_hypercube"
    edits: list[dict[str, Any]] = []
    if sweep.build_on:
        document.take_origins(document, ("sweep", "build_on"), (*place, 0, "build_on"))
        edits.append({"build_on": list(sweep.build_on)})
    for key in point:
        here = (*place, len(edits), "config", key)
        document.origins[here] = document.origin(("sweep", kind, key))
    document.origins[place] = document.origin(("sweep", kind))
    edits.append({"config": dict(point)})
    return edits

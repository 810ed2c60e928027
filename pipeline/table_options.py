"""What an exported table is to be about: its bins, links, zones, areas, observations."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path


@dataclass(frozen=True)
class TableOptions:
    """What somebody asks of a table; None: as the table is unasked.

    bin_s, step_s
        length of time bins, and between two moments, s
    cell_m
        longest part of a link, m
    links, zones
        link_ids, zones
    areas
        file of polygons with a column ``name``, as GeoPackage or GeoJSON
    observed
        CSV file of counts or travel times: :mod:`uxsim_geo.analysis.observations`
    """

    bin_s: float | None = None
    step_s: float | None = None
    cell_m: float | None = None
    links: tuple[str, ...] | None = None
    zones: tuple[str, ...] | None = None
    areas: Path | None = None
    observed: Path | None = None

    def given(self) -> list[str]:
        """Names of what is asked for."""
        return [key.name for key in fields(self) if getattr(self, key.name) is not None]

    def as_written(self, name: str) -> object:
        """Return what is asked for as somebody writes it: names with commas between."""
        value = getattr(self, name)
        return ",".join(value) if isinstance(value, tuple) else value


#: what each is called on the command line
FLAGS = {key.name: f"--{key.name.replace('_', '-')}" for key in fields(TableOptions)}

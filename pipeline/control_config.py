"""The section of a configuration that controls traffic: a list for each kind of measure."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field

from pipeline.config_keys import LocatedSection
from pipeline.control_config_flow import (
    ClosureEntry,
    IncidentEntry,
    LinkCapacityEntry,
    MergePriorityEntry,
    NodeCapacityEntry,
    PerimeterEntry,
    RampMeterEntry,
    SignalEntry,
    SpeedLimitEntry,
)
from pipeline.control_config_routes import (
    AdviceEntry,
    CongestionTollEntry,
    EnforcedRouteEntry,
    TollEntry,
)

MeasureEntry = (
    SignalEntry
    | RampMeterEntry
    | PerimeterEntry
    | LinkCapacityEntry
    | NodeCapacityEntry
    | TollEntry
    | CongestionTollEntry
    | ClosureEntry
    | IncidentEntry
    | SpeedLimitEntry
    | MergePriorityEntry
    | AdviceEntry
    | EnforcedRouteEntry
)


class ControlSection(LocatedSection):
    """Measures that control traffic, by their kind. A file may hold these keys in its place."""

    signals: tuple[SignalEntry, ...] = Field(
        (), strict=False, description="plans of signals; several of a node follow one another"
    )
    ramp_meters: tuple[RampMeterEntry, ...] = Field(
        (), strict=False, description="rates at which links let vehicles out, fixed or by feedback"
    )
    perimeters: tuple[PerimeterEntry, ...] = Field(
        (), strict=False, description="limits of what may come into a region"
    )
    link_capacities: tuple[LinkCapacityEntry, ...] = Field(
        (), strict=False, description="limits of what may leave or enter links"
    )
    node_capacities: tuple[NodeCapacityEntry, ...] = Field(
        (), strict=False, description="limits of what may pass nodes"
    )
    tolls: tuple[TollEntry, ...] = Field(
        (), strict=False, description="fixed, or by the time of day"
    )
    congestion_tolls: tuple[CongestionTollEntry, ...] = Field(
        (), strict=False, description="tolls that follow the traffic"
    )
    closures: tuple[ClosureEntry, ...] = Field(
        (), strict=False, description="links that nobody may enter, or that some may not"
    )
    incidents: tuple[IncidentEntry, ...] = Field((), strict=False, description="lanes blocked")
    speed_limits: tuple[SpeedLimitEntry, ...] = Field(
        (), strict=False, description="below the free speed"
    )
    merge_priorities: tuple[MergePriorityEntry, ...] = Field(
        (), strict=False, description="weights of links where they meet"
    )
    advice: tuple[AdviceEntry, ...] = Field(
        (), strict=False, description="links that drivers are told to avoid or to prefer"
    )
    enforced_routes: tuple[EnforcedRouteEntry, ...] = Field(
        (), strict=False, description="routes that drivers have to take"
    )

    def entries(self) -> Iterator[tuple[str, int, MeasureEntry]]:
        """Yield key, position in its list and entry of every measure, in the order of the keys."""
        for kind in type(self).model_fields:
            for number, entry in enumerate(getattr(self, kind)):
                yield kind, number, entry

    def in_words(self) -> str:
        """Say how many measures there are of which kind."""
        counts = {kind: len(getattr(self, kind)) for kind in type(self).model_fields}
        return ", ".join(f"{kind}: {count}" for kind, count in counts.items() if count)


def _section_or_file(value: object) -> object:
    if isinstance(value, dict | ControlSection):
        return value
    raise ValueError("must be a section (keys and values), or the path of a YAML file with them")


ControlKey = Annotated[
    ControlSection,
    BeforeValidator(_section_or_file, json_schema_input_type=ControlSection | Path),
]

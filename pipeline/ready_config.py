"""Keys of the steps that make a network ready to be simulated."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from pipeline.config_keys import Section
from uxsim_geo.network.clusters import JunctionSizes
from uxsim_geo.network.ready_options import ReadyOptions


class ReadySection(Section):
    """Steps from a street map to a network that can be simulated; each can be left out."""

    project: bool = Field(True, description="put geometry into metres")
    crs: str | None = Field(
        None, description="the system in metres, as EPSG:32632; none: that of the data's UTM zone"
    )
    drop_undrivable: bool = Field(
        True, description="drop links without lanes or speed, or from a node to itself"
    )
    dropped_classes: tuple[str, ...] = Field(
        (), strict=False, description="values of road_class whose links are dropped too"
    )
    largest_part: bool = Field(
        True, description="keep the part in which every node reaches every other; the rest is noted"
    )
    join: bool = Field(True, description="join links where nothing meets and nothing changes")
    short_piece_m: float = Field(
        50.0, ge=0, description="a shorter piece of other lanes or speed joins its neighbour, m"
    )
    merge_junctions: bool = Field(
        True, description="make one node of junctions that are drawn as several"
    )
    junction_link_m: float = Field(
        JunctionSizes.link, ge=0, description="nodes so near along a link may be one junction, m"
    )
    junction_signal_link_m: float = Field(
        JunctionSizes.signal_link, ge=0, description="the same where both have signals, m"
    )
    junction_ring_m: float = Field(
        JunctionSizes.ring, ge=0, description="roundabouts of at most this length may be one, m"
    )
    junction_extent_m: float = Field(
        JunctionSizes.extent, gt=0, description="no junction is longer across, m"
    )
    junction_error_m: float = Field(
        JunctionSizes.error,
        ge=0,
        description="a junction stays as it is if a way through it would change by more, m",
    )
    ring_storage_veh: float = Field(
        5.0,
        ge=0,
        description="one-way rings of links that each hold fewer vehicles than this, which could "
        "lock, become direct links; 0: they stay",
    )
    u_turns: Literal["nowhere", "signals", "junctions"] = Field(
        "signals", description="where turning back is banned"
    )
    step_s: float = Field(
        5.0, gt=0, description="links driven in less time are counted before and after, s"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        self.options("right")
        return self

    def options(self, driving_side: Literal["right", "left"]) -> ReadyOptions:
        """Return what the steps are told."""
        sizes = JunctionSizes(
            self.junction_link_m,
            self.junction_signal_link_m,
            self.junction_ring_m,
            self.junction_extent_m,
            self.junction_error_m,
        )
        return ReadyOptions(
            project=self.project,
            crs=self.crs,
            drop_undrivable=self.drop_undrivable,
            dropped_classes=self.dropped_classes,
            largest_part=self.largest_part,
            join=self.join,
            short_piece=self.short_piece_m,
            merge_junctions=self.merge_junctions,
            junctions=sizes,
            ring_storage=self.ring_storage_veh,
            u_turns=self.u_turns,
            driving_side=driving_side,
            step=self.step_s,
        )

"""Keys of networks in other formats than TNTP: a section each."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from pipeline.config_keys import InputFile, Section
from uxsim_geo.network.osm_options import PUBLIC_ROADS, OsmOptions


class OsmSection(Section):
    """Roads from an OpenStreetMap file: .osm or .xml, also .gz or .bz2, or .pbf."""

    file: InputFile = Field(description="the file")
    road_classes: tuple[str, ...] = Field(
        PUBLIC_ROADS, strict=False, description="values of the tag highway that become links"
    )
    country: str = Field(
        "default",
        description="whose speeds and lanes are assumed where the file has none: default, or a "
        "code as DE",
    )
    driving_side: Literal["right", "left"] = Field("right", description="noted with the import")
    private: bool = Field(
        False, description="roads of private access, of residents and deliveries too"
    )
    class_table: InputFile | None = Field(
        None, description="CSV that overrides what is assumed by road class and country"
    )
    zone_table: InputFile | None = Field(
        None, description="CSV that overrides the speeds of zones such as DE:urban"
    )
    signal_distance_m: float = Field(
        50.0, gt=0, description="a signal before a junction belongs to it within this distance, m"
    )
    max_unpacked_mb: float | None = Field(
        None,
        gt=0,
        description="a packed file may unpack to so many MB; none: 100 times its size, at least 32",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        self.options(0.2)
        return self

    def options(self, jam_density: float) -> OsmOptions:
        """Return what the reader is told; ``jam_density`` is that of the whole ingestion."""
        return OsmOptions(
            road_classes=self.road_classes,
            country=self.country,
            driving_side=self.driving_side,
            private=self.private,
            class_table=self.class_table,
            zone_table=self.zone_table,
            jam_density=jam_density,
            signal_distance=self.signal_distance_m,
            max_unpacked_mb=self.max_unpacked_mb,
        )

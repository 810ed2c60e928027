"""Keys of edits of the demand: scaled, moved in time, replaced; of all trips or of some."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from pipeline.config_keys import Id, Ids, PolygonKey, Section
from pipeline.demand_config import DemandEntry

if TYPE_CHECKING:
    from uxsim_geo.scenario.trips import Trips

IdPair = Annotated[tuple[Id, Id], Field(strict=False)]
Seconds = Annotated[tuple[float, float], Field(strict=False)]


class ChosenTrips(Section):
    """Which trips: those for which all that is given holds; none given: all."""

    origins: Ids = Field((), description="node_ids where they start")
    destinations: Ids = Field((), description="node_ids where they end")
    pairs: tuple[IdPair, ...] = Field(
        (), strict=False, description="pairs of node_ids, as [[a, b], [b, a]]"
    )
    zones: Ids = Field(
        (), description="they start or end in one of these zones, as column zone_id of nodes has it"
    )
    origin_zones: Ids = Field((), description="zones where they start")
    destination_zones: Ids = Field((), description="zones where they end")
    origin_polygon: PolygonKey | None = Field(
        None,
        description="they start at a node in this area: GeoJSON or GeoPackage file, or WKT in the "
        "network's CRS",
    )
    destination_polygon: PolygonKey | None = Field(None, description="likewise where they end")
    classes: Ids = Field((), description="of drivers; those without a name are of class default")
    between_s: Seconds | None = Field(
        None,
        description="two moments, s: those of the rows of the demand that begin from the first on "
        "and before the second, without what other edits moved",
    )

    def trips(self) -> Trips:
        """Return which rows are meant."""
        from uxsim_geo.demand.transform import Where
        from uxsim_geo.scenario.trips import Trips

        where = Where(
            origins=self.origins or None,
            destinations=self.destinations or None,
            pairs=self.pairs or None,
            classes=self.classes or None,
            between=self.between_s,
        )
        areas = (self.origin_polygon, self.destination_polygon)
        named = (None if area is None else str(area) for area in areas)
        return Trips(where, self.zones, self.origin_zones, self.destination_zones, *named)


class ScaleDemandEdit(ChosenTrips):
    """So many times the trips. Those of the base that stay depart when they did."""

    factor: float = Field(ge=0, description="0: none; 1.1: a tenth more, beside those there are")


class ShiftDemandEdit(ChosenTrips):
    """Trips depart later, or earlier; all of them or a share, the others when they did."""

    by_s: float = Field(description="s; below 0: earlier, not before the start")
    share: float = Field(1.0, gt=0, le=1, description="of the trips, drawn by their identity")


class ReplaceDemandEdit(ChosenTrips):
    """Trips of another source in the place of those chosen."""

    source: DemandEntry | None = Field(
        None, alias="with", description="section: as an entry of ingest.demand; none: nothing"
    )

    @model_validator(mode="after")
    def _chooses(self) -> Self:
        if self.source is None and not any(
            getattr(self, name) for name in ChosenTrips.model_fields
        ):
            raise ValueError("takes all trips out and puts none in; give with, or choose trips")
        return self

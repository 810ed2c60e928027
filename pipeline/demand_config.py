"""Keys of the demand of a network that brings none: OD tables, lists of trips, gravity models."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.config_keys import Id, InputFile, Section
from uxsim_geo.demand.profile import TripsOptions

ProfileStep = Annotated[tuple[float, float], Field(strict=False)]

NAMES = "pairs of what a column holds and its name"


class ZonesSection(Section):
    """Areas or points that trips go between, and the nodes that serve each; or cells made here."""

    file: InputFile | None = Field(
        None, description="zones: GeoPackage, GeoJSON, shapefile or GeoParquet"
    )
    layer: str | None = Field(None, description="of the file, where it has several")
    zone_column: str = Field("zone", description="column that names the zones")
    cell_m: float | None = Field(
        None,
        gt=0,
        description="in place of a file: square cells of this size over the network, m, with the "
        "column road_km",
    )
    nodes_per_zone: int = Field(5, ge=1, description="nodes that serve a zone, at most")
    within_m: float = Field(
        1000.0, ge=0, description="how far a zone without a node inside looks for one, m"
    )
    weights: str = Field(
        "even",
        description="how its nodes share the trips of a zone: even, capacity, or a column of nodes",
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if (self.file is None) == (self.cell_m is None):
            raise ValueError("give either file or cell_m")
        return self


class PlacesSection(Section):
    """Where the trips of a table start and end."""

    zones: ZonesSection | None = Field(
        None, description="section: zones of the table; none: those of the network, else its nodes"
    )
    points_crs: str | None = Field(
        None,
        description="the table has points in this reference system, as EPSG:4326 for longitude "
        "and latitude; each goes to the nearest node",
    )
    points_within_m: float = Field(
        500.0, gt=0, description="points further from every node are left out, m"
    )
    unknown: Literal["fault", "drop"] = Field(
        "fault", description="places that the network does not know: an error, or left out and told"
    )


class OdSection(PlacesSection):
    """An OD table: CSV or Parquet, OMX (extra `omx`), or TNTP trips, by the file's ending."""

    file: InputFile = Field(description="the table")
    form: Literal["long", "matrix"] = Field(
        "long", description="of CSV and Parquet: one row a pair, or a square matrix"
    )
    columns: dict[str, str] = Field({}, description=f"of the long form: {NAMES}")
    class_columns: dict[str, str] = Field(
        {}, description="of the long form: pairs of a class of drivers and its column of vehicles"
    )
    core: str | None = Field(None, description="of OMX: matrix to read, if there are several")
    lookup: str | None = Field(None, description="of OMX: which names of zones hold")


class TripListSection(PlacesSection):
    """A list of trips with their departures, CSV or Parquet."""

    file: InputFile = Field(description="the list")
    begin: str | None = Field(
        None,
        description="the moment of second 0 as the column depart has it: 06:30, or "
        "2024-05-14T06:30; not for seconds (column depart_s)",
    )
    outside: Literal["fault", "drop"] = Field(
        "fault", description="trips before begin: an error, or left out and told"
    )
    columns: dict[str, str] = Field({}, description=NAMES)


class GravitySection(Section):
    """Trips from what zones hold and how far apart they are, for cities without a table."""

    zones: ZonesSection = Field(description="section: zones with columns that tell what they hold")
    productions: dict[str, float] = Field(
        min_length=1, description="vehicles that set out, for each unit of a column of the zones"
    )
    attractions: dict[str, float] = Field(
        min_length=1, description="vehicles that are drawn, likewise; only their ratios count"
    )
    total_vehicles: float | None = Field(
        None, gt=0, description="the productions are multiplied to this sum; none: as they are"
    )
    exponent: float = Field(0.0, description="b of the impedance t^-b e^(-c t), t in min")
    decay_per_min: float = Field(0.1, ge=0, description="c of it, 1/min")
    mean_time_s: float | None = Field(
        None, gt=0, description="in place of c: mean free-flow time of the trips, s"
    )
    constraint: Literal["double", "origin"] = Field(
        "double", description="double: productions and attractions hold; origin: productions"
    )


class DemandEntry(Section):
    """Trips of one source, and when they are made: one of od, trip_list and gravity."""

    od: OdSection | None = Field(None, description="section: an OD table")
    trip_list: TripListSection | None = Field(
        None, description="section: trips with their own departures"
    )
    gravity: GravitySection | None = Field(None, description="section: a gravity model")
    demand_period_s: float | None = Field(
        None,
        gt=0,
        description="over which the trips depart, s; none: the table has times of its own",
    )
    start_s: float = Field(0.0, ge=0, description="begin of that period, s after the start")
    factor: float = Field(1.0, gt=0, description="the vehicles are multiplied by this number")
    profile: tuple[ProfileStep, ...] = Field(
        (), strict=False, description="pairs [until_s, share], as in ingest.trips"
    )
    whole_vehicles: bool | None = Field(
        None,
        description="vehicles between two places are rounded to whole ones, totals kept, before "
        "nodes share them; none: those of gravity are, others are not",
    )
    driver_class: Id | None = Field(
        None, alias="class", description="of simulate.classes, to which its drivers belong"
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name in ("od", "trip_list", "gravity") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError("must have one of od, trip_list and gravity")
        if self.gravity is not None and self.demand_period_s is None:
            raise ValueError("gravity needs demand_period_s: over how long its trips depart")
        if self.trip_list is not None and self.demand_period_s is not None:
            raise ValueError("trip_list has departures of its own; leave demand_period_s out")
        self.trips_options()
        return self

    def rounds(self) -> bool:
        """Whether the pairs of places get whole vehicles."""
        return self.gravity is not None if self.whole_vehicles is None else self.whole_vehicles

    def trips_options(self) -> TripsOptions | None:
        """Return when the trips are made; None: as the table itself says."""
        if self.demand_period_s is None:
            return None
        return TripsOptions(self.demand_period_s, self.factor, self.start_s, self.profile)

"""Keys of networks in other formats than TNTP: a section each."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from pipeline.config_keys import (
    CacheFolder,
    Ids,
    InputFile,
    InputFolder,
    PolygonKey,
    Section,
    ServerUrl,
)
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.gmns_options import MOTOR_USES, GmnsOptions
from uxsim_geo.network.mapped_options import ColumnMapping, Direction
from uxsim_geo.network.osm_defaults import fault_of_country
from uxsim_geo.network.osm_options import PUBLIC_ROADS, Barriers, BusLanes, OsmOptions
from uxsim_geo.network.osm_query import OsmQuery
from uxsim_geo.network.osm_servers import Servers
from uxsim_geo.network.units import KMH


class OsmSection(Section):
    """Roads from OpenStreetMap: of a file, or downloaded for a place, a box or a polygon.

    One of file, place, bbox and polygon is needed. What is downloaded is kept in a cache and used
    again; the servers are asked once.
    """

    file: InputFile | None = Field(
        None, description="the file: .osm or .xml, also .gz or .bz2, or .pbf"
    )
    place: str | None = Field(
        None, min_length=1, description="name of a place whose roads are downloaded, as Monaco"
    )
    bbox: tuple[float, ...] | None = Field(
        None,
        strict=False,
        description="area whose roads are downloaded: [west, south, east, north], degrees",
    )
    polygon: PolygonKey | None = Field(
        None,
        description="area whose roads are downloaded: GeoJSON or GeoPackage file, or WKT in "
        "degrees (EPSG:4326)",
    )
    refresh: bool = Field(
        False, description="download again in every run, whatever the cache holds"
    )
    cache: CacheFolder | None = Field(
        None,
        description="folder that keeps downloads; none: osm in $UXSIM_GEO_CACHE, "
        "$XDG_CACHE_HOME/uxsim-geo or ~/.cache/uxsim-geo",
    )
    overpass_url: ServerUrl | None = Field(
        None, description="server asked for roads; none: that of OSMnx's settings, public"
    )
    nominatim_url: ServerUrl | None = Field(
        None, description="server asked for places; none: that of OSMnx's settings, public"
    )
    timeout_s: float = Field(180.0, gt=0, description="the servers may be silent for so long, s")
    max_download_mb: float = Field(100.0, gt=0, description="a server's answer may be so large, MB")
    road_classes: tuple[str, ...] = Field(
        PUBLIC_ROADS, strict=False, description="values of the tag highway that become links"
    )
    driving_side: DrivingSide | None = Field(
        None,
        description="noted with the import, maps show traffic there; none: that of the country",
    )
    private: bool = Field(
        False, description="roads of private access, of residents and deliveries too"
    )
    barriers: Barriers = Field(
        "obeyed",
        description="obeyed: roads are cut where bollards, blocks or locked gates keep cars out; "
        "ignored: nowhere",
    )
    bus_lanes: BusLanes = Field(
        "reserved", description="reserved: lanes of buses do not count as lanes; shared: they do"
    )
    class_table: InputFile | None = Field(
        None, description="CSV that overrides what is assumed by road class and country"
    )
    zone_table: InputFile | None = Field(
        None, description="CSV that overrides the speeds of zones such as DE:urban"
    )
    country: str = Field(
        "default",
        description="whose speeds and lanes are assumed where the file has none: default, or a "
        "code as DE",
    )
    signal_distance_m: float = Field(
        50.0, gt=0, description="a signal before a junction belongs to it within this distance, m"
    )
    max_unpacked_mb: float | None = Field(
        None,
        gt=0,
        description="a packed file may unpack to so many MB; none: 100 times its size, at least 32",
    )

    @field_validator("country")
    @classmethod
    def _is_known(cls, country: str, info: ValidationInfo) -> str:
        # the tables stand before it, since countries of one's own are in them
        tables = (info.data.get("class_table"), info.data.get("zone_table"))
        what = fault_of_country(country, *tables)
        if what is not None:
            raise ValueError(what)
        return country

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        self.options(0.2)
        ways = {name: getattr(self, name) for name in ("file", "place", "bbox", "polygon")}
        given = [name for name, value in ways.items() if value is not None]
        if len(given) != 1:
            told = f"not {' and '.join(given)}" if given else "none is given"
            raise ValueError(f"needs exactly one of {', '.join(ways)}; {told}")
        self.query()
        return self

    def query(self) -> OsmQuery | None:
        """Return what is to be downloaded; None: the roads are in a file."""
        if self.file is not None:
            return None
        polygon = None if self.polygon is None else str(self.polygon)
        return OsmQuery(self.place, self.bbox, polygon, self.road_classes)

    def servers(self) -> Servers:
        """Return whom to ask."""
        own = self.overpass_url, self.nominatim_url
        return Servers(*own, timeout_s=self.timeout_s, max_mb=self.max_download_mb)

    def side(self) -> DrivingSide:
        """Return the side that is driven on: as told, or that of the country."""
        return self.options(0.2).side

    def options(self, jam_density: float) -> OsmOptions:
        """Return what the reader is told; ``jam_density`` is that of the whole ingestion."""
        return OsmOptions(
            road_classes=self.road_classes,
            country=self.country,
            driving_side=self.driving_side,
            private=self.private,
            barriers=self.barriers,
            bus_lanes=self.bus_lanes,
            class_table=self.class_table,
            zone_table=self.zone_table,
            jam_density=jam_density,
            signal_distance=self.signal_distance_m,
            max_unpacked_mb=self.max_unpacked_mb,
        )


class GmnsSection(Section):
    """A folder of GMNS tables: node.csv, link.csv and what is beside them, demand.csv too."""

    folder: InputFolder = Field(description="the folder")
    length_unit: str | None = Field(
        None, description="of column length, as m, km, ft, mi; none: as config.csv says"
    )
    speed_unit: str | None = Field(
        None, description="of column free_speed, as km/h or mph; none: as config.csv says"
    )
    capacity_unit: str = Field(
        "veh/h/lane", description="of column capacity; many tables have veh/h of the whole link"
    )
    crs: str | None = Field(
        None, description="of the coordinates, as EPSG:4326, or none; none given: config.csv"
    )
    length_from: Literal["file", "geometry"] = Field(
        "file", description="geometry: lengths are those of the lines"
    )
    length_check: Literal["refuse", "warn"] = Field(
        "refuse",
        description="what becomes of lengths that would agree with the lines in other units",
    )
    uses: tuple[str, ...] = Field(
        MOTOR_USES,
        strict=False,
        description="links are read if their allowed_uses name one of these",
    )
    leave_out: tuple[str, ...] = Field(
        (), strict=False, description="values of facility_type whose links are left out"
    )
    lanes_where_missing: int | None = Field(
        None, ge=1, description="lanes of links without; none: a fault"
    )
    speed_where_missing_kmh: float | None = Field(
        None, gt=0, description="free speed of links without, km/h; none: a fault"
    )
    turns: Literal["listed", "all"] = Field(
        "listed",
        description="listed: movement.csv, where there is one, bans what it does not list at its "
        "nodes; all: it is not read",
    )
    timing_plans: Ids = Field(
        (),
        strict=False,
        description="timing_plan_ids of signal_timing_plan.csv to be read, where controllers have "
        "several, one for each time of the day; none: all",
    )
    demand: bool = Field(True, description="whether demand.csv is read too, where there is one")
    demand_period_s: float | None = Field(
        None, gt=0, description="over which its trips between zones depart, s"
    )
    demand_factor: float = Field(1.0, gt=0, description="its trips are multiplied by this number")
    unknown_zones: Literal["fault", "drop"] = Field(
        "fault", description="trips of zones that the network lacks: an error, or left out and told"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        self.options(0.2)
        return self

    def options(self, jam_density: float) -> GmnsOptions:
        """Return what the reader is told; ``jam_density`` is that of the whole ingestion."""
        speed = self.speed_where_missing_kmh
        return GmnsOptions(
            length_unit=self.length_unit,
            speed_unit=self.speed_unit,
            capacity_unit=self.capacity_unit,
            crs=self.crs,
            length_from=self.length_from,
            length_check=self.length_check,
            uses=self.uses,
            leave_out=self.leave_out,
            lanes_where_missing=self.lanes_where_missing,
            speed_where_missing=None if speed is None else speed / KMH,
            turns=self.turns,
            jam_density=jam_density,
        )

    def trips_options(self) -> TripsOptions | None:
        """Return when its trips are made; None: nobody says."""
        if self.demand_period_s is None:
            return None
        return TripsOptions(self.demand_period_s, self.demand_factor)


class UxsimCsvSection(Section):
    """UXsim's CSV files."""

    nodes: InputFile = Field(description="name,x,y")
    links: InputFile = Field(description="name,start,end,length,u,kappa,merge_priority")
    demand: InputFile | None = Field(None, description="orig,dest,start_t,end_t,q")
    crs: str = Field("none", description="of x and y, as EPSG:4326; none: of no known system")


class DirectionSection(Section):
    """Which way the traffic goes on a row, along its line: values of a column; null: empty."""

    column: str = Field(description="of the table")
    forward: tuple[str | None, ...] = Field(
        (), strict=False, description="from first to last point"
    )
    backward: tuple[str | None, ...] = Field((), strict=False, description="the other way")
    both: tuple[str | None, ...] = Field((), strict=False, description="both ways: two links")


class TablesSection(Section):
    """Any file of lines, by a mapping of its columns."""

    links: InputFile = Field(
        description="lines: GeoPackage, GeoJSON, shapefile, FlatGeobuf or GeoParquet"
    )
    links_layer: str | None = Field(None, description="of the file, where it has several")
    nodes: InputFile | None = Field(
        None, description="points of the nodes; none: nodes are where lines end"
    )
    nodes_layer: str | None = Field(None, description="of that file")
    columns: dict[str, Any] = Field(
        description="by column of the links (lanes and free_speed are needed): the file's "
        "column, or a number, or {column or constant, unit, values, missing}"
    )
    node_columns: dict[str, Any] = Field(
        {}, description="likewise for the nodes: node_id is needed"
    )
    direction: DirectionSection | None = Field(
        None, description="section; none: every row is one direction, along its line"
    )
    lanes_of: Literal["direction", "road"] = Field(
        "direction", description="road: lanes count both directions of a two-way row"
    )
    tolerance_m: float = Field(
        1.0, ge=0, description="ends of lines as near as this are at the same node, m"
    )
    crs: str | None = Field(None, description="of files that do not say theirs")
    keep: tuple[str, ...] = Field((), strict=False, description="further columns to keep")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        self.mapping()
        return self

    def mapping(self) -> ColumnMapping:
        """Return what the reader is told."""
        told = self.direction
        direction = (
            None if told is None else Direction(told.column, told.forward, told.backward, told.both)
        )
        return ColumnMapping(
            self.columns,
            self.node_columns,
            direction,
            self.lanes_of,
            self.tolerance_m,
            self.crs,
            self.keep,
        )

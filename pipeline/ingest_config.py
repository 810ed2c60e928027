"""Keys of ingestion: where network and demand come from, and what the figures in files mean."""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from pipeline.config_keys import Id, InputFile, Section
from pipeline.demand_config import DemandEntry, ProfileStep
from pipeline.ingest_config_formats import (
    GmnsSection,
    OsmSection,
    TablesSection,
    UxsimCsvSection,
)
from pipeline.ready_config import ReadySection
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.network.tntp_collection import KnownNetwork, Role, read_collection
from uxsim_geo.network.tntp_options import (
    CapacityFrom,
    Centroids,
    Connectors,
    FreeSpeedFrom,
    TntpOptions,
)
from uxsim_geo.network.units import Quantity, parse_unit

#: of the network; each but TNTP, whose keys stand in the section itself, has a section of its name
Format = Literal["tntp", "osm", "gmns", "csv", "tables"]

#: of the formats that have one
SECTIONS = ("osm", "gmns", "csv", "tables")

#: keys that say nothing about other formats
TNTP_ALONE = ("dataset", "net", "nodes", "flow", "trips")


def _one_or_many(value: object) -> object:
    return [value] if isinstance(value, dict) else value


def _unit_of(quantity: Quantity) -> AfterValidator:
    def check(text: str) -> str:
        parse_unit(text, quantity)
        return text

    return AfterValidator(check)


def _known_dataset(name: str) -> str:
    return read_collection().find(name).name


DatasetName = Annotated[str, AfterValidator(_known_dataset)]
LengthUnit = Annotated[str, _unit_of("length")]
TimeUnit = Annotated[str, _unit_of("time")]
SpeedUnit = Annotated[str, _unit_of("speed")]
CapacityUnit = Annotated[str, _unit_of("capacity")]


class TripsEntry(Section):
    """One trips file, and when its trips are made."""

    file: InputFile | None = Field(
        None, description="trips file, TNTP; none: that of ingest.dataset"
    )
    demand_period_s: float = Field(
        gt=0, description="length of the period over which the file's trips depart, s"
    )
    start_s: float = Field(0.0, ge=0, description="begin of that period, s after the start")
    factor: float = Field(1.0, gt=0, description="the file's trips are multiplied by this number")
    profile: tuple[ProfileStep, ...] = Field(
        (),
        strict=False,
        description="pairs [until_s, share]: until that time, s from start_s, this share of the "
        "trips departs evenly; only the ratios of the shares count; the last time is "
        "demand_period_s; empty: all evenly",
    )
    driver_class: Id | None = Field(
        None, alias="class", description="of simulate.classes, to which its drivers belong"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        self.trips_options()
        return self

    def trips_options(self) -> TripsOptions:
        """Return what the reader of the trips is told."""
        return TripsOptions(self.demand_period_s, self.factor, self.start_s, self.profile)


TripsEntries = Annotated[
    tuple[TripsEntry, ...],
    BeforeValidator(_one_or_many, json_schema_input_type=TripsEntry | tuple[TripsEntry, ...]),
]


class IngestSection(Section):
    """Where network and demand come from, and what the figures in the files mean."""

    format: Format = Field("tntp", description="format of the network")
    osm: OsmSection | None = Field(None, description="section: roads from OpenStreetMap")
    gmns: GmnsSection | None = Field(None, description="section: a folder of GMNS tables")
    csv: UxsimCsvSection | None = Field(None, description="section: UXsim's CSV files")
    tables: TablesSection | None = Field(None, description="section: any file of lines")
    demand: tuple[DemandEntry, ...] = Field(
        (), strict=False, description="trips of other sources than TNTP files"
    )
    ready: ReadySection | Literal[False] | None = Field(
        None,
        description="section: steps that make the network ready to be simulated; none given: all "
        "of them for osm, none for other formats; false: none",
    )
    signals: Literal["assumed", "none"] = Field(
        "assumed",
        description="of nodes that the network says have one: timed by a rule (docs/signals.md), "
        "or left out",
    )
    signal_table: InputFile | None = Field(
        None,
        description="CSV of signal plans in their place, as a run has it in network/signals.csv",
    )
    dataset: DatasetName | None = Field(
        None,
        description="TNTP network by its name in the list of uxsim-geo fetch: downloaded once, its "
        "files used where net, nodes, flow and trips.file name none; units are not part of it",
    )
    net: InputFile | None = Field(None, description="network file, TNTP; its keys are those below")
    nodes: InputFile | None = Field(None, description="file of coordinates, TNTP or GeoJSON")
    flow: InputFile | None = Field(None, description="file of assigned flows, TNTP")
    trips: TripsEntries = Field(
        (), strict=False, description="a TNTP trips file and its period, or a list of them"
    )
    overrides: InputFile | None = Field(
        None, description="table that replaces link attributes, by link_id; CSV or GeoPackage"
    )
    crs: str | None = Field(
        None, description="of the coordinates, as EPSG:4326; none: of no known system"
    )
    length_unit: LengthUnit | None = Field(
        None, description="of column length: m, km, ft, mi, or a multiple as 0.5 km"
    )
    time_unit: TimeUnit | None = Field(
        None, description="of column free_flow_time: s, min, h, day, or a multiple as 0.01 h"
    )
    speed_unit: SpeedUnit | None = Field(
        None, description="of column speed: km/h, mph, m/s, ft/min ..."
    )
    capacity_unit: CapacityUnit | None = Field(
        None, description="of column capacity: veh/h, veh/day ..., or veh/h/lane"
    )
    free_speed_from: FreeSpeedFrom = Field(
        "time", description="time: length / free_flow_time; speed: column speed"
    )
    min_speed: float = Field(3.0, gt=0, description="lower free speeds are raised to this, m/s")
    max_speed: float = Field(40.0, gt=0, description="higher free speeds are cut to this, m/s")
    capacity: CapacityFrom = Field(
        "file",
        description="file: kept exactly; diagram: follows from speed, lanes and jam density",
    )
    lane_capacity: float = Field(
        1800.0,
        gt=0,
        description="lanes = capacity / this, rounded, at least 1, where the file has no lanes; "
        "veh/h of one lane",
    )
    infinite_capacity: float = Field(
        45_000.0, gt=0, description="capacities from here on mean no limit; in capacity_unit"
    )
    jam_density: float = Field(0.2, gt=0, description="veh/m of one lane")
    centroids: Centroids = Field(
        "auto",
        description="auto: nodes below the first thru node, or zones whose every link takes no "
        "time or has infinite capacity; none: every node lets traffic through",
    )
    first_thru_node: int | None = Field(
        None, ge=1, description="in place of the file's, where that is missing or wrong"
    )
    connectors: Connectors = Field(
        "collapse",
        description="collapse: links at centroids are dropped, trips start and end at the nodes "
        "they led to; keep: they stay, and centroids let no traffic through",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        own = str(self.format)
        if own in SECTIONS and getattr(self, own) is None:
            raise ValueError(f"{own} is missing: format {own} has its keys in that section")
        for name in SECTIONS:
            if name != self.format and getattr(self, name) is not None:
                raise ValueError(f"{name} is for format: {name}, and this is {self.format}")
        if self.format == "tntp" and self.net is None and self.dataset is None:
            raise ValueError("net is missing: the network file, TNTP; or name a dataset")
        for name in TNTP_ALONE:
            if self.format != "tntp" and getattr(self, name) not in (None, ()):
                raise ValueError(f"{name} is for format: tntp, and this is {self.format}")
        with_network = self.csv is not None and self.csv.demand is not None
        with_network |= self.gmns is not None and self.gmns.demand
        if not (self.trips or self.demand or with_network):
            raise ValueError("has no trips: give demand, or with TNTP files trips")
        self._check_trips_files()
        self.network_options()
        return self

    def _check_trips_files(self) -> None:
        known = self.dataset_network
        if all(entry.file is not None for entry in self.trips):
            return
        if known is None:
            raise ValueError("trips.file is missing: the trips file, TNTP")
        if "trips" not in known.files:
            raise ValueError(f"trips.file is missing: dataset {known.name} has no trips")

    @property
    def dataset_network(self) -> KnownNetwork | None:
        """The network that is named as data set."""
        return None if self.dataset is None else read_collection().find(self.dataset)

    def roles_of_dataset(self) -> tuple[Role, ...]:
        """Return which files of the data set are read: those in whose place none is named."""
        known = self.dataset_network
        own: dict[Role, bool] = {
            "net": self.net is not None,
            "nodes": self.nodes is not None,
            "flow": self.flow is not None,
            "trips": all(entry.file is not None for entry in self.trips),
        }
        return () if known is None else tuple(role for role in known.files if not own[role])

    @property
    def steps(self) -> ReadySection | None:
        """The steps to take with the network; None: none."""
        if self.ready is None:
            return ReadySection() if self.format == "osm" else None
        return self.ready or None

    def network_options(self) -> TntpOptions:
        """Return what the reader of TNTP networks is told."""
        return TntpOptions(**{key.name: getattr(self, key.name) for key in fields(TntpOptions)})

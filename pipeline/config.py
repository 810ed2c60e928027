"""Every key of a configuration: its type, default, unit and help, in one place."""

from __future__ import annotations

import typing
from dataclasses import fields
from datetime import UTC, datetime
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BeforeValidator,
    Field,
    model_validator,
)

from pipeline.config_keys import Id, InputFile, LocatedSection, Section
from pipeline.control_config import ControlKey, ControlSection
from pipeline.control_config_routes import ClassEntry
from pipeline.plot_config import PlotEntry
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.network.tntp_options import (
    CapacityFrom,
    Centroids,
    Connectors,
    FreeSpeedFrom,
    TntpOptions,
)
from uxsim_geo.network.units import Quantity, parse_unit
from uxsim_geo.settings import Settings


def _in_utc(instant: datetime) -> datetime:
    try:
        return instant.astimezone(UTC)
    except OverflowError:
        raise ValueError("must lie in the years 1 to 9999, also in UTC") from None


def _one_or_many(value: object) -> object:
    return [value] if isinstance(value, dict) else value


#: what a report can hold; ``pipeline.report`` has one function for each
Output = Literal["geopackage", "space_time"]


def _unit_of(quantity: Quantity) -> AfterValidator:
    def check(text: str) -> str:
        parse_unit(text, quantity)
        return text

    return AfterValidator(check)


LengthUnit = Annotated[str, _unit_of("length")]
TimeUnit = Annotated[str, _unit_of("time")]
SpeedUnit = Annotated[str, _unit_of("speed")]
CapacityUnit = Annotated[str, _unit_of("capacity")]
ProfileStep = Annotated[tuple[float, float], Field(strict=False)]
Instant = Annotated[AwareDatetime, Field(strict=False), AfterValidator(_in_utc)]


class TripsEntry(Section):
    """One trips file, and when its trips are made."""

    file: InputFile = Field(description="trips file, TNTP")
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

    format: Literal["tntp"] = Field("tntp", description="format of the files")
    net: InputFile = Field(description="network file, TNTP")
    nodes: InputFile | None = Field(None, description="file of coordinates, TNTP or GeoJSON")
    flow: InputFile | None = Field(None, description="file of assigned flows, TNTP")
    trips: TripsEntries = Field(
        min_length=1, strict=False, description="a trips file and its period, or a list of them"
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
        self.network_options()
        return self

    def network_options(self) -> TntpOptions:
        """Return what the reader of the network is told."""
        return TntpOptions(**{key.name: getattr(self, key.name) for key in fields(TntpOptions)})


class SimulateSection(LocatedSection):
    """How the traffic is simulated; defaults are those of Seo (2023)."""

    duration_s: float = Field(gt=0, description="end of the simulation, s after the start")
    platoon_size: int = Field(5, ge=1, description="Δn, vehicles that move together")
    reaction_time_s: float = Field(
        1.0, gt=0, description="τ, s; with jam density κ it gives the wave speed 1/(τκ)"
    )
    route_update_interval_s: float = Field(
        600.0, gt=0, description="time between two updates of route choice, s"
    )
    route_update_weight: float = Field(
        0.5, ge=0, le=1, description="share of the newest shortest paths in route choice, 0 to 1"
    )
    route_noise: float = Field(
        0.01, ge=0, description="link times are multiplied by 1 + noise × U(0, 1) at every update"
    )
    seed: int = Field(0, ge=0, lt=2**63, description="of every random draw; also --seed")
    demand_rounding: Literal["conserve", "truncate"] = Field(
        "conserve",
        description="conserve: every vehicle drives, the last platoon of a pair may be smaller; "
        "truncate: every row of the demand is cut to whole platoons, as UXsim does",
    )
    route_choice: Literal["inertia", "logit"] = Field(
        "inertia",
        description="inertia: by the shortest paths of all updates, the newest weighing most; "
        "logit: by the costs of the last update, dearer ways less often",
    )
    logit_spread_s: float = Field(
        60.0,
        gt=0,
        description="of logit: a way that takes so much longer is chosen 1/e as often, s",
    )
    route_update_gradual: bool = Field(
        False, description="ten times as many updates of a tenth of the weight"
    )
    no_cycles: bool = Field(
        False,
        description="nobody drives to a node again, unless all out-links with weight do so",
    )
    deterministic: bool = Field(False, description="no random draws at all, and no noise")
    classes: tuple[ClassEntry, ...] = Field(
        (), strict=False, description="kinds of drivers; ingest.trips names that of its drivers"
    )
    control: ControlKey = Field(
        ControlSection(),
        description="section: measures that control traffic, or the path of a YAML file that "
        "holds these keys; paths in that file are relative to it",
    )

    def settings(self) -> Settings:
        """Return what the engine is told."""
        return Settings(
            duration=self.duration_s,
            platoon_size=self.platoon_size,
            reaction_time=self.reaction_time_s,
            route_update_interval=self.route_update_interval_s,
            route_update_weight=self.route_update_weight,
            route_noise=self.route_noise,
            seed=self.seed,
            demand_rounding=self.demand_rounding,
            route_choice=self.route_choice,
            logit_spread=self.logit_spread_s,
            route_update_gradual=self.route_update_gradual,
            no_cycles=self.no_cycles,
            deterministic=self.deterministic,
        )


class ReportSection(LocatedSection):
    """What is made of the results."""

    bin_s: float = Field(300.0, gt=0, description="length of a time bin in tables and plots, s")
    start: Instant = Field(
        datetime(2000, 1, 1, tzinfo=UTC),
        description="date and time of second 0, with its zone, as in 2024-05-01T07:00:00+02:00",
    )
    outputs: tuple[Output, ...] = Field(
        typing.get_args(Output), strict=False, description="which outputs to write"
    )
    plots: tuple[PlotEntry, ...] = Field(
        (
            PlotEntry(plot="network_average"),
            PlotEntry(plot="macroscopic_fundamental_diagram"),
        ),
        strict=False,
        description="pictures and films for the folder plots/",
    )

    @model_validator(mode="after")
    def _files_differ(self) -> Self:
        names = [entry.file_name for entry in self.plots]
        for name in sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"plots: two of them make {name}; give one of them a file")
        return self


class Config(Section):
    """One run: where its data come from, how it is simulated, what is reported."""

    name: str = Field(
        pattern=r"^\w[\w.-]*$",
        description="name of the run and of its folder: letters, digits, _ - and .",
    )
    ingest: IngestSection = Field(description="section: where the network and the demand come from")
    simulate: SimulateSection = Field(description="section: how the traffic is simulated")
    report: ReportSection = Field(
        ReportSection(), description="section: what is made of the results"
    )

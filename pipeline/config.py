"""Every key of a configuration: its type, default, unit and help, in one place."""

from __future__ import annotations

import typing
from datetime import UTC, datetime
from typing import Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    AwareDatetime,
    Field,
    model_validator,
)

from pipeline.config_keys import LocatedSection, Section
from pipeline.control_config import ControlKey, ControlSection
from pipeline.control_config_routes import ClassEntry
from pipeline.edits_config import TableEdit
from pipeline.ingest_config import IngestSection
from pipeline.measure_config import MeasureSection
from pipeline.plot_config import PlotEntry
from pipeline.space_time_config import SpaceTimeSection
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.settings import Settings


def _fits_in_utc(instant: datetime) -> datetime:
    """Leave the zone as given: the clock of the page shows it."""
    try:
        instant.astimezone(UTC)
    except OverflowError:
        raise ValueError("must lie in the years 1 to 9999, also in UTC") from None
    return instant


#: what a report can hold; ``pipeline.report`` has one function for each
Output = Literal["geopackage", "space_time", "geoparquet", "flatgeobuf", "page"]

#: layers of a results file that can be left out; ``uxsim_geo.export.run_layers`` makes them
LayerName = Literal["link_times", "od_lines", "trajectories", "import_notes"]


Instant = Annotated[AwareDatetime, Field(strict=False), AfterValidator(_fits_in_utc)]


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


class TrajectoriesSection(Section):
    """Which ways of vehicles the layer `trajectories` holds."""

    trips: int = Field(1000, ge=1, description="so many, spread evenly over all that drove")
    step_s: float = Field(10.0, gt=0, description="places are exact at multiples of it, s")


class ReportSection(LocatedSection):
    """What is made of the results.

    `geopackage` makes results.gpkg; `geoparquet` and `flatgeobuf` write the same layers to a file
    each in the folder layers/, the first for archives, the second, of layers with geometry, for the
    web.
    """

    bin_s: float = Field(300.0, gt=0, description="length of a time bin in tables and plots, s")
    start: Instant | None = Field(
        None,
        description="date and time of second 0, with its zone, as in 2024-05-01T07:00:00+02:00; "
        "none: times are counted from 0:00, and dates in layers from 2000-01-01 UTC",
    )
    outputs: tuple[Output, ...] = Field(
        ("geopackage", "space_time", "page"),
        strict=False,
        description="which outputs to write",
    )
    layers: tuple[LayerName, ...] = Field(
        typing.get_args(LayerName),
        strict=False,
        description="which layers to write beside nodes, links and run_info; link_times brings "
        "link_states, its view with geometry",
    )
    trajectories: TrajectoriesSection = Field(
        TrajectoriesSection(), description="section: which ways of vehicles to write"
    )
    driving_side: DrivingSide | None = Field(
        None,
        description="the side of the road on which maps show traffic; none: that of ingest.osm, "
        "else right",
    )
    attribution: str | None = Field(
        None,
        description="who is to be named where results are shown, as text, on every picture, page "
        "and file; none: © OpenStreetMap contributors for its roads, the TNTP collection for "
        "`ingest.dataset`, else nobody",
    )
    plots: tuple[PlotEntry, ...] = Field(
        (
            PlotEntry(plot="network_average"),
            PlotEntry(plot="macroscopic_fundamental_diagram"),
        ),
        strict=False,
        description="pictures and films for the folder plots/",
    )
    space_time: SpaceTimeSection = Field(
        SpaceTimeSection(), description="section: what the output space_time shows, and its forms"
    )

    @model_validator(mode="after")
    def _files_differ(self) -> Self:
        # many file systems take a.png and A.png for one file
        names = [entry.file_name.casefold() for entry in self.plots]
        for name in sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"plots: two of them make {name}; give one of them a file")
        return self


class Config(LocatedSection):
    """One run: where its data come from, how it is simulated, what is reported."""

    name: str = Field(
        pattern=r"^\w[\w.-]*$",
        description="name of the run and of its folder: letters, digits, _ - and .",
    )
    ingest: IngestSection = Field(description="section: where the network and the demand come from")
    edits: tuple[TableEdit, ...] = Field(
        (),
        strict=False,
        description="changes of network and demand after they are read, one after the other",
    )
    simulate: SimulateSection = Field(description="section: how the traffic is simulated")
    report: ReportSection = Field(
        ReportSection(), description="section: what is made of the results"
    )
    measure: MeasureSection = Field(
        MeasureSection(), description="section: what the run is compared with others by"
    )

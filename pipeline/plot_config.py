"""Keys of a plot that a report holds."""

from __future__ import annotations

from typing import Literal, NamedTuple, Self

from pydantic import Field, model_validator

from pipeline.config_keys import ChosenLinks, Ids, Section

#: ``pipeline.plots`` has one function for each
PlotName = Literal[
    "network_average",
    "network",
    "network_plan",
    "macroscopic_fundamental_diagram",
    "time_space_diagram_traj_links",
    "time_space_diagram_state_links",
    "cumulative_curves",
    "fundamental_diagram",
    "travel_times",
    "desire_lines",
    "network_anim",
    "network_fancy",
]

Format = Literal["png", "svg", "pdf", "gif", "mp4"]

STILLS: tuple[Format, ...] = ("png", "svg", "pdf")
FILMS: tuple[Format, ...] = ("gif", "mp4")


class Kind(NamedTuple):
    """Which keys a plot takes beside plot, format and file, and which it needs; formats it has."""

    takes: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    formats: tuple[Format, ...] = STILLS


KINDS: dict[PlotName, Kind] = {
    "network_average": Kind(),
    "network": Kind(("time_s", "bin_s"), ("time_s",)),
    "network_plan": Kind(),
    "macroscopic_fundamental_diagram": Kind(("region", "bin_s")),
    "time_space_diagram_traj_links": Kind(("links", "by_speed"), ("links",)),
    "time_space_diagram_state_links": Kind(("links", "state", "bin_s", "cell_m"), ("links",)),
    "cumulative_curves": Kind(("links",), ("links",)),
    "fundamental_diagram": Kind(("links", "bin_s"), ("links",)),
    "travel_times": Kind(),
    "desire_lines": Kind(("most",)),
    "network_anim": Kind(("bin_s", "frame_ms"), (), FILMS),
    "network_fancy": Kind(("interval_s", "share", "trail", "frame_ms"), (), FILMS),
}


class PlotEntry(Section):
    """A picture or a film: `plot` says which, the other keys what it is to show.

    `network_average` is a map of the whole run, `network` one of the time bin in which `time_s`
    lies, `network_plan` the bare network with its names; `time_space_diagram_traj_links` shows
    trajectories and `time_space_diagram_state_links` a state along links that follow one another;
    `fundamental_diagram` sets the states of links against their own diagrams; `network_anim` is a
    film of the links, `network_fancy` one of the vehicles.
    """

    plot: PlotName = Field(description="which")
    file: str | None = Field(
        None,
        pattern=r"^\w[\w.-]*$",
        description="name of the file in plots/, without its ending; none: by what it shows",
    )
    format: Format | None = Field(
        None, description="png, svg or pdf; of films gif or mp4; none: png, or gif"
    )
    links: Ids = Field(
        (),
        description="link_ids, for `time_space_diagram_traj_links`, "
        "`time_space_diagram_state_links` (one after the other), `cumulative_curves` (one) and "
        "`fundamental_diagram`",
    )
    region: ChosenLinks | None = Field(
        None,
        description="section, of `macroscopic_fundamental_diagram`: links that it is of; none: all",
    )
    time_s: float | None = Field(None, ge=0, description="of `network`: s after the start")
    bin_s: float | None = Field(
        None, gt=0, description="time bins of this plot alone, s; none: report.bin_s"
    )
    cell_m: float = Field(
        100.0, gt=0, description="of `time_space_diagram_state_links`: longest part of a link, m"
    )
    state: Literal["density", "flow", "speed"] = Field(
        "density", description="of `time_space_diagram_state_links`: what is shown"
    )
    by_speed: bool = Field(
        False, description="of `time_space_diagram_traj_links`: colour trajectories by speed"
    )
    most: int = Field(
        200, ge=1, description="of `desire_lines`: so many pairs in width and colour, others thin"
    )
    interval_s: float | None = Field(
        None,
        gt=0,
        description="of `network_fancy`: between two pictures, s; none: five time steps",
    )
    share: float = Field(
        0.3, gt=0, le=1, description="of `network_fancy`: of the platoons that are shown, 0 to 1"
    )
    trail: int = Field(
        6, ge=0, description="of `network_fancy`: pictures over which the way of a vehicle fades"
    )
    frame_ms: float = Field(
        100.0, ge=10, description="of films: how long a picture is seen, ms; 10 or more"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        kind = KINDS[self.plot]
        common = {"plot", "file", "format"}
        for name in sorted(type(self).model_fields.keys() - common - set(kind.takes)):
            # a resolved configuration holds all defaults
            if getattr(self, name) != type(self).model_fields[name].default:
                taken = ", ".join(kind.takes) or "none of these keys"
                raise ValueError(f"{self.plot} takes no {name}; it takes {taken}")
        for name in kind.needs:
            if getattr(self, name) in (None, ()):
                raise ValueError(f"{self.plot} needs {name}")
        if self.format is not None and self.format not in kind.formats:
            raise ValueError(f"{self.plot} is made as {' or '.join(kind.formats)}")
        if self.plot == "cumulative_curves" and len(self.links) > 1:
            raise ValueError("cumulative_curves are of one link; write an entry for each")
        return self

    @property
    def file_name(self) -> str:
        """Name of the file, by what the plot shows unless it is given."""
        ending = self.format or KINDS[self.plot].formats[0]
        return f"{self.file or self._own_name()}.{ending}"

    def _own_name(self) -> str:
        parts: list[str] = [self.plot]
        if "state" in KINDS[self.plot].takes:
            parts.append(self.state)
        if self.links:
            safe = ("".join(c if c.isalnum() or c in "-." else "_" for c in x) for x in self.links)
            names = list(safe)
            parts += names if len(names) <= 4 else [names[0], "to", names[-1]]
        if self.time_s is not None:
            parts.append(f"{self.time_s:g}s")
        return "_".join(parts)

"""Keys of the pictures in space and time that a report holds."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.config_keys import Section

#: ``pipeline.space_time`` has one function for each
Form = Literal["png", "html", "orbit", "sweep", "surface", "vtp", "vtkhdf"]
Part = Literal["ribbons", "queues", "trajectories", "time_plane"]
Camera = Literal["auto", "south", "east", "north", "west", "above"]

Pixels = Annotated[int, Field(ge=600, le=4000)]


class SpaceTimeSection(Section):
    """The run in space and time: the map below, time upwards, slow links as walls."""

    forms: tuple[Form, ...] = Field(
        ("png", "html"),
        min_length=1,
        strict=False,
        description="png: a still; html: a page to turn, works offline; orbit and sweep: films "
        "(MP4, extra video), round the scene and with the time rising; surface: a still of lost "
        "time as a terrain; vtp and vtkhdf: for ParaView, x and y in m, z in s",
    )
    colour: Literal["speed", "density"] = Field(
        "speed", description="what colour says: speed, % of free speed, or density, veh/km per lane"
    )
    show: tuple[Part, ...] = Field(
        ("ribbons", "queues"),
        strict=False,
        description="beside the map: ribbons (links while they are slow), queues (thick walls up "
        "to their tails), trajectories (of a sample), time_plane (a sheet at time_s)",
    )
    cameras: tuple[Camera, ...] = Field(
        ("auto",),
        strict=False,
        min_length=1,
        description="sides that stills are seen from, auto: the one from which walls hide each "
        "other least; the first makes space_time.png, others space_time_<side>.png; films begin "
        "there",
    )
    slower_than: float = Field(
        0.6, gt=0, le=1, description="share of free speed under which a link is drawn, 0 to 1"
    )
    most_links: int | None = Field(
        None,
        ge=1,
        le=20_000,
        description="so many links at most stand as walls, those that lost most time; none: 200, "
        "of a large network only as many as do not hide one another",
    )
    most_trajectories: int = Field(
        300, ge=1, le=5_000, description="so many platoons at most, spread evenly over all"
    )
    time_s: float | None = Field(
        None,
        ge=0,
        description="of the time plane, s after the start; none: when most vehicles queued",
    )
    width_px: Pixels = Field(1600, description="of stills; films are three quarters of it")
    height_px: Pixels = Field(1200, description="as width_px")
    pictures: int = Field(120, ge=2, le=5_000, description="of a film")
    frame_ms: float = Field(
        80.0, ge=10, description="how long a picture of a film is seen, ms; 10 or more"
    )

    @model_validator(mode="after")
    def _said_once(self) -> Self:
        for name in ("forms", "show", "cameras"):
            values = getattr(self, name)
            if len(set(values)) < len(values):
                raise ValueError(f"{name}: says something twice")
        return self

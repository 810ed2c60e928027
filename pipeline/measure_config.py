"""Keys of what runs are compared by."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from pipeline.config_keys import Ids, InputFile, Section


class CorridorEntry(Section):
    """A way whose travel time is compared: links in the order they are driven, or a street.

    A street has a corridor for each way along it, named by its end nodes.
    """

    links: Ids = Field((), description="link_ids, each beginning where the one before it ends")
    name: str | None = Field(None, min_length=1, description="what links are called; none: the ids")
    street: str | None = Field(
        None, min_length=1, description="name of the street, in place of links"
    )

    @model_validator(mode="after")
    def _says_which(self) -> Self:
        if bool(self.links) == (self.street is not None):
            raise ValueError("needs links or street, one of them")
        if self.street is not None and self.name is not None:
            raise ValueError("name goes with links; corridors of a street have its name")
        return self

    @property
    def title(self) -> str:
        """What the corridor of links is called."""
        return self.name or " ".join(self.links)


class MeasureSection(Section):
    """What runs are compared by; runs can be compared if this is the same."""

    bin_s: float = Field(300.0, gt=0, description="length of a time bin, s")
    corridors: tuple[CorridorEntry, ...] = Field(
        (), strict=False, description="ways whose travel times are compared by time bin"
    )
    zones: InputFile | None = Field(
        None,
        description="polygons by which trips are added up: a GeoPackage or GeoJSON; none: the "
        "zones of the network, else its nodes",
    )
    zone_name: str = Field("name", description="column of zones with their names")

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [entry.street or entry.title for entry in self.corridors]
        for name in sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"corridors: two of them are {name}; give one another name")
        return self

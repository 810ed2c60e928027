"""Keys of edits of the network: attributes of links, links and nodes added and removed, turns."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, PlainValidator, ValidationInfo, model_validator

from pipeline.config_keys import ChosenLinks, Id, Ids, Reading, Section, existing_file
from uxsim_geo.network.overrides import NAMES
from uxsim_geo.network.wkt import LINE

#: attributes of links that stand in the tables as text
TEXTS = ("road_class", "name", "source_id")


def _along(value: object, info: ValidationInfo) -> object:
    """Tell WKT from the path of a file, which must be there."""
    if not isinstance(value, str | Path):
        raise ValueError("must be a LINESTRING in WKT, or the path of a file with one line")
    if isinstance(value, str) and LINE.match(value):
        return value
    folder = info.context.folder if isinstance(info.context, Reading) else None
    return existing_file(Path(value), folder)


#: a line: WKT in the network's own CRS, or a file that says its own
LineKey = Annotated[Path | str, PlainValidator(_along, json_schema_input_type=str)]


class LinkAttributes(Section):
    """Attributes of links, each by its name in the tables (SI units) or with another unit."""

    length: float | None = Field(None, gt=0, description="m")
    length_m: float | None = Field(None, gt=0, description="length, m")
    length_km: float | None = Field(None, gt=0, description="length, km")
    length_mi: float | None = Field(None, gt=0, description="length, miles")
    length_ft: float | None = Field(None, gt=0, description="length, feet")
    lanes: int | None = Field(None, ge=1, description="of this direction")
    free_speed: float | None = Field(None, gt=0, description="m/s")
    free_speed_m_s: float | None = Field(None, gt=0, description="free speed, m/s")
    free_speed_kmh: float | None = Field(None, gt=0, description="free speed, km/h")
    free_speed_mph: float | None = Field(None, gt=0, description="free speed, mph")
    jam_density: float | None = Field(None, gt=0, description="veh/m of one lane")
    jam_density_vpkm: float | None = Field(
        None, gt=0, description="jam density, veh/km of one lane"
    )
    capacity: float | None = Field(None, gt=0, description="of the whole link, veh/s")
    capacity_vph: float | None = Field(None, gt=0, description="capacity of the whole link, veh/h")
    merge_priority: float | None = Field(None, gt=0, description="weight where links meet")
    road_class: Id | None = Field(None, description="text, as primary")
    name: Id | None = Field(None, description="of the road")
    source_id: Id | None = Field(None, description="of the road where the data come from")

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        given = [name for name in NAMES if getattr(self, name) is not None]
        for number, name in enumerate(given):
            for other in given[:number]:
                if NAMES[name][0] == NAMES[other][0]:
                    raise ValueError(f"{other} and {name} say the same; keep one")
        return self

    def values(self) -> dict[str, object]:
        """Return what is given, by the column of the links table, in SI units."""
        numbers = {
            NAMES[name][0]: getattr(self, name) * NAMES[name][1]
            for name in NAMES
            if getattr(self, name) is not None
        }
        if self.lanes is not None:
            numbers["lanes"] = self.lanes
        texts = {name: getattr(self, name) for name in TEXTS if getattr(self, name) is not None}
        return numbers | texts


class SetEdit(ChosenLinks, LinkAttributes):
    """Links get other attributes. A capacity that is given follows the lanes, unless set too."""

    @model_validator(mode="after")
    def _says_what(self) -> Self:
        if not self.values():
            raise ValueError("sets nothing; give an attribute, as lanes: 2 or free_speed_kmh: 30")
        return self


class ScaleEdit(ChosenLinks):
    """Attributes of links are multiplied. Where no capacity is given, it is that of the diagram."""

    length: float | None = Field(None, gt=0, description="factor of the length")
    free_speed: float | None = Field(None, gt=0, description="factor of the free speed")
    capacity: float | None = Field(None, gt=0, description="factor of the capacity")
    jam_density: float | None = Field(None, gt=0, description="factor of the jam density")
    merge_priority: float | None = Field(None, gt=0, description="factor of the merge priority")

    def factors(self) -> dict[str, float]:
        """Return the factors that are given, by the column of the links table."""
        own = (name for name in type(self).model_fields if name not in ChosenLinks.model_fields)
        return {name: getattr(self, name) for name in own if getattr(self, name) is not None}

    @model_validator(mode="after")
    def _says_what(self) -> Self:
        if not self.factors():
            raise ValueError("scales nothing; give a factor, as capacity: 1.2")
        return self


class AddLanesEdit(ChosenLinks):
    """Links get more lanes, or fewer. A capacity that is given follows in proportion."""

    lanes: int = Field(description="more lanes of each link; below 0: fewer, of which one stays")


class AddLinkEdit(LinkAttributes):
    """A new link along a line. Its number of lanes and its free speed must be given."""

    id: Id = Field(description="link_id, which no link has yet")
    from_node: Id = Field(alias="from", description="node_id at which it starts")
    to_node: Id = Field(alias="to", description="node_id at which it ends")
    along: LineKey | None = Field(
        None,
        description="its line: LINESTRING in the network's CRS, or a file with one line; its ends "
        "are moved to the nodes; none: straight",
    )
    both_ways: Id | None = Field(
        None, description="link_id of a second link, the same in the other direction"
    )

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        for name in ("lanes", "free_speed"):
            if name not in self.values():
                what = "free_speed_kmh" if name == "free_speed" else name
                raise ValueError(f"{what} is missing: a new link needs its {name.split('_')[-1]}")
        if self.from_node == self.to_node:
            raise ValueError("from and to are the same node")
        if self.both_ways == self.id:
            raise ValueError("both_ways must be another link_id than id")
        return self


class RemoveLinksEdit(ChosenLinks):
    """Links are taken out, with the banned turns that name them."""


class AddNodeEdit(Section):
    """A new node, which new links may start and end at."""

    id: Id = Field(description="node_id, which no node has yet")
    x: float = Field(description="in the network's CRS, or that given here")
    y: float = Field(description="likewise")
    crs: str | None = Field(
        None, description="of x and y, as EPSG:4326 (x: longitude); none: that of the network"
    )


class RemoveSignalsEdit(Section):
    """Nodes lose their signals: those of the network, and in a study those of its control."""

    nodes: Ids = Field(min_length=1, description="node_ids, as [a, b]")


class TurnEdit(Section):
    """A turn from one link into another, or a way over links between."""

    from_link: Id = Field(description="link_id")
    to_link: Id = Field(description="link_id")
    via_links: Ids = Field((), description="link_ids between, in the order of driving")

    def way(self) -> tuple[str, ...]:
        """Return the links from the first to the last."""
        return (self.from_link, *self.via_links, self.to_link)

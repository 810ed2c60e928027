"""What keys of a configuration are made of: sections, files, ids, timetables, chosen links."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    PrivateAttr,
    ValidationInfo,
    model_validator,
)

from pipeline.yaml_source import Place, YamlSource
from uxsim_geo.control.site import Target


@dataclass(frozen=True)
class Reading:
    """What a configuration is read from: a document, and the folder that its paths start from."""

    document: YamlSource
    folder: Path


@dataclass(frozen=True)
class Origin:
    """Where a section was read; two sections that say the same are equal wherever they stand."""

    document: YamlSource | None = field(default=None, compare=False)


class Section(BaseModel):
    """Keys that are checked strictly: none unknown, no text where a number is due."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class LocatedSection(Section):
    """A section that can say later in which line of which file a key stands."""

    _origin: Origin = PrivateAttr(default_factory=Origin)

    def model_post_init(self, context: Any) -> None:
        """Keep the document that the section comes from."""
        if isinstance(context, Reading):
            self._origin = Origin(context.document)

    @property
    def document(self) -> YamlSource | None:
        """What the section was read from; None: it was not read."""
        return self._origin.document

    def origin(self, place: Place) -> tuple[str, int | None]:
        """Return file and line of a place in the whole configuration."""
        document = self.document
        return document.origin(place) if document else ("", None)


def existing_file(path: Path, folder: Path | None) -> Path:
    """Make a path absolute, from ``folder``, and see that a file is there.

    Raises ValueError where there is none. Without a folder the path is taken as it is.
    """
    absolute = (folder / path).resolve() if folder else path
    if absolute.is_dir():
        raise ValueError("is a folder; name a file in it")
    if folder and not absolute.is_file():
        raise ValueError(f"no such file (looked for {absolute})")
    return absolute


def existing_folder(path: Path, folder: Path | None) -> Path:
    """Make a path absolute, from ``folder``, and see that it is one; raises ValueError if not."""
    absolute = (folder / path).resolve() if folder else path
    if folder and not absolute.is_dir():
        raise ValueError(f"no such folder (looked for {absolute})")
    return absolute


def _folder(info: ValidationInfo) -> Path | None:
    return info.context.folder if isinstance(info.context, Reading) else None


def _input_file(path: Path, info: ValidationInfo) -> Path:
    return existing_file(path, _folder(info))


def _input_folder(path: Path, info: ValidationInfo) -> Path:
    return existing_folder(path, _folder(info))


def _own_folder(path: Path, info: ValidationInfo) -> Path:
    """Make the path of a folder absolute; it is made when it is needed."""
    folder = _folder(info)
    absolute = (folder / path.expanduser()).resolve() if folder else path
    if absolute.exists() and not absolute.is_dir():
        raise ValueError("is no folder")
    return absolute


def _server(url: str) -> str:
    if not re.fullmatch(r"https?://[^\s/?#@]+(/[^\s?#]*)?", url):
        raise ValueError("must be the address of a server, as https://host/path")
    return url


def _as_id(value: object) -> object:
    """Read a whole number as the text of an id."""
    if isinstance(value, bool | float) or value is None:
        raise ValueError("YAML takes this for something else than text; write the id in quotes")
    return str(value) if isinstance(value, int) else value


def _timetable(value: object) -> object:
    """Let a finite number pass, or pairs of them."""
    if _is_number(value):
        return value
    if isinstance(value, list | tuple) and value and all(map(_is_pair, value)):
        return tuple((float(time), float(number)) for time, number in value)
    raise ValueError("must be a finite number, or pairs [from_s, number], as [[0, 5], [3600, 8]]")


def _is_pair(value: object) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(map(_is_number, value))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


#: how an area begins that is written as WKT
POLYGON = re.compile(r"\s*(multi)?polygon\s*(z|m|zm)?\s*\(", re.IGNORECASE)


def _polygon(value: object, info: ValidationInfo) -> object:
    """Tell WKT from the path of a file, which must be there."""
    if not isinstance(value, str | Path):
        raise ValueError("must be the path of a GeoJSON or GeoPackage file, or WKT")
    if isinstance(value, str) and POLYGON.match(value):
        return value
    return existing_file(Path(value), _folder(info))


InputFile = Annotated[Path, Field(strict=False), AfterValidator(_input_file)]
InputFolder = Annotated[Path, Field(strict=False), AfterValidator(_input_folder)]
CacheFolder = Annotated[Path, Field(strict=False), AfterValidator(_own_folder)]
ServerUrl = Annotated[str, AfterValidator(_server)]
Id = Annotated[str, BeforeValidator(_as_id, json_schema_input_type=str | int)]
Ids = Annotated[tuple[Id, ...], Field(strict=False)]

#: a value for the whole time, or pairs (from when on in s, value)
TimetableKey = Annotated[
    float | tuple[tuple[float, float], ...],
    PlainValidator(_timetable, json_schema_input_type=float | list[tuple[float, float]]),
]
PolygonKey = Annotated[Path | str, PlainValidator(_polygon, json_schema_input_type=str)]


def scaled(timetable: float | tuple[tuple[float, float], ...], factor: float) -> Any:
    """Return a timetable whose values are multiplied, for another unit; its times stay."""
    if isinstance(timetable, tuple):
        return tuple((time, value * factor) for time, value in timetable)
    return timetable * factor


class ChosenLinks(Section):
    """Which links: by ids, by an expression on their columns, by area, by street; all must hold."""

    links: Ids = Field((), description="link_ids, as [a, b]")
    where: str | None = Field(
        None,
        description="expression on the columns of links, in SI units, as lanes >= 2 and "
        "free_speed > 13",
    )
    polygon: PolygonKey | None = Field(
        None, description="an area: GeoJSON or GeoPackage file, or WKT in the network's own CRS"
    )
    polygon_part: Literal["touching", "inside", "entering", "leaving"] = Field(
        "touching", description="which links of that area are meant"
    )
    street: Id | None = Field(
        None,
        description="name of the road, as column name of links has it; of joined links one of them",
    )

    @model_validator(mode="after")
    def _chooses(self) -> Self:
        given = (self.links or None, self.where, self.polygon, self.street)
        if all(one is None for one in given):
            raise ValueError("says of no link; give links, where, polygon or street")
        if self.polygon is None and self.polygon_part != "touching":
            raise ValueError("polygon_part needs a polygon")
        return self

    def target(self) -> Target:
        """Return what measures are told."""
        polygon = None if self.polygon is None else str(self.polygon)
        return Target(self.links, self.where, polygon, self.polygon_part, self.street)


class Period(Section):
    """When a measure is in force."""

    begin_s: float = Field(0.0, description="when it begins, s after the start")
    end_s: float | None = Field(
        None, description="when it ends, s after the start; none: it stays to the end of the run"
    )

    @property
    def end(self) -> float:
        """When it ends, s; inf where it does not."""
        return math.inf if self.end_s is None else self.end_s


def files_in(section: Section) -> Iterator[Path]:
    """Yield the files that a section and all in it name."""
    yield from named_files(section).values()


def named_files(value: object, name: str = "") -> dict[str, Path]:
    """Return the files that a section and all in it name, by the keys that do so: trips.0.file.

    Of folders, the files in them.
    """
    if isinstance(value, Path) and value.is_dir():
        return {f"{name}/{path.name}": path for path in sorted(value.iterdir()) if path.is_file()}
    if isinstance(value, Path):
        return {name: value}
    parts: Iterable[tuple[object, object]] = ()
    if isinstance(value, Section):
        parts = value
    elif isinstance(value, tuple):
        parts = enumerate(value)
    found: dict[str, Path] = {}
    for key, part in parts:
        found |= named_files(part, f"{name}.{key}" if name else str(key))
    return found

"""Every key of a study: its base, its scenarios, its seeds, and by whom the runs are done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from pipeline.config_file import At, keys_of_lists, read_config, validated
from pipeline.config_keys import InputFile, LocatedSection, Reading, Section
from pipeline.config_paths import rebased
from pipeline.sweep_config import SweepSection, add_points
from pipeline.yaml_source import YamlSource, put_value, read_assignment, read_yaml
from uxsim_geo.errors import Fault, Faults, InputError

#: seeds are nonnegative and fit in 63 bits, as simulate.seed
Seed = Annotated[int, Field(ge=0, lt=2**63)]


class UntilSection(Section):
    """How narrow the 95 % interval must be: of every scenario's difference from the base."""

    figure: str = Field(
        "total_delay_veh_h", description="name of the figure, a column of figures.csv"
    )
    half_width: float | None = Field(
        None, gt=0, description="half the width of the interval, in the figure's unit"
    )
    relative_half_width: float | None = Field(
        None, gt=0, description="the same as a share of the base's mean, as 0.02"
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if (self.half_width is None) == (self.relative_half_width is None):
            raise ValueError("needs half_width or relative_half_width, one of them")
        return self


class SeedsSection(Section):
    """Seeds are added, all scenarios alike, until the intervals are narrow enough."""

    until: UntilSection = Field(description="section: when there are enough")
    minimum: int = Field(5, ge=2, description="so many at first")
    step: int = Field(5, ge=1, description="so many more each time that they do not suffice")
    maximum: int = Field(50, ge=2, description="never more than these")

    @model_validator(mode="after")
    def _ascend(self) -> Self:
        if self.maximum < self.minimum:
            raise ValueError("maximum must not be below minimum")
        return self


def _form_of_seeds(value: object) -> str:
    if isinstance(value, list | tuple):
        return "[list]"
    return "[section]" if isinstance(value, dict | SeedsSection) else "[number]"


#: the tags have brackets, as all that names a form and not a key
SeedsKey = Annotated[
    Annotated[Annotated[int, Field(ge=1, le=100_000)], Tag("[number]")]
    | Annotated[Annotated[tuple[Seed, ...], Field(strict=False, min_length=1)], Tag("[list]")]
    | Annotated[SeedsSection, Tag("[section]")],
    Discriminator(_form_of_seeds),
]


class StudyConfig(LocatedSection):
    """Scenarios over one base, each simulated with the same seeds."""

    name: str = Field(
        pattern=r"^\w[\w.-]*$", description="of the study and its folder; none: the file's name"
    )
    base: InputFile = Field(description="configuration that the scenarios change")
    set: dict[str, Any] = Field(
        {}, description="keys of the base, as simulate.duration_s, with other values for all runs"
    )
    seeds: SeedsKey = Field(
        10,
        description="a number: simulate.seed of the base and those that follow; a list; or a "
        "section: as many as it takes",
    )
    scenarios: dict[str, Any] = Field({}, description="by name, the list of its edits")
    sweep: SweepSection | None = Field(
        None, description="section: keys of the base that take several values, beside the scenarios"
    )
    reports: Literal["none", "first_seed", "all"] = Field(
        "none", description="which runs get all that the section report of the base asks for"
    )
    comparison: Literal["full", "tables", "none"] = Field(
        "full", description="full: tables, layers, a page and pictures; tables: these alone; none"
    )
    scheduler: str = Field(
        "processes",
        pattern=r"^(none|processes|dask|(tcp|tls|ws|wss|inproc|ucx)://\S+)$",
        description="processes; none: one run after the other; dask: a cluster on this machine; "
        "or the address of a Dask scheduler, as tls://10.0.0.1:8786",
    )
    workers: int | None = Field(
        None, ge=1, description="processes on this machine; none: as many as it has cores"
    )

    @model_validator(mode="after")
    def _seeds_differ(self) -> Self:
        if isinstance(self.seeds, tuple) and len(set(self.seeds)) < len(self.seeds):
            raise ValueError("seeds: one is given twice; give each once")
        return self


@dataclass(frozen=True)
class StudyFile:
    """A study as it was read; ``base`` has what the study sets, and is not checked yet.

    given
        what the study says, with the values of the command line, before anything follows from it
    text
        of the file
    """

    path: Path
    config: StudyConfig
    reading: Reading
    base: Reading
    given: Mapping[str, Any]
    text: str

    def base_copy(self) -> Reading:
        """Return the base to be checked, which may change what was read."""
        return Reading(deepcopy(self.base.document), self.base.folder)


def read_study(path: Path, edits: Sequence[str] = (), seeds: int | None = None) -> StudyFile:
    """Read a study file and the configuration that it names.

    ``edits``: ``key.sub=value`` in place of what base and study say; ``seeds``: so many instead.
    Raises :class:`uxsim_geo.errors.InputError` with all faults of the file, at their lines.
    """
    document = read_yaml(path)
    document.values.setdefault("name", path.stem)
    _take_in_options(document, edits, seeds)
    text = path.read_bytes().decode("utf-8-sig")
    return study_of(path, Reading(document, path.resolve().parent), text)


def _take_in_options(document: YamlSource, edits: Sequence[str], seeds: int | None) -> None:
    """Write what the command line says into the document."""
    if seeds is not None:
        document.forget_origins(("seeds",))
        document.values["seeds"] = seeds
        document.origins[("seeds",)] = (f"--seeds {seeds}", None)
    values = document.values.setdefault("set", {})
    for edit in edits:
        dotted, value = read_assignment(edit)
        if not isinstance(values, dict):
            return  # that is told when the study is checked
        values[dotted] = value
        document.forget_origins(("set", dotted))
        document.origins[("set", dotted)] = (f"--set {edit}", None)


def study_of(path: Path, reading: Reading, text: str, base: Reading | None = None) -> StudyFile:
    """Check a study that was read; ``base`` None: the file that the study names.

    A base that is given has what the study sets already.

    Raises :class:`uxsim_geo.errors.InputError` as :func:`read_study`.
    """
    document, given = reading.document, deepcopy(reading.document.values)
    faults: list[Fault] = []
    config = validated(StudyConfig, document.values, reading, faults, At(model=StudyConfig))
    if config is None:
        raise InputError(faults)
    if config.sweep is not None:
        add_points(document, config.sweep)
    if base is None:
        base = read_config(config.base)
        _set_values(base, reading, config)
    return StudyFile(path, config, reading, base, given, text)


def _set_values(base: Reading, study: Reading, config: StudyConfig) -> None:
    found: list[Fault] = []
    for dotted, value in config.set.items():
        place = ("set", dotted)
        faults = Faults(study.document.source)
        keys = dotted.split(".")
        own = rebased(value, keys, study.folder)
        where = put_value(base.document, keys, own, faults, keys_of_lists())
        origin = study.document.origin(place)
        found += [Fault(f"set.{dotted}: {fault.what}", *origin) for fault in faults.found]
        base.document.take_origins(study.document, place, where)
    if found:
        raise InputError(found)

"""Keys of the edits of a study: of tables, and of control, settings and what scenarios share."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from pipeline.config_keys import ChosenLinks, Id, Ids, Period
from pipeline.control_config import ControlSection
from pipeline.control_config_flow import IncidentEntry, SignalEntry
from pipeline.edits_config import TableEdit


def _one_or_many(value: object) -> object:
    return value if isinstance(value, list | tuple) else [value]


Names = Annotated[Ids, BeforeValidator(_one_or_many, json_schema_input_type=Id | Ids)]
Signals = Annotated[
    tuple[SignalEntry, ...],
    Field(strict=False),
    BeforeValidator(_one_or_many, json_schema_input_type=SignalEntry | tuple[SignalEntry, ...]),
]


class CloseEdit(Period, ChosenLinks):
    """Nobody may enter some links, or some of their lanes are blocked, or some drivers kept out."""

    lanes: int | None = Field(
        None, ge=1, description="so many lanes of each link are blocked; none: the whole link"
    )
    classes: Ids = Field((), description="of drivers to whom it is closed; empty: to all")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.lanes is not None and self.classes:
            raise ValueError("lanes are blocked to all; leave classes out, or lanes")
        return self


class ReopenEdit(Period, ChosenLinks):
    """Closures and incidents of the base, or of edits before, do not hold on some links."""


class StudyEdit(TableEdit):
    """A change that makes a scenario of the base; of each entry one key."""

    build_on: Names | None = Field(
        None, description="names of scenarios whose edits are made first"
    )
    require: Names | None = Field(
        None, description="names of scenarios, all of which must be built on beside this one"
    )
    exclude: Names | None = Field(
        None, description="names of scenarios with which this one cannot be combined"
    )
    close: CloseEdit | None = Field(None, description="section: links or lanes closed")
    reopen: ReopenEdit | None = Field(None, description="section: links that are open after all")
    signal: Signals | None = Field(
        None, description="section, or list: plans in the place of those of their nodes"
    )
    incident: IncidentEntry | None = Field(None, description="section: lanes blocked")
    control: ControlSection | None = Field(
        None, description="section: measures beside those of the base, as simulate.control"
    )
    simulate: dict[str, Any] | None = Field(
        None, description="keys of the section simulate, with other values"
    )
    config: dict[str, Any] | None = Field(
        None, description="any keys of the configuration, as report.bin_s, with other values"
    )

    def table_edit(self) -> TableEdit | None:
        """Return it as an edit of the tables; None: it is none."""
        name = next(field for field in type(self).model_fields if getattr(self, field) is not None)
        if name not in TableEdit.model_fields:
            return None
        return TableEdit.model_construct(**{name: getattr(self, name)})

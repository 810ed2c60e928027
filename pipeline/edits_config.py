"""Keys of edits of the tables, which a configuration may hold: of each entry one is given."""

from __future__ import annotations

from typing import Any, Self

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from pipeline.config_keys import Section
from pipeline.edits_config_demand import (
    ReplaceDemandEdit,
    ScaleDemandEdit,
    ShiftDemandEdit,
)
from pipeline.edits_config_network import (
    AddLanesEdit,
    AddLinkEdit,
    AddNodeEdit,
    RemoveLinksEdit,
    RemoveSignalsEdit,
    ScaleEdit,
    SetEdit,
    TurnEdit,
)


class OneOf(Section):
    """A section with exactly one of its keys."""

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [key for key, value in self.written() if value is not None]
        if len(given) != 1:
            known = ", ".join(key for key, _ in self.written())
            found = f", and has {' and '.join(given)}" if given else ""
            raise ValueError(f"must have one of {known}{found}; each edit is an item of its own")
        return self

    @model_serializer(mode="wrap")
    def _without_others(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {key: value for key, value in handler(self).items() if value is not None}

    def written(self) -> list[tuple[str, Any]]:
        """Return every key as it is written, with its value."""
        fields = type(self).model_fields
        return [(key.alias or name, getattr(self, name)) for name, key in fields.items()]

    def only(self) -> tuple[str, Any]:
        """Return the key that is given, and its value."""
        return next((key, value) for key, value in self.written() if value is not None)


class TableEdit(OneOf):
    """A change of the network or the demand after they are read; of each entry one key."""

    set_: SetEdit | None = Field(None, alias="set", description="section: attributes of links")
    scale: ScaleEdit | None = Field(None, description="section: attributes of links, by factors")
    add: AddLanesEdit | None = Field(None, description="section: more or fewer lanes")
    add_link: AddLinkEdit | None = Field(None, description="section: a new link")
    remove_links: RemoveLinksEdit | None = Field(None, description="section: links taken out")
    add_node: AddNodeEdit | None = Field(None, description="section: a new node")
    ban_turn: TurnEdit | None = Field(None, description="section: a turn that nobody may make")
    allow_turn: TurnEdit | None = Field(None, description="section: a turn that is banned no more")
    remove_signals: RemoveSignalsEdit | None = Field(
        None, description="section: nodes without their signals"
    )
    scale_demand: ScaleDemandEdit | None = Field(None, description="section: more or fewer trips")
    shift_demand: ShiftDemandEdit | None = Field(None, description="section: trips at other times")
    replace_demand: ReplaceDemandEdit | None = Field(
        None, description="section: trips of another source"
    )

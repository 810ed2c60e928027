"""What an import assumed or repaired, one row a thing, for the layer ``import_notes``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import pandas as pd

from uxsim_geo.network.network import NOTE_COLUMNS, Network

Element = Literal["node", "link", "demand", "network"]
Severity = Literal["info", "warning", "doubt"]


@dataclass
class Notes:
    """Collects notes in the order in which they are made; every column of the table is text."""

    rows: list[tuple[str, str | None, str, str, str, str | None]] = field(default_factory=list)

    def add(
        self,
        topic: str,
        note: str,
        *,
        element: Element = "network",
        severity: Severity = "info",
        value: object = None,
    ) -> None:
        """Note something that concerns the whole (network, demand) or a kind of element."""
        self.rows.append((element, None, topic, severity, note, _text(value)))

    def add_each(
        self,
        topic: str,
        note: str,
        ids: Sequence[str],
        *,
        element: Element = "link",
        values: Sequence[object] | None = None,
    ) -> None:
        """Note the same of every element in ``ids``, with the value that each had in the file."""
        found = [None] * len(ids) if values is None else list(values)
        for element_id, value in zip(ids, found, strict=True):
            self.rows.append((element, element_id, topic, "info", note, _text(value)))

    def warn_each(
        self, topic: str, note: str, ids: Sequence[str], values: Sequence[object]
    ) -> None:
        """Warn of the same on every link in ``ids``, with the value that was put in its place."""
        for link_id, value in zip(ids, values, strict=True):
            self.rows.append(("link", link_id, topic, "warning", note, _text(value)))

    def doubt_each(
        self,
        topic: str,
        note: str,
        ids: Sequence[str],
        values: Sequence[object],
        *,
        element: Element = "link",
    ) -> None:
        """Note a doubt about every element in ``ids``, with the value that gives rise to it."""
        for element_id, value in zip(ids, values, strict=True):
            self.rows.append((element, element_id, topic, "doubt", note, _text(value)))

    def add_table(self, notes: pd.DataFrame) -> None:
        """Take over notes that were made elsewhere, a table as :meth:`table` gives."""
        self.rows += list(notes[list(NOTE_COLUMNS)].itertuples(index=False, name=None))

    def table(self) -> pd.DataFrame:
        """One row a note, columns :data:`NOTE_COLUMNS`."""
        return pd.DataFrame(self.rows, columns=list(NOTE_COLUMNS)).astype("str")


def with_notes_in_front(network: Network, notes: Notes) -> Network:
    """Return the network with notes that come before its own."""
    table = pd.concat([notes.table(), network.notes], ignore_index=True)
    return replace(network, notes=table)


def _text(value: object) -> str | None:
    if value is None or isinstance(value, str):
        return value
    return f"{value:.6g}" if isinstance(value, float) else str(value)

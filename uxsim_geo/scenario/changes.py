"""What edits change, one row an attribute of an element: from what to what."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd

#: columns of a table of changes; before and after are text, null where there is nothing
CHANGE_COLUMNS = ("element", "id", "attribute", "before", "after")

Element = Literal["link", "node", "turn", "demand"]

#: attribute of elements that come or go: ``exists`` before or after, and not the other time
EXISTS = "exists"


@dataclass
class Changes:
    """Collects changes in the order in which they are made."""

    rows: list[tuple[Element, str, str, str | None, str | None]] = field(default_factory=list)

    def add(
        self, element: Element, id_: str, attribute: str, before: object, after: object
    ) -> None:
        """Note a change; what stays as it is is none."""
        told = (_text(before), _text(after))
        if told[0] != told[1]:
            self.rows.append((element, id_, attribute, *told))

    def add_each(
        self,
        ids: Iterable[str],
        attribute: str,
        before: Sequence[object] | np.ndarray,
        after: Sequence[object] | np.ndarray,
    ) -> None:
        """Note the changes of an attribute of links."""
        for id_, one, other in zip(ids, before, after, strict=True):
            self.add("link", str(id_), attribute, one, other)

    def table(self) -> pd.DataFrame:
        """One row a change, columns :data:`CHANGE_COLUMNS`."""
        return pd.DataFrame(self.rows, columns=list(CHANGE_COLUMNS)).astype("str")


def _text(value: object) -> str | None:
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return None
    return f"{value:.10g}" if isinstance(value, float) else str(value)

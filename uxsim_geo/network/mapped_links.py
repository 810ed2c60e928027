"""The attributes of links from the rows of a table, for one direction or both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.mapped_options import BACKWARD, ColumnMapping, Direction, Source
from uxsim_geo.network.mapped_values import Numbers, Rows, cell_text, ids, numbers, texts
from uxsim_geo.network.notes import Notes

#: veh/m of one lane, where nothing is mapped
JAM_DENSITY = 0.2


def links_of_rows(rows: Rows, mapping: ColumnMapping, notes: Notes) -> pd.DataFrame:
    """One row a row of the table: the shared columns, and what becomes of both directions.

    way is 1 along the line, -1 against it, 0 both (then ``both_ways``); ``..._backward`` hold for
    the second direction; row_id is the link_id before it was doubled. Ends and geometry are not
    there yet; lengths are NaN where the table has none.
    """
    way = _ways(rows, mapping.direction)
    table = pd.DataFrame({"link_id": pd.Series(_link_ids(rows, mapping, notes), dtype="str")})
    length = mapping.source("length")
    nothing = np.full(len(rows), np.nan)
    table["length"] = nothing if length is None else numbers(rows, "length", length).values
    attributes = _attributes(Side(rows, mapping, way), notes)
    table = table.join(attributes)
    if any(name in mapping.links for name in BACKWARD):
        backward = _attributes(Side(rows, mapping, way, "_backward"), Notes())
        # a row against its line alone has what is said of the backward direction
        forward = pd.Series(way >= 0)
        for name in backward.columns:
            table[name] = attributes[name].where(forward, backward[name])
        table = table.join(backward.add_suffix("_backward"))
    for name in ("road_class", "name"):
        source = mapping.source(name)
        found = [None] * len(rows) if source is None else texts(rows, source)
        table[name] = pd.Series(found, dtype="str")
    table["source_id"] = table["row_id"] = table["link_id"]
    for name in mapping.keep:
        table[f"file_{name}"] = rows.table[name].to_numpy()
    return table.assign(way=way, both_ways=way == 0)


def _link_ids(rows: Rows, mapping: ColumnMapping, notes: Notes) -> list[str]:
    source = mapping.source("link_id")
    if source is None:
        notes.add("links numbered", "link_id is the number of the row, counted from 1")
        return [str(number) for number in range(1, len(rows) + 1)]
    found = ids(rows, source, "link_id")
    for row in np.flatnonzero(pd.Series(found).duplicated()).tolist():
        if found[row]:
            rows.add("stands on an earlier row too", row, str(source.column), found[row])
    return found


def _ways(rows: Rows, direction: Direction | None) -> np.ndarray:
    """1 along the line, -1 against it, 0 both."""
    if direction is None:
        return np.ones(len(rows), dtype=np.int64)
    meaning: dict[str | None, int] = {}
    for way, values in ((1, direction.forward), (-1, direction.backward), (0, direction.both)):
        meaning |= {None if value is None else str(value): way for value in values}
    ways = np.ones(len(rows), dtype=np.int64)
    for row, cell in enumerate(rows.table[direction.column].tolist()):
        text = cell_text(cell)
        if text in meaning:
            ways[row] = meaning[text]
        else:
            known = ", ".join("empty" if value is None else value for value in meaning)
            what = f"is none of the values that the mapping knows, {known}"
            rows.add(what, row, direction.column, "" if text is None else text)
    return ways


@dataclass(frozen=True)
class Side:
    """One direction of the rows: ``suffix`` is that of what the mapping says of it, if anything."""

    rows: Rows
    mapping: ColumnMapping
    way: npt.NDArray[np.int64]
    suffix: str = ""

    def source(self, name: str) -> tuple[Source | None, Rows]:
        """Where a column comes from; what the other direction shares with it is told there."""
        own = self.mapping.source(name + self.suffix)
        if own is not None or not self.suffix:
            return own, self.rows
        return self.mapping.source(name), Rows(self.rows.table, Faults())

    def needs(self, name: str) -> npt.NDArray[np.bool_]:
        """Which rows need a value of the column that is said of this direction."""
        if self.suffix:
            return self.way <= 0
        if f"{name}_backward" in self.mapping.links:
            return self.way >= 0
        return np.ones(len(self.way), dtype=bool)


def _attributes(side: Side, notes: Notes) -> pd.DataFrame:
    """Lanes to merge_priority of one direction, and where lanes and speeds come from."""
    lanes = _lanes(side, notes)
    speed = _needed(side, "free_speed", notes)
    return pd.DataFrame(
        {
            "lanes": lanes.values,
            "free_speed": speed.values,
            "jam_density": _optional(side, "jam_density", JAM_DENSITY, lanes.values),
            "capacity": _optional(side, "capacity", np.nan, lanes.values),
            "merge_priority": _optional(side, "merge_priority", lanes.values, lanes.values),
            "lanes_source": _given(lanes.assumed),
            "free_speed_source": _given(speed.assumed),
        }
    )


def _given(assumed: np.ndarray) -> pd.Series:
    return pd.Series(np.where(assumed, "assumed", "given"), dtype="str")


def _needed(side: Side, name: str, notes: Notes) -> Numbers:
    """Numbers of which every row needs one."""
    source, rows = side.source(name)
    assert source is not None, "the mapping names what is needed"
    found = numbers(rows, name, source)
    for row in np.flatnonzero(found.empty & side.needs(name)).tolist():
        what = f"needs a value, or the mapping of {name} a missing"
        rows.add(what, row, str(source.column))
    if found.assumed.any():
        note = f"{name} of the mapping, by its constant, values or missing; value: links"
        topic = f"{name.replace('_', ' ')} assumed"
        notes.add(topic, note, element="link", value=int(found.assumed.sum()))
    return found


def _lanes(side: Side, notes: Notes) -> Numbers:
    """Lanes of one direction; half of the road's, rounded up, where the table counts both."""
    found = _needed(side, "lanes", notes)
    source, rows = side.source("lanes")
    assert source is not None, "the mapping names lanes"
    for row in np.flatnonzero(found.values % 1 > 0).tolist():
        value = found.values[row]
        rows.add("must be a whole number of lanes", row, str(source.column), f"{value:g}")
    if side.mapping.lanes_of == "direction":
        return found
    both = (side.way == 0) & (source.column is not None)
    odd = int((both & (found.values % 2 == 1)).sum())
    if odd:
        note = "odd lanes on a two-way row: each direction has half, rounded up; value: rows"
        notes.add("lanes halved", note, element="link", severity="warning", value=odd)
    return found._replace(values=np.where(both, np.ceil(found.values / 2), found.values))


def _optional(side: Side, name: str, default: float | np.ndarray, lanes: np.ndarray) -> np.ndarray:
    source, rows = side.source(name)
    if source is None:
        return np.full(len(rows), default)
    values = numbers(rows, name, source, lanes).values
    return np.where(np.isnan(values), default, values)

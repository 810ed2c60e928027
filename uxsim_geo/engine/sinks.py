"""Where the events of a run go while it goes on: into memory, or into a file."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.engine.records import EVENT
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.events import COLUMNS, PIECE, EventFile, EventLog, EventTable, Piece, dtype_of
from uxsim_geo.files import replace_when_complete

Ints = npt.NDArray[np.int64]
Records = npt.NDArray[Any]

_FIRST_BLOCK, _LARGEST_BLOCK = 1 << 14, 1 << 21  # rows; the largest give memory back when they go


class EventSink(Protocol):
    """What takes the events of one run, buffer by buffer.

    ``writing_s`` are the seconds that it has spent on a file so far.
    """

    writing_s: float

    def begin(self, row_of_link: Ints, link_ids: pd.Index[str]) -> None:
        """Be told what the links of the events are: rows of the links table, and their ids."""

    def add(self, events: Records) -> None:
        """Take events, which are overwritten afterwards."""

    def records(self) -> Records:
        """All events so far, as they came."""

    def log(self, rest: Sequence[Records], *, last: bool) -> EventLog:
        """Everything so far, and behind it ``rest``, of those on the road; ``last``: for good."""


class InMemory:
    """Keeps events in blocks, and makes one table of them at the end without holding both."""

    writing_s = 0.0

    def __init__(self) -> None:
        self._blocks: deque[Records] = deque()
        self._used = 0  # rows of the last block
        self._log: EventTable | None = None  # which the blocks have become

    def begin(self, row_of_link: Ints, link_ids: pd.Index[str]) -> None:
        """Be told what the links of the events are."""
        self._row_of_link, self._link_ids = row_of_link, link_ids

    def add(self, events: Records) -> None:
        """Copy events behind those before."""
        if events.size:
            self._go_on()
        while events.size:
            room = self._blocks[-1].size - self._used if self._blocks else 0
            if room == 0:
                self._blocks.append(np.empty(self._size_of_next(), EVENT))
                self._used, room = 0, self._blocks[-1].size
            some, events = events[:room], events[room:]
            self._blocks[-1][self._used : self._used + some.size] = some
            self._used += some.size

    def records(self) -> Records:
        """All events so far, as they came."""
        self._go_on()
        return np.concatenate([np.empty(0, EVENT), *self._filled()])

    def log(self, rest: Sequence[Records], *, last: bool) -> EventLog:
        """Make a table; at the last, block by block goes as its rows come into the table."""
        self._go_on()
        blocks = self._filled()
        self._rows = sum(block.size for block in blocks)
        blocks.extend(rest)
        columns = _new_columns(sum(block.size for block in blocks), self._link_ids)
        if last:
            self._blocks.clear()
        first = 0
        while blocks:
            first = _put(columns, first, blocks.popleft(), self._row_of_link)
        table = _table(columns, self._link_ids)
        if last:
            self._log = EventTable(table)
        # pandas copies what two share only when one of them is changed
        return EventTable(table.copy(deep=False))

    def _filled(self) -> deque[Records]:
        """The blocks, and of the last one what is used."""
        blocks = self._blocks.copy()
        if blocks:
            blocks.append(blocks.pop()[: self._used])
        return blocks

    def _size_of_next(self) -> int:
        return min(2 * self._blocks[-1].size, _LARGEST_BLOCK) if self._blocks else _FIRST_BLOCK

    def _go_on(self) -> None:
        """Take back what has become a table: a run can go on after its end, with more demand."""
        if self._log is None:
            return
        log, self._log = self._log, None
        position = np.empty(len(self._row_of_link), np.int64)
        position[self._row_of_link] = np.arange(position.size)
        events = np.empty(self._rows, EVENT)
        whole = log.some(*COLUMNS)
        for field, name in zip(EVENT.names or (), COLUMNS, strict=True):
            values = whole[name][: self._rows]
            events[field] = position[values] if name == "link" else values
        self.add(events)


class ToFile:
    """Writes events to a Parquet file, a row group whenever so many rows have come.

    Row groups begin and end where the number of rows says, so that the bytes do not depend on how
    the run was cut.
    """

    def __init__(self, path: Path, rows: int = PIECE) -> None:
        self.writing_s = 0.0
        self.complete = False
        self._path, self._rows = path, rows
        self._used = 0  # rows of the row group under way
        self._writer: Any = None

    def begin(self, row_of_link: Ints, link_ids: pd.Index[str]) -> None:
        """Open the file, now that it is known what its links are."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        self._row_of_link, self._link_ids = row_of_link, link_ids
        self._group = _new_columns(self._rows, link_ids)
        like = _table(_new_columns(0, link_ids), link_ids)
        self._schema = pa.Schema.from_pandas(like, preserve_index=False)
        self._dictionary = pa.array(link_ids, self._schema.field("link").type.value_type)
        self._writer = pq.ParquetWriter(
            self._path, self._schema, compression="zstd", use_dictionary=["link"]
        )

    def add(self, events: Records) -> None:
        """Put events into the row group under way; write it, and begin another, when it is full."""
        while events.size:
            some, events = np.split(events, [self._rows - self._used])
            self._used = _put(self._group, self._used, some, self._row_of_link)
            if self._used == self._rows:
                self._write()

    def records(self) -> Records:
        """Refuse: they are in the file."""
        what = "its events go to a file as they come: a run that is to be saved keeps them"
        raise InputError([Fault(what, str(self._path))])

    def log(self, rest: Sequence[Records], *, last: bool) -> EventLog:
        """Complete the file. Raises :class:`InputError` unless the run has come to its end."""
        if not last:
            what = "its events go to a file as they come: it has a result at its end"
            raise InputError([Fault(what, str(self._path))])
        for events in rest:
            self.add(events)
        self._write()
        self.close()
        self.complete = True
        return EventFile(self._path, self._link_ids)

    def close(self) -> None:
        """Let go of the file, complete or not."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    def _write(self) -> None:
        import pyarrow as pa

        if self._used == 0:
            return
        started = time.perf_counter()
        columns = {name: values[: self._used] for name, values in self._group.items()}
        arrays = [pa.array(columns[name], from_pandas=True) for name in COLUMNS]
        arrays[COLUMNS.index("link")] = pa.DictionaryArray.from_arrays(
            columns["link"], self._dictionary
        )
        table = pa.Table.from_arrays(arrays, schema=self._schema)
        self._writer.write_table(table, row_group_size=self._rows)
        self._used = 0
        self.writing_s += time.perf_counter() - started


@contextmanager
def to_file(path: Path, rows: int = PIECE) -> Iterator[ToFile]:
    """Write events to a file, which appears under its name when the run is complete."""
    with replace_when_complete(path) as temporary:
        sink = ToFile(temporary, rows)
        try:
            yield sink
        finally:
            sink.close()
        if not sink.complete:
            raise InputError([Fault("the run has not been brought to its end", str(path))])


def _new_columns(rows: int, link_ids: pd.Index[str]) -> Piece:
    return {name: np.empty(rows, dtype_of(name, len(link_ids))) for name in COLUMNS}


def _put(columns: Piece, first: int, events: Records, row_of_link: Ints) -> int:
    """Put events into the rows of columns from ``first`` on; return the row behind them."""
    fields = (events["trip"], row_of_link[events["link"]], events["enter"], events["exit"])
    for name, values in zip(COLUMNS, fields, strict=True):
        columns[name][first : first + events.size] = values
    return first + events.size


def _table(columns: Piece, link_ids: pd.Index[str]) -> pd.DataFrame:
    link: Any = pd.Categorical.from_codes(columns["link"], categories=link_ids)
    return pd.DataFrame({**columns, "link": link}, copy=False)

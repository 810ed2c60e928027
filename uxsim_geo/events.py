"""Link entries of a run, in memory or in a file: read in pieces, so that they need not fit at once.

Rows stand in the order of the exits, those without an exit last, link by link. Both kinds of log
give the same pieces' worth of rows in the same order, so that what is summed over them row after
row does not depend on how they are cut.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Fault, Faults, InputError

#: rows of a piece at most, and of a row group of a file
PIECE = 1 << 18

COLUMNS = ("vehicle", "link", "enter_s", "exit_s")

#: columns by name, all of one length; ``link`` holds rows of the links table
Piece = dict[str, npt.NDArray[Any]]

Booleans = npt.NDArray[np.bool_]


class EventLog(ABC):
    """One row a link entry: vehicle (row of the trips), link, enter_s, exit_s (NaN while on it).

    ``link_ids`` are those of all links, in the order of the links table.
    """

    link_ids: pd.Index[str]

    @abstractmethod
    def __len__(self) -> int:
        """How many rows there are."""

    @abstractmethod
    def pieces(self, *names: str) -> Iterator[Piece]:
        """Give some columns, piece by piece."""

    def some(
        self, *names: str, links: Booleans | None = None, vehicles: Booleans | None = None
    ) -> Piece:
        """Some columns of the entries to some links, of some vehicles, in their order.

        ``links`` says of each row of the links table whether it is one of them, ``vehicles`` of
        each trip; None: all.
        """
        if links is None and vehicles is None:
            return self._all(names)
        asked = {"link": links, "vehicle": vehicles}
        chosen = {name: flags for name, flags in asked.items() if flags is not None}
        found: dict[str, list[npt.NDArray[Any]]] = {name: [] for name in names}
        for piece in self.pieces(*dict.fromkeys((*names, *chosen))):
            rows = np.ones(len(next(iter(piece.values()))), bool)
            for name, flags in chosen.items():
                rows &= flags[piece[name]]
            for name in names:
                found[name].append(piece[name][rows])
        nothing = {name: np.empty(0, dtype_of(name, len(self.link_ids))) for name in names}
        return {name: np.concatenate([nothing[name], *parts]) for name, parts in found.items()}

    def table(self) -> pd.DataFrame:
        """All of it in memory; links are categories in the order of the links table."""
        columns: dict[str, Any] = self.some(*COLUMNS)
        link = pd.Categorical.from_codes(columns["link"], categories=self.link_ids)
        return pd.DataFrame(columns | {"link": link}, copy=False)

    def _all(self, names: tuple[str, ...]) -> Piece:
        whole = {name: np.empty(len(self), dtype_of(name, len(self.link_ids))) for name in names}
        first = 0
        for piece in self.pieces(*names):
            last = first + len(piece[names[0]])
            for name in names:
                whole[name][first:last] = piece[name]
            first = last
        return whole


class EventTable(EventLog):
    """Link entries in memory: a table of those columns, link_ids as categories."""

    def __init__(self, table: pd.DataFrame, *, piece: int = PIECE) -> None:
        self._table = table
        self._piece = piece
        link = table["link"].array
        # not copied where it is one: that takes time and memory
        self._link = link if isinstance(link, pd.Categorical) else pd.Categorical(link)
        self.link_ids = self._link.categories.astype(str)

    def __len__(self) -> int:
        """How many rows there are."""
        return len(self._table)

    def pieces(self, *names: str) -> Iterator[Piece]:
        """Give some columns, piece by piece."""
        columns = {
            name: self._link.codes if name == "link" else self._table[name].to_numpy()
            for name in names
        }
        for first in range(0, len(self), self._piece):
            rows = slice(first, first + self._piece)
            yield {name: values[rows] for name, values in columns.items()}

    def table(self) -> pd.DataFrame:
        """Return the table itself."""
        return self._table


class EventFile(EventLog):
    """Link entries in a Parquet file, of which a row group is in memory at a time.

    Raises :class:`uxsim_geo.errors.InputError` for a file that is absent or holds something else,
    now or while it is read.
    """

    def __init__(self, path: Path, link_ids: pd.Index[str]) -> None:
        import pyarrow.parquet as pq

        self.path, self.link_ids = path, link_ids
        self._names: Any = None  # what the codes of the last row group stood for
        self._rows = np.empty(0, np.int64)  # the rows of the links table that those are
        with _faults_told(path), pq.ParquetFile(path) as file:
            self._length = int(file.metadata.num_rows)
            lacking = [name for name in COLUMNS if name not in file.schema_arrow.names]
        faults = Faults(str(path))
        for name in lacking:
            faults.add("lacks this column: is it the events of a run?", column=name)
        faults.raise_if_any()

    def __len__(self) -> int:
        """How many rows there are."""
        return self._length

    def pieces(self, *names: str) -> Iterator[Piece]:
        """Give some columns, row group by row group."""
        import pyarrow.parquet as pq

        with _faults_told(self.path), pq.ParquetFile(self.path) as file:
            for group in range(file.num_row_groups):
                read = file.read_row_group(group, columns=list(names))
                yield {name: self._values(name, read.column(name)) for name in names}

    def _values(self, name: str, column: Any) -> npt.NDArray[Any]:
        """A column of a row group as an array; an exit that is null is NaN."""
        if name != "link":
            values: npt.NDArray[Any] = column.to_numpy()
            return values
        # another program may have written the file again, with plain text
        whole = column.dictionary_encode().unify_dictionaries().combine_chunks()
        if self._names is None or not whole.dictionary.equals(self._names):
            self._names = whole.dictionary
            names = pd.Index(self._names.to_pandas().astype(str))
            self._rows = self.link_ids.get_indexer(names).astype(np.int64)
            check_known(names[self._rows < 0])
        rows: npt.NDArray[np.int64] = self._rows[whole.indices.to_numpy()]
        return rows


def dtype_of(name: str, links: int) -> np.dtype[Any]:
    """The type of a column in memory; that of the links depends on how many there are."""
    if name == "link":
        return np.dtype(pd.Categorical.from_codes([], categories=pd.RangeIndex(links)).codes.dtype)
    return np.dtype(np.int32 if name == "vehicle" else np.float64)


def check_known(strange: pd.Index[str]) -> None:
    """Raise for links that events name and the network does not."""
    if len(strange):
        faults = Faults("events")
        faults.add("its links are not those of the network: is it of another run?", column="link")
        faults.raise_if_any()


@contextmanager
def _faults_told(path: Path) -> Iterator[None]:
    """Tell of a file that cannot be read as its user can understand."""
    import pyarrow as pa

    try:
        yield
    except FileNotFoundError:
        raise InputError([Fault(f"{path}: there is no such file")]) from None
    except (OSError, pa.ArrowException) as error:
        raise InputError([Fault(f"{path}: is not a Parquet table: {error}")]) from None

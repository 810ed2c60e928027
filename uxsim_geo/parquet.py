"""Tables in Parquet files whose bytes depend on nothing but the table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from uxsim_geo.damage import damage_as_fault
from uxsim_geo.errors import Faults
from uxsim_geo.files import replace_when_complete

#: how a file that is none is told
NO_TABLE = "is not a Parquet table"

#: bytes to which a table from elsewhere may unpack, whatever its size, and as a multiple of it
_LEAST_BYTES = 300_000_000
_RATIO = 50


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write a table, as GeoParquet if it has geometry; ``path`` appears when it is complete."""
    with replace_when_complete(path) as temporary:
        table.to_parquet(temporary, index=False, compression="zstd")


def read_tables(*paths: Path) -> list[pd.DataFrame]:
    """Read tables, with their geometry and CRS if they have them.

    Raises :class:`uxsim_geo.errors.InputError` naming every file that is absent or no table.
    """
    faults = Faults()
    found = [_read_table(path, faults) for path in paths]
    faults.raise_if_any()
    return [table for table in found if table is not None]


def _read_table(path: Path, faults: Faults) -> pd.DataFrame | None:
    """One of them; None, with a fault, if it cannot be read."""
    import pyarrow.parquet as pq

    own = Faults(str(path))
    table: pd.DataFrame | None = None
    with damage_as_fault(own, NO_TABLE):
        if b"geo" in (pq.read_schema(path).metadata or {}):
            import geopandas

            table = geopandas.read_parquet(path)
        else:
            table = pd.read_parquet(path)
    faults.extend(own)
    return table


def check_parquet(path: Path, faults: Faults) -> bool:
    """Whether a file from elsewhere is a Parquet table that can be taken in; else with a fault.

    Text must be UTF-8, which Arrow takes on trust; and as a value that stands in millions of rows
    is written once, the file must not unpack to far more than such files do.
    """
    import pyarrow.parquet as pq

    before = len(faults.found)
    with damage_as_fault(faults, NO_TABLE):
        schema, about = pq.read_schema(path), pq.read_metadata(path)
        most = max(_LEAST_BYTES, _RATIO * path.stat().st_size)
        texts = [one.name for one in schema if _is_text(one.type)]
        size = 8 * sum(
            about.row_group(group).column(column).num_values
            for group in range(about.num_row_groups)
            for column in range(about.num_columns)
        )
        if size <= most:
            table = pq.ParquetFile(path, read_dictionary=texts).read()
            table.validate(full=True)
            size += sum(map(_unpacked_size, table.columns))
        if size > most:
            faults.add(
                f"unpacks to {size / 1e6:,.0f} MB, which is far more than such files do: is it "
                "damaged? If not, write it without dictionaries"
            )
    return len(faults.found) == before


def _is_text(kind: Any) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_string(kind) or pa.types.is_binary(kind))


def _unpacked_size(column: Any) -> int:
    """Bytes of a column when every value stands for itself."""
    import pyarrow as pa
    import pyarrow.compute as pc

    size = 0
    for chunk in column.chunks:
        if pa.types.is_dictionary(chunk.type):
            lengths = pc.binary_length(chunk.dictionary)
            size += pc.sum(pc.cast(lengths.take(chunk.indices), pa.int64())).as_py() or 0
        else:
            size += chunk.nbytes
    return size

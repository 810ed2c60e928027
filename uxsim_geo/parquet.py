"""Tables in Parquet files whose bytes depend on nothing but the table."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.files import replace_when_complete


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
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        if b"geo" in (pq.read_schema(path).metadata or {}):
            import geopandas

            table: pd.DataFrame = geopandas.read_parquet(path)
            return table
        return pd.read_parquet(path)
    except FileNotFoundError:
        faults.add(f"{path}: there is no such file")
    except (OSError, pa.ArrowException) as error:
        faults.add(f"{path}: is not a Parquet table: {error}")
    return None

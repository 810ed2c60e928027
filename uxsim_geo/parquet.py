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


def read_table(path: Path, faults: Faults) -> pd.DataFrame | None:
    """Read a table, with its geometry and CRS if it has them; None, with a fault, if it is none."""
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

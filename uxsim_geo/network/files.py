"""Network tables on disk: one GeoParquet file a table, the same tables giving the same bytes."""

from __future__ import annotations

from pathlib import Path

from uxsim_geo.network.network import Network
from uxsim_geo.parquet import read_tables, write_table

#: by the field of :class:`uxsim_geo.network.network.Network` that each file holds
FILES = {
    "nodes": "nodes.parquet",
    "links": "links.parquet",
    "movements": "movements.parquet",
    "notes": "import_notes.parquet",
}


def write_network(network: Network, folder: Path) -> list[Path]:
    """Write the four tables into ``folder`` (made if absent); the paths written.

    Tables with geometry carry their CRS, or explicitly none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for table, name in FILES.items():
        write_table(getattr(network, table), folder / name)
        paths.append(folder / name)
    return paths


def read_network(folder: Path) -> Network:
    """Read what :func:`write_network` wrote.

    Raises :class:`InputError` naming every file that is absent or is no such table.
    """
    tables = read_tables(*(folder / name for name in FILES.values()))
    return Network(**dict(zip(FILES, tables, strict=True)))

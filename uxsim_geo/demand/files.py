"""Demand on disk: demand.parquet, with its notes and the changes of its platoons beside it."""

from __future__ import annotations

from pathlib import Path

from uxsim_geo.demand.demand import Demand
from uxsim_geo.parquet import read_tables, write_table


def notes_path(path: Path) -> Path:
    """Where the notes of the demand in ``path`` lie: ``demand_notes.parquet``."""
    return path.with_name(f"{path.stem}_notes{path.suffix}")


def changes_path(path: Path) -> Path:
    """Where the changes of the demand in ``path`` lie, if any: ``demand_changes.parquet``."""
    return path.with_name(f"{path.stem}_changes{path.suffix}")


def write_demand(demand: Demand, path: Path) -> list[Path]:
    """Write the table to ``path`` (``.../demand.parquet``), its notes, and its changes if any.

    Returns the paths written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    tables = {path: demand.table, notes_path(path): demand.notes}
    changes_path(path).unlink(missing_ok=True)
    if len(demand.changes):
        tables[changes_path(path)] = demand.changes
    for file, table in tables.items():
        write_table(table, file)
    return list(tables)


def read_demand(path: Path) -> Demand:
    """Read what :func:`write_demand` wrote.

    Raises :class:`InputError` naming every file that is absent or is no such table.
    """
    changes = [changes_path(path)] if changes_path(path).is_file() else []
    return Demand(*read_tables(path, notes_path(path), *changes))

"""Demand on disk: demand.parquet, with its notes beside it."""

from __future__ import annotations

from pathlib import Path

from uxsim_geo.demand.demand import Demand
from uxsim_geo.parquet import read_tables, write_table


def notes_path(path: Path) -> Path:
    """Where the notes of the demand in ``path`` lie: ``demand_notes.parquet``."""
    return path.with_name(f"{path.stem}_notes{path.suffix}")


def write_demand(demand: Demand, path: Path) -> list[Path]:
    """Write the table to ``path`` (``.../demand.parquet``) and its notes; the paths written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_table(demand.table, path)
    write_table(demand.notes, notes_path(path))
    return [path, notes_path(path)]


def read_demand(path: Path) -> Demand:
    """Read what :func:`write_demand` wrote.

    Raises :class:`InputError` naming every file that is absent or is no such table.
    """
    return Demand(*read_tables(path, notes_path(path)))

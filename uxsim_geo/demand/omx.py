"""OD matrices in OMX files: HDF5 with one matrix a core, and the names of zones as lookups.

The layout (OMX 0.2): attributes ``OMX_VERSION`` and ``SHAPE`` at the root; cores as
two-dimensional sets in the group ``data``, all of that shape; names of zones, if any, as
one-dimensional sets in the group ``lookup``. See https://github.com/osPlanning/omx/wiki.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.damage import damage_as_fault
from uxsim_geo.demand.hdf5_guard import has_endless_heap
from uxsim_geo.demand.od_table import CLASS, TIMES, OdTable, check_od, ordered
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes

#: cells of one core; more would take a GB and more
MOST_CELLS = 100_000_000

#: cells with trips of one core, whatever the size of the file, which has a byte or more for each
MOST_TRIPS = 4_000_000

#: bytes of one value, or of one chunk
MOST_BYTES = 200_000_000

#: cells that are read at once
BLOCK = 4_000_000


@dataclass(frozen=True)
class OmxCore:
    """A core of an OMX file, and what the file does not say of it.

    name
        of the core
    driver_class
        the class of its vehicles; None: the default
    start_s, end_s
        s after the start of the simulation, between which they depart; None: the period of the
        whole table is given later
    """

    name: str
    driver_class: str | None = None
    start_s: float | None = None
    end_s: float | None = None


def read_omx(path: Path, cores: Sequence[OmxCore] = (), *, lookup: str | None = None) -> OdTable:
    """Read cores of an OMX file as one OD table; needs the package h5py.

    ``cores`` may be left out if the file has only one. ``lookup`` names the zones; left out, it
    is the only one, and in a file without any zones are numbered from 1. Cells that are zero, or
    the core's own value for nothing (attribute ``NA``), are no trips.

    Raises :class:`uxsim_geo.errors.InputError` with everything wrong: cores and lookups that are
    not there, matrices that are not square or of another size, times of some cores only, zones
    named twice, cells that are no number of vehicles; and if h5py is not installed.
    """
    faults, notes = Faults(str(path)), Notes()
    _add_time_faults(cores, faults)
    tables = _read(path, cores, lookup, (faults, notes))
    faults.raise_if_any()
    table = pd.concat(tables, ignore_index=True)
    table.index = pd.RangeIndex(1, len(table) + 1, name="row")
    if table[CLASS].isna().all():
        table = table.drop(columns=CLASS)
    check_od(table, faults)
    faults.raise_if_any()
    total = repr(float(table["vehicles"].sum()))
    notes.add(
        "vehicles in file",
        "sum over all cores read; value: vehicles",
        element="demand",
        value=total,
    )
    return OdTable(ordered(table), faults.source, notes.table())


def _add_time_faults(cores: Sequence[OmxCore], faults: Faults) -> None:
    names = [core.name for core in cores]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.add("the core is named twice", column="cores", value=name)
    timed = [core.start_s is not None for core in cores]
    for core, start in zip(cores, timed, strict=True):
        if (core.end_s is not None) != start or start != any(timed):
            what = "must have both start_s and end_s, or no core may have any"
            faults.add(what, column="cores", value=core.name)


def _read(
    path: Path, cores: Sequence[OmxCore], lookup: str | None, told: tuple[Faults, Notes]
) -> list[pd.DataFrame]:
    faults = told[0]
    try:
        import h5py
    except ImportError:
        faults.add(
            'OMX files are read with h5py, which is not installed: pip install "uxsim-geo[omx]"'
        )
        return []
    with damage_as_fault(faults, "is no OMX file (HDF5), or damaged"):
        if has_endless_heap(path):
            raise ValueError("a heap of texts has no end")
        with h5py.File(path, "r") as file:
            return _read_open(file, cores, lookup, told)
    return []


def _read_open(
    file: Any, cores: Sequence[OmxCore], lookup: str | None, told: tuple[Faults, Notes]
) -> list[pd.DataFrame]:
    faults, notes = told
    data, lookups = _sets(file, "data", faults), _sets(file, "lookup", faults)
    if not data and not faults.found:
        faults.add("has no group data with matrices: is it an OMX file?")
    if not cores and len(data) > 1:
        known = ", ".join(sorted(data))
        faults.add(f"has several cores, so that those meant must be named: {known}", column="cores")
    chosen = list(cores) or [OmxCore(name) for name in data]
    for core in chosen:
        if core.name not in data:
            known = ", ".join(sorted(data)) or "none"
            faults.add(f"has no such core (there are: {known})", column="cores", value=core.name)
        else:
            _add_shape_faults(core.name, data[core.name], file, faults)
    if faults.found:
        return []
    zones = _zones(data[chosen[0].name].shape[0], lookups, lookup, told)
    if zones is None:
        return []
    tables = [_long_form(core, data[core.name], zones, faults) for core in chosen]
    unused = sorted(set(data) - {core.name for core in chosen})
    if unused:
        note = "cores of the file that were passed over"
        notes.add("cores", note, element="demand", value=", ".join(unused))
    return tables


def _sets(file: Any, group: str, faults: Faults) -> dict[str, Any]:
    """The data sets of a group that lie in the file itself."""
    import h5py

    if not isinstance(file.get(group, getlink=True), h5py.HardLink):
        return {}
    found = {}
    for name in file[group]:
        if not isinstance(file[group].get(name, getlink=True), h5py.HardLink):
            faults.add("is a link to elsewhere, which is not followed", column=f"{group}/{name}")
            continue
        one = file[group][name]
        if not isinstance(one, h5py.Dataset):
            continue
        if one.is_virtual or one.external:
            faults.add("has its values in another file", column=f"{group}/{name}")
        elif math.prod(one.chunks or (1,)) * one.dtype.itemsize > MOST_BYTES:
            what = f"has values or chunks of over {MOST_BYTES:,} bytes, which are read as one"
            faults.add(what, column=f"{group}/{name}")
        else:
            found[str(name)] = one
    return found


def _add_shape_faults(name: str, core: Any, file: Any, faults: Faults) -> None:
    place = f"core {name}"
    if core.ndim != 2 or core.dtype.kind not in "fiu":
        what = "must be a matrix of numbers"
        faults.add(what, column=place, value=f"{core.dtype}, {core.ndim} dimensions")
        return
    if core.shape[0] != core.shape[1]:
        what = "must be square, from the same zones to the same zones"
        faults.add(what, column=place, value=core.shape)
    if core.size > MOST_CELLS:
        faults.add(f"has over {MOST_CELLS:,} cells", column=place, value=core.shape)
    declared = file.attrs.get("SHAPE")
    if declared is not None and tuple(np.ravel(declared).tolist()) != core.shape:
        what = f"is not of the size that the file declares, {np.ravel(declared).tolist()}"
        faults.add(what, column=place, value=core.shape)


def _zones(
    size: int, lookups: dict[str, Any], lookup: str | None, told: tuple[Faults, Notes]
) -> npt.NDArray[np.object_] | None:
    """The names of the zones in the order of the matrix."""
    faults, notes = told
    known = ", ".join(sorted(lookups)) or "none"
    if lookup is None and len(lookups) > 1:
        what = f"has several lookups, so that the one of the zones must be named: {known}"
        faults.add(what, column="lookup")
    elif lookup is not None and lookup not in lookups:
        faults.add(f"has no such lookup (there are: {known})", column="lookup", value=lookup)
    if faults.found:
        return None
    if not lookups:
        note = "the file has no lookup: zones are numbered as in the matrix, from 1; value: zones"
        notes.add("zones", note, element="demand", value=size)
        return np.array([str(place + 1) for place in range(size)], object)
    name = lookup or next(iter(lookups))
    if lookups[name].shape != (size,):
        what = f"must have the name of each of the {size} zones"
        faults.add(what, column=f"lookup {name}", value=lookups[name].shape)
        return None
    zones = np.array([_text(value) for value in lookups[name][()].tolist()], object)
    found, count = np.unique(zones.astype(str), return_counts=True)
    for zone in found[(count > 1) | (found == "")]:
        faults.add("must name every zone, and no two alike", column=f"lookup {name}", value=zone)
    return None if faults.found else zones


def _text(value: object) -> str:
    """An id as text: bytes, text and whole numbers alike."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace").rstrip("\0").strip()
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return str(value).strip()


def _long_form(
    core: OmxCore, matrix: Any, zones: npt.NDArray[np.object_], faults: Faults
) -> pd.DataFrame:
    """One row a cell with vehicles."""
    parts: list[pd.DataFrame] = []
    number, most = 0, max(MOST_TRIPS, matrix.file.id.get_filesize())
    for begin, cells in _blocks(matrix):
        row, column = np.nonzero(cells)
        vehicles = cells[row, column]
        number += len(vehicles)
        if number > most:
            what = (
                f"has over {most:,} cells with trips, more than such a file can hold: is it "
                "damaged? If not, write it without compression"
            )
            faults.add(what, column=f"core {core.name}")
            break
        wrong = ~(np.isfinite(vehicles) & (vehicles > 0))
        for place in np.flatnonzero(wrong)[: faults.limit].tolist():
            pair = f"{zones[begin + row[place]]} to {zones[column[place]]}"
            what = f"must be a finite number of vehicles, 0 or more, from zone {pair}"
            faults.add(what, column=f"core {core.name}", value=float(vehicles[place]))
        faults.more += max(0, int(wrong.sum()) - faults.limit)
        ends = {"origin": zones[begin + row], "destination": zones[column]}
        parts.append(pd.DataFrame({**ends, "vehicles": vehicles}))
    table = pd.concat(parts) if parts else pd.DataFrame({"vehicles": []})
    table = table.astype({"origin": "str", "destination": "str"})
    table[CLASS] = pd.Series(core.driver_class, index=table.index, dtype="str")
    if core.start_s is not None:
        table = table.assign(**dict(zip(TIMES, (core.start_s, core.end_s), strict=True)))
    return table


def _blocks(matrix: Any) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
    """Rows of the matrix, some at a time, and where they begin; nothing is 0."""
    rows = max(1, BLOCK // max(1, matrix.shape[1]))
    nothing = matrix.attrs.get("NA")
    for begin in range(0, matrix.shape[0], rows):
        cells = matrix[begin : begin + rows].astype(np.float64)
        if nothing is not None:
            value = np.float64(np.ravel(nothing)[0])
            cells[np.isnan(cells) if np.isnan(value) else cells == value] = 0.0
        yield begin, cells

"""Tables in CSV and Parquet files, with the line or the row of every value kept for messages."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.damage import damage_as_fault
from uxsim_geo.demand.od_table import add_of_rows
from uxsim_geo.errors import Faults
from uxsim_geo.network.text import read_lines
from uxsim_geo.network.vector_files import PARQUET
from uxsim_geo.parquet import NO_TABLE, check_parquet

#: what may stand between the values of a line: whichever comes first in the line of names
DELIMITERS = ",;\t"


def read_table_file(path: Path, faults: Faults, *, numbers: bool = False) -> pd.DataFrame | None:
    """A table of a CSV file (all text, index ``line``) or a Parquet file (index ``row``, from 1).

    The suffix says which. With ``numbers``, all columns but the first of a CSV file are numbers
    (NaN where empty) if every cell is one. None, with at least one fault, where it cannot be read.
    """
    is_parquet = path.suffix.lower() in PARQUET
    table = _read_parquet(path, faults) if is_parquet else _read_csv(path, faults, numbers=numbers)
    if table is not None and table.empty and not faults.found:
        faults.add("holds no row beside the names of the columns")
        return None
    return None if faults.found else table


def _read_parquet(path: Path, faults: Faults) -> pd.DataFrame | None:
    import pyarrow.parquet as pq

    table: pd.DataFrame | None = None
    if not check_parquet(path, faults):
        return None
    with damage_as_fault(faults, NO_TABLE):
        # what pandas adds to the schema is not needed, and may be damaged
        table = pq.ParquetFile(path).read().replace_schema_metadata(None).to_pandas()
    if table is None:
        return None
    table.columns = [str(name) for name in table.columns]
    found: pd.DataFrame = table.set_index(pd.RangeIndex(1, len(table) + 1, name="row"))
    return found


def _read_csv(path: Path, faults: Faults, *, numbers: bool) -> pd.DataFrame | None:
    """All cells as text without blanks around them; empty lines are passed over."""
    lines = read_lines(path, faults)
    if lines is None:
        return None
    first = next(place for place, line in enumerate(lines) if line.strip())
    delimiter = next((sign for sign in lines[first] if sign in DELIMITERS), ",")
    reader = csv.reader([lines[first]], delimiter=delimiter, skipinitialspace=True)
    names = [name.strip() for name in next(reader)]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.add("two columns have this name", line=first + 1, column=name)
    if faults.found:
        return None
    table = _numbers(lines, first, (delimiter, names)) if numbers else None
    if table is None:
        table = _rows(lines, first, (delimiter, names), faults)
    if table is None:
        return None
    is_empty = [(table[name].isna() | (table[name] == "")).to_numpy(bool) for name in names]
    empty = np.logical_and.reduce(is_empty)
    rows: pd.DataFrame = table[~empty]
    return rows


def _rows(
    lines: list[str], first: int, form: tuple[str, list[str]], faults: Faults
) -> pd.DataFrame | None:
    """The rows below the line of names, as text."""
    import pyarrow as pa

    names = form[1]
    while not lines[-1].strip():
        lines.pop()
    if len(lines) == first + 1:
        return pd.DataFrame(dict.fromkeys(names, pd.Series(dtype="str")))
    damaged: list[Any] = []
    try:
        table = _parsed(lines[first + 1 :], form, dict.fromkeys(names, pa.string()), damaged)
    except pa.ArrowException as error:
        faults.add(f"is no table of values between signs: {error}")
        return None
    _add_damaged_rows(damaged, first, len(names), faults)
    if not faults.found and table.num_rows != len(lines) - first - 1:
        faults.add("a value in quotation marks runs over the end of its line: is one not closed?")
    if faults.found:
        return None
    trimmed = {name: pa.compute.utf8_trim_whitespace(table.column(name)) for name in names}
    found: pd.DataFrame = pa.table(trimmed).to_pandas()
    return found.set_index(pd.RangeIndex(first + 2, len(lines) + 1, name="line"))


def _add_damaged_rows(damaged: list[Any], first: int, columns: int, faults: Faults) -> None:
    """Rows with another number of values than there are columns."""
    for row in damaged:
        if "\n" in row.text:
            what = "a quotation mark is opened here and not closed"
        else:
            what = f"has {row.actual_columns} values, line {first + 1} names {columns} columns"
        line, value = row.number + first + 1, row.text.partition("\n")[0]
        faults.add(what, line=line, value=value)


def _numbers(lines: list[str], first: int, form: tuple[str, list[str]]) -> pd.DataFrame | None:
    """The rows with numbers in all columns but the first; None where some cell is none."""
    import pyarrow as pa

    names = form[1]
    types = {name: pa.float64() if place else pa.string() for place, name in enumerate(names)}
    body = lines[first + 1 :]
    try:
        damaged: list[Any] = []
        table = _parsed(body, form, types, damaged)
    except pa.ArrowException:
        return None
    while body and not body[-1]:
        body.pop()
    is_nan = any(
        pa.compute.any(pa.compute.is_nan(table.column(name))).as_py() for name in names[1:]
    )
    if damaged or is_nan or table.num_rows != len(body):
        return None
    line = pd.RangeIndex(first + 2, first + 2 + len(body), name="line")
    found: pd.DataFrame = table.to_pandas()
    found[names[0]] = found[names[0]].str.strip()
    return found.set_index(line)


def _parsed(
    lines: list[str], form: tuple[str, list[str]], types: dict[str, Any], damaged: list[Any]
) -> Any:
    """Lines by the fast reader of Arrow; rows of another length go into ``damaged``."""
    from pyarrow import csv as arrow_csv

    def put_aside(row: Any) -> str:
        damaged.append(row)
        return "skip"

    delimiter, names = form
    data = "\n".join(lines).encode()
    return arrow_csv.read_csv(
        io.BytesIO(data),
        read_options=arrow_csv.ReadOptions(
            use_threads=False, column_names=names, block_size=len(data) + 1
        ),
        parse_options=arrow_csv.ParseOptions(
            delimiter=delimiter, ignore_empty_lines=False, invalid_row_handler=put_aside
        ),
        convert_options=arrow_csv.ConvertOptions(
            column_types=types, strings_can_be_null=False, null_values=[""]
        ),
    )


def find_columns(
    table: pd.DataFrame,
    names: Mapping[str, tuple[str, ...]],
    given: Mapping[str, str],
    faults: Faults,
) -> dict[str, str]:
    """The column of ``table`` for each of ``names``: the one ``given``, else the first that fits.

    ``names`` maps what is looked for to the names under which files have it. A column that is
    given and not there is a fault; one that is not found is left out.
    """
    lower: dict[str, str] = {}
    for column in table.columns:
        lower.setdefault(str(column).strip().lower(), str(column))
    found: dict[str, str] = {}
    for what, aliases in names.items():
        if what in given:
            if given[what] not in table:
                there = ", ".join(map(str, table.columns[:20]))
                faults.add(f"has no such column (columns here: {there})", column=given[what])
            found[what] = given[what]
        elif known := [lower[name] for name in aliases if name in lower]:
            found[what] = known[0]
    return found


def ids_of(table: pd.DataFrame, column: str, faults: Faults) -> pd.Series[str]:
    """A column of ids as text: 12 and 12.0 are "12"; null where there is none."""
    values = table[column]
    if pd.api.types.is_numeric_dtype(values.dtype):
        number = values.to_numpy(np.float64, na_value=np.nan)
        broken = ~np.isnan(number) & (number % 1 != 0)
        add_of_rows(faults, table, broken, column, "must be an id: a whole number or a text")
        if not broken.any() and np.abs(np.nan_to_num(number)).max(initial=0) < 2**53:
            whole = pd.Series(number, index=values.index).astype("Int64").astype("str")
            return whole.where(values.notna(), None)
        return values.astype("str")
    return values.astype("str").str.strip()


def numbers_of(table: pd.DataFrame, column: str, faults: Faults) -> npt.NDArray[np.float64]:
    """A column of numbers; a fault for every cell that is none, NaN there."""
    values = table[column]
    if pd.api.types.is_numeric_dtype(values.dtype):
        return values.to_numpy(np.float64, na_value=np.nan)
    found = pd.to_numeric(values, errors="coerce").to_numpy(np.float64, na_value=np.nan)
    # "nan" is a number that the later checks tell of
    wrong = np.isnan(found) & (values.astype("str").str.lower() != "nan").to_numpy(
        bool, na_value=True
    )
    add_of_rows(faults, table, wrong, column, "must be a number")
    return np.where(wrong, 0.0, found)

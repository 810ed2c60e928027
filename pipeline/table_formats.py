"""Tables as files: CSV, Parquet and Excel; the same table gives the same bytes."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete

if TYPE_CHECKING:
    import pandas as pd

#: of a sheet, with its header
MOST_EXCEL_ROWS = 1_048_576

#: letters of a column at most, where its texts are longer
WIDEST = 40


def write_csv(table: pd.DataFrame, path: Path) -> None:
    """UTF-8 with a header; decimals without an exponent that read back as the same number."""
    with replace_when_complete(path) as temporary:
        table.to_csv(
            temporary,
            index=False,
            encoding="utf-8",
            lineterminator="\n",
            float_format=plain_decimal,
        )


def write_parquet(table: pd.DataFrame, path: Path) -> None:
    """One Parquet file, which knows texts from numbers."""
    from uxsim_geo.parquet import write_table

    write_table(table, path)


def write_excel(table: pd.DataFrame, path: Path) -> None:
    """One sheet whose header stays in sight; texts are never taken for formulas or links.

    Raises :class:`uxsim_geo.errors.InputError` for more rows than a sheet has.
    """
    import pandas as pd

    if len(table) >= MOST_EXCEL_ROWS:
        what = f"a sheet has {MOST_EXCEL_ROWS - 1:,} rows below its header, this table has "
        raise InputError([Fault(f"{what}{len(table):,}: take csv or parquet", str(path))])
    as_text = {"strings_to_formulas": False, "strings_to_urls": False}
    with (
        replace_when_complete(path) as temporary,
        pd.ExcelWriter(
            temporary, engine="xlsxwriter", engine_kwargs={"options": as_text}
        ) as writer,
    ):
        table.to_excel(writer, sheet_name="table", index=False, freeze_panes=(1, 0))
        # the date on which a file is made would make two equal tables differ
        writer.book.set_properties({"created": datetime(2000, 1, 1)})  # noqa: DTZ001
        for number, name in enumerate(table.columns):
            longest = table[name].head(1000).astype(str).str.len().max()
            width = max(len(str(name)), 0 if pd.isna(longest) else int(longest))
            writer.sheets["table"].set_column(number, number, min(width, WIDEST) + 2)


#: by the ending of the file
FORMATS: dict[str, Callable[[pd.DataFrame, Path], None]] = {
    "csv": write_csv,
    "parquet": write_parquet,
    "xlsx": write_excel,
}


def plain_decimal(number: object) -> str:
    """The shortest decimal that reads back as the same floating number, without an exponent."""
    text = str(number)
    return f"{Decimal(text):f}" if "e" in text else text

"""Comparisons as files: tables, sentences, layers, a page and pictures."""

from __future__ import annotations

import json
import shutil
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.report import in_words
from pipeline.table_formats import FORMATS
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import at_work_in, replace_when_complete, unfinished

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.analysis.comparison.comparison import Comparison
    from uxsim_geo.export.comparison.study import Study

#: of tables and pictures, beside page and GeoPackage
FOLDER = "comparison"
#: in it, by which a folder of comparisons is known as such
FACTS = "comparison.json"
SENTENCES = "summary.txt"

#: a table of more rows is no CSV, which nobody would read and which takes minutes to write
MOST_CSV_ROWS = 100_000

#: pictures that other processes draw at a time; each takes some hundred MB in a city
DRAWN_AT_A_TIME = 2


def write_views(study: Study, folder: Path, log: Callable[[str], None]) -> list[str]:
    """Write layers, page and pictures of a study; what could not be written, a line each.

    How it came to that is handed to ``log``. All else is written. Files take their names when they
    are complete. Pictures that other processes draw are drawn beside the rest.
    """
    from uxsim_geo.export.comparison.files import is_drawn_apart, study_writers

    writers = study_writers(study)
    for path in {(folder / name).parent for name in writers}:
        path.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(DRAWN_AT_A_TIME) as others:
        apart = {
            name: others.submit(write, folder / name)
            for name, write in writers.items()
            if is_drawn_apart(name)
        }
        problems: list[str] = []
        for name, write in writers.items():
            try:
                apart[name].result() if name in apart else write(folder / name)
            except Exception as error:  # noqa: BLE001  told, and the command fails by it
                problems += [f"{name} could not be written: {what}" for what in in_words(error)]
                log("".join(traceback.format_exception(error)))
    return problems


def write_tables(comparisons: Sequence[Comparison], folder: Path) -> list[str]:
    """Write every table of some comparisons as CSV, the largest as Parquet; of one kind, one file.

    They go into a folder of their own there, and their first column names the scenario. Beside
    them: sentences, and facts as JSON. Returns the names of the files in ``folder``.
    """
    import pandas as pd

    names, folder = [], folder / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for table in tables_of(comparisons[0]):
        parts = [_with_scenario(getattr(one, table), one) for one in comparisons]
        joined = pd.concat(parts, ignore_index=True)
        ending = "csv" if len(joined) <= MOST_CSV_ROWS else "parquet"
        FORMATS[ending](joined, folder / f"{table}.{ending}")
        names.append(f"{table}.{ending}")
    _write_text(folder / SENTENCES, "\n\n".join(map(sentences, comparisons)) + "\n")
    facts = [_facts(one) for one in comparisons]
    text = json.dumps({"comparisons": facts}, indent=1, ensure_ascii=False, allow_nan=False)
    _write_text(folder / FACTS, text + "\n")
    return [f"{FOLDER}/{name}" for name in (*names, SENTENCES, FACTS)]


def tables_of(comparison: Comparison) -> list[str]:
    """Names of the tables of a comparison."""
    import pandas as pd

    every = (key.name for key in fields(comparison))
    return [name for name in every if isinstance(getattr(comparison, name), pd.DataFrame)]


def sentences(comparison: Comparison) -> str:
    """What the scenario changes, a sentence a line."""
    from uxsim_geo.analysis.comparison.words import heading, in_sentences

    return "\n".join((heading(comparison), *in_sentences(comparison)))


def write_folder(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` fill a folder that takes its name when it is complete.

    An earlier comparison of that name is replaced. Raises
    :class:`uxsim_geo.errors.InputError` where something else is in the way.
    """
    check_place(path)
    _make(path.parent)
    with at_work_in(path.parent):
        new, old = unfinished(path), unfinished(path.with_name(f"{path.name}.old"))
        shutil.rmtree(new, ignore_errors=True)
        _make(new)
        try:
            write(new)
            if path.exists():
                path.rename(old)
            new.rename(path)
        finally:
            for folder in (new, old):
                shutil.rmtree(folder, ignore_errors=True)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        what = f"cannot be made ({error.strerror}); choose another --out"
        raise InputError([Fault(what, str(folder))]) from None


def check_place(path: Path) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` unless a comparison may be written there."""
    what = ""
    if path.exists() and not path.is_dir():
        what = "is a file; name a folder"
    elif path.is_dir() and any(path.iterdir()) and not (path / FOLDER / FACTS).is_file():
        what = "holds other files than those of a comparison; choose another --out"
    if what:
        raise InputError([Fault(what, str(path))])


def _with_scenario(table: pd.DataFrame, comparison: Comparison) -> pd.DataFrame:
    table = table.copy(deep=False)
    name = "compared" if "scenario" in table else "scenario"
    table.insert(0, name, comparison.facts.scenario)
    return table


def _facts(comparison: Comparison) -> dict[str, Any]:
    return {
        "base": comparison.facts.base,
        "scenario": comparison.facts.scenario,
        "seeds": [list(pair) for pair in comparison.seeds],
        "duration_s": comparison.duration_s,
        "bin_s": comparison.bin_s,
        "remarks": list(comparison.remarks),
    }


def _write_text(path: Path, text: str) -> None:
    with replace_when_complete(path) as temporary:
        temporary.write_text(text, encoding="utf-8")

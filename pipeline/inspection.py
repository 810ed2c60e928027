"""What is in a run, a network, a results file or a table, in a screenful."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.columns import align
from pipeline.comparison_files import FOLDER, SENTENCES
from pipeline.import_notes import summary_rows
from pipeline.ingest import DEMAND_NOTES, NETWORK
from pipeline.results import read_summary, result_rows, size_in_words
from pipeline.runs import MANIFEST, RunFolder
from pipeline.study_folder import is_study
from pipeline.study_inspection import describe_study
from pipeline.warned import warnings_in
from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.network.note_words import notes_in_words
from uxsim_geo.network.own_data import holds_own_data
from uxsim_geo.network.rows import count
from uxsim_geo.network.units import KMH, LENGTHS, PER_HOUR, PER_KM

if TYPE_CHECKING:
    import pandas as pd

#: topics of notes that fit a screen
ROWS_SHOWN = 8

#: the notes of a network, in its folder
NOTES = "import_notes.parquet"


def inspect_path(path: Path) -> str:
    """Describe what lies at ``path``, in text of about a screen.

    Raises :class:`uxsim_geo.errors.InputError` where that is nothing known here.
    """
    for fits, describe in DESCRIPTIONS:
        if fits(path):
            return describe(path)
    what = (
        "is nothing that can be shown: name a run's folder, a folder with links.parquet, "
        "a study, a comparison, a .gpkg or a .parquet file"
        if path.exists()
        else "no such file or folder"
    )
    raise InputError([Fault(what, str(path))])


def describe_run(path: Path) -> str:
    """Stages with their time, the figures, and the network."""
    from uxsim_geo.parquet import read_tables

    folder = RunFolder(path)
    stages = folder.read_manifest().stages
    rows = [
        (name, record.started, f"{record.wall_s:,.1f} s", "; ".join(record.problems) or "complete")
        for name, record in stages.items()
    ]
    damaged = f"{MANIFEST} is damaged or of another version: nothing here can be vouched for"
    parts = [f"run {path.resolve().name}", align(rows) or damaged]
    figures = read_summary(folder)
    if figures is not None:
        parts.append(align(result_rows(figures), right=(1,)))
    if (path / NETWORK).is_dir():
        parts.append(describe_network(path / NETWORK))
    if (path / DEMAND_NOTES).is_file():
        (notes,) = read_tables(path / DEMAND_NOTES)
        parts.append(_notes("demand notes", notes, path / DEMAND_NOTES))
    return "\n\n".join(filter(None, parts))


def describe_network(path: Path) -> str:
    """Counts, lengths, ranges of the attributes, CRS, what is assumed and doubtful, and notes."""
    from uxsim_geo.network.files import read_network
    from uxsim_geo.network.network import REQUIRED_LINK_COLUMNS
    from uxsim_geo.network.rows import add_missing_columns

    network = read_network(path)
    links = network.links
    faults = Faults(str(path))
    add_missing_columns(faults, links, REQUIRED_LINK_COLUMNS)
    faults.raise_if_any()
    crs = getattr(network.nodes, "crs", None)
    kilometres = links["length"] / LENGTHS["km"]
    rows = [
        ("nodes", f"{len(network.nodes):,}", _zones(network.nodes)),
        ("links", f"{len(links):,}", f"{kilometres.sum():,.1f} km, lanes {_range(links['lanes'])}"),
        ("length", _range(kilometres), "km"),
        ("free speed", _range(links["free_speed"] * KMH), "km/h"),
        ("capacity", _range(links["capacity"] * PER_HOUR), "veh/h of the whole link"),
        ("jam density", _range(links["jam_density"] * PER_KM), "veh/km of one lane"),
        ("banned turns", f"{len(network.movements):,}", ""),
        ("CRS", crs.to_string() if crs else "none", ""),
    ]
    told = network.notes[network.notes["severity"] != "doubt"]
    summary = align(summary_rows(network))
    return "\n\n".join(
        [f"network {path}", align(rows), summary, _notes("import notes", told, path / NOTES)]
    ).rstrip()


def describe_geopackage(path: Path) -> str:
    """Layers with their rows, geometry and columns."""
    import pyogrio

    from uxsim_geo.damage import damage_as_fault

    faults, layers = Faults(str(path)), []
    if holds_own_data(path, faults):
        reading = damage_as_fault(faults, "is no GeoPackage that can be read")
        with warnings.catch_warnings(), reading:
            # pyogrio leaves out the fourth coordinate of trajectories, and says so
            warnings.filterwarnings("ignore", message="Measured")
            layers = [pyogrio.read_info(path, layer=name) for name, _ in pyogrio.list_layers(path)]
    faults.raise_if_any()
    rows = [
        (
            str(layer["layer_name"]),
            f"{layer['features']:,} rows",
            str(layer["geometry_type"] or "no geometry"),
            _shortened(layer["fields"]),
        )
        for layer in layers
    ]
    return f"{path}, {size_in_words(path.stat().st_size)}\n\n{align(rows, right=(1,))}"


def describe_table(path: Path) -> str:
    """Rows, columns with their type and range, and the first rows."""
    from uxsim_geo.parquet import check_parquet, read_tables

    faults = Faults(str(path))
    if not check_parquet(path, faults):
        faults.raise_if_any()
    (table,) = read_tables(path)
    rows = [
        (str(name), str(table[name].dtype), _range(table[name]), _missing(table[name]))
        for name in table.columns
    ]
    return f"{path}, {len(table):,} rows\n\n{align(rows)}"


def describe_comparison(path: Path) -> str:
    """What it says."""
    return (path / FOLDER / SENTENCES).read_text(encoding="utf-8").rstrip("\n")


def describe_notes(path: Path) -> str:
    """All notes in words, those that differ in their values alone together; warnings first."""
    from uxsim_geo.parquet import read_tables

    (notes,) = read_tables(path)
    groups = notes.groupby(["severity", "topic", "note"], sort=False)
    rows = []
    for _, same in groups:
        severity, topic, note = (str(same[name].iloc[0]) for name in ("severity", "topic", "note"))
        words = notes_in_words(note, same["value"])
        if len(same) == 1 and not same["element_id"].isna().any():
            words = f"{same['element'].iloc[0]} {same['element_id'].iloc[0]}: {words}"
        rows.append((f"{len(same):,}", severity, topic, words))
    rows.sort(key=lambda row: row[1] != "warning")
    return f"{path}, {len(notes):,} notes\n\n{align(rows, right=(0,))}"


#: what a path must be, and the function that describes it; the first that fits is taken
DESCRIPTIONS: Sequence[tuple[Callable[[Path], bool], Callable[[Path], str]]] = (
    (is_study, describe_study),
    (lambda path: (path / MANIFEST).is_file(), describe_run),
    (lambda path: (path / "links.parquet").is_file(), describe_network),
    (lambda path: (path / FOLDER / SENTENCES).is_file(), describe_comparison),
    (lambda path: path.is_file() and path.suffix == ".gpkg", describe_geopackage),
    (lambda path: path.is_file() and path.name in (NOTES, DEMAND_NOTES), describe_notes),
    (lambda path: path.is_file() and path.suffix == ".parquet", describe_table),
)


def _range(values: pd.Series[Any]) -> str:
    """Smallest and largest number, or how many different texts."""
    from pandas.api.types import is_numeric_dtype

    if not is_numeric_dtype(values.dtype):
        return f"{values.astype(str).nunique():,} different"
    known = values.dropna()
    if known.empty:
        return "none given"
    low, high = map(_rounded, (float(known.min()), float(known.max())))
    return low if low == high else f"{low} to {high}"


def _rounded(number: float) -> str:
    """Three digits, or all before the point where those are more."""
    return f"{number:,.0f}" if abs(number) >= 100 else f"{number:.3g}"


def _zones(nodes: pd.DataFrame) -> str:
    """How many zones there are, at how many nodes, which may share them; nothing without zones."""
    import pandas as pd

    columns = [name for name in ("zone_id", "origin_of", "destination_of") if name in nodes]
    ids = pd.concat([nodes[name].dropna().astype(str).str.split().explode() for name in columns])
    ids = ids.dropna()
    if ids.empty:
        return ""
    return f"{ids.index.nunique():,} of them carry {ids.nunique():,} zones"


def _missing(values: pd.Series[Any]) -> str:
    missing = int(values.isna().sum())
    return f"{missing:,} empty" if missing else ""


def _notes(title: str, notes: pd.DataFrame, table: Path) -> str:
    """Topics by their number, all warnings before the rest, in words; how to see what is left."""
    counts = Counter(zip(notes["severity"], notes["topic"], strict=True))
    order = sorted(counts.items(), key=lambda entry: (entry[0][0] != "warning", -entry[1]))
    warned = sum(severity == "warning" for severity, _ in counts)
    shown = order[: max(ROWS_SHOWN, warned)]
    rows = [(f"{number:,}", *key) for key, number in shown]
    more = len(order) - len(shown)
    rest = (
        [f"and {count(more, 'more topic')}; all notes: uxsim-geo inspect {table}"] if more else []
    )
    told = [align(rows, right=(0,)), *rest, *warnings_in(notes)]
    return "\n".join([title, *told]) if rows else ""


def _shortened(names: Iterable[str], limit: int = 60) -> str:
    text = ", ".join(map(str, names))
    if len(text) <= limit:
        return text
    shown = text[: limit - 2].rpartition(",")[0]
    return f"{shown} … {text.count(',') - shown.count(',')} more"

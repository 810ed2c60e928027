"""``results.gpkg``: everything that a GIS shows, in one file, with styles and a project.

Geometry is stored once, in ``links``, and the times of the bins once each: states are a narrow
table of numbers, and views join the three to ``link_times`` and ``link_states`` (a fifth of the
size of repeated geometry, and a moment in time is found without a search). The version is 1.3,
which GDAL and QGIS of current long-term distributions read without complaint.
"""

from __future__ import annotations

import sqlite3
import struct
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy.typing as npt
import pandas as pd

from uxsim_geo.export.columns import LAYERS, Layer
from uxsim_geo.export.geopackage_states import LINKS_IN_TIME, InTime, add_bins, add_views, values_of
from uxsim_geo.export.geopackage_styles import add_styles
from uxsim_geo.export.geopackage_words import add_descriptions, add_metadata
from uxsim_geo.export.qgis_parts import Project
from uxsim_geo.export.qgis_project import add_project
from uxsim_geo.export.qgis_run import project_of_run
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.run_layers import without_m
from uxsim_geo.export.styles import NamedStyle, styles_of
from uxsim_geo.files import replace_when_complete

UNDEFINED_CARTESIAN = "-1"  # GeoPackage's srs_id for plane coordinates of an unknown system

#: types of layers that may be without any geometry: nobody drove, no note has a place
TYPES = {"od_lines": "LineString", "trajectories": "LineString Z", "import_notes": "Point"}


@dataclass(frozen=True)
class Contents:
    """What a GeoPackage holds.

    layers
        by name; tables, GeoDataFrames where they have geometry, and what ``in_time`` names
    words
        of all layers, views among them
    styles
        of all layers
    in_time
        links in time bins: :class:`uxsim_geo.export.geopackage_states.Times` among the layers, by
        the name of the first view, that are kept as narrow tables
    project
        of QGIS; None where there is no map
    """

    layers: Mapping[str, Any]
    words: Mapping[str, Layer]
    styles: Mapping[str, Sequence[NamedStyle]]
    in_time: Sequence[InTime] = ()
    project: Project | None = None
    types: Mapping[str, str] = field(default_factory=dict)


def write_geopackage(path: Path, layers: Mapping[str, Any], description: RunDescription) -> None:
    """Write the layers of a run with their words, styles, metadata and a QGIS project.

    ``layers`` by name, as :func:`uxsim_geo.export.layers.layers_of_run` makes them; ``links`` is
    needed. A network whose CRS is None is written as plane coordinates of an undefined system; one
    without geometry gives tables. The same input gives the same bytes: every time stamp in the file
    is ``description.origin``. The file replaces an existing one when it is complete.
    """
    styles = styles_of(layers, description)
    in_time = (LINKS_IN_TIME,) if "link_times" in layers else ()
    project = None
    if "geometry" in layers["links"].columns:
        project = project_of_run(path.name, layers, styles, description)
    write_contents(path, Contents(layers, LAYERS, styles, in_time, project, TYPES), description)


def write_contents(path: Path, contents: Contents, description: RunDescription) -> None:
    """Write layers with what belongs to them, as :func:`write_geopackage` does those of a run."""
    stamp = pd.Timestamp(description.origin).tz_convert("UTC").strftime("%Y-%m-%dT%H:%M:%S.000Z")
    with replace_when_complete(path) as temporary:
        with _time_stamps_of_gdal(stamp):
            _write_tables(temporary, contents)
        with closing(sqlite3.connect(temporary)) as database, database:
            _add_fourth_coordinates(database, contents.layers)
            _add_times(database, contents, stamp)
            add_descriptions(database, contents.words)
            add_metadata(database, description, stamp)
            add_styles(database, contents.styles, stamp)
            if contents.project is not None:
                add_project(database, contents.project, stamp)


def _write_tables(path: Path, contents: Contents) -> None:
    """All layers but views; their tables last: after one that is not listed GDAL lists none."""
    in_time = {names.times for names in contents.in_time}
    for name, layer in contents.layers.items():
        if name not in in_time:
            _write_layer(path, name, layer, contents)
    for names in contents.in_time:
        links, times = contents.layers[names.links], contents.layers[names.times]
        _write_values(path, names.values, values_of(times, len(links)))


def _add_times(database: sqlite3.Connection, contents: Contents, stamp: str) -> None:
    """The bins of links in time, and their views."""
    for names in contents.in_time:
        links, times = contents.layers[names.links], contents.layers[names.times]
        add_bins(database, names, times.bins, len(links))
        add_views(database, names, contents.words, stamp)


@contextmanager
def _time_stamps_of_gdal(stamp: str) -> Iterator[None]:
    """Let GDAL write this time instead of now."""
    import pyogrio

    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": stamp})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": before})


def _write_layer(path: Path, name: str, layer: pd.DataFrame, contents: Contents) -> None:
    import pyogrio

    spatial = "geometry" in layer.columns
    options = {}
    if name in contents.words:
        options = {"DESCRIPTION": contents.words[name].title, "IDENTIFIER": name}
    if spatial and getattr(layer, "crs", None) is None:
        options["SRID"] = UNDEFINED_CARTESIAN
    if spatial:
        layer = without_m(layer)
    with warnings.catch_warnings():
        # that there is no CRS is intended and said in the file
        warnings.filterwarnings("ignore", message="'crs' was not provided")
        pyogrio.write_dataframe(
            layer,
            path,
            layer=name,
            driver="GPKG",
            append=path.exists(),
            use_arrow=True,
            geometry_type=contents.types.get(name) if spatial else None,
            dataset_options={"VERSION": "1.3"},
            layer_options=options,
        )


def _write_values(path: Path, name: str, parts: Iterator[pd.DataFrame]) -> None:
    """A table that is not listed as a layer, of as many parts as there are, one in memory."""
    import pyarrow as pa
    import pyogrio

    first = pa.RecordBatch.from_pandas(next(parts), preserve_index=False)
    others = (pa.RecordBatch.from_pandas(part, first.schema, False) for part in parts)
    pyogrio.write_arrow(
        pa.RecordBatchReader.from_batches(first.schema, chain([first], others)),
        path,
        layer=name,
        driver="GPKG",
        append=True,
        layer_options={"ASPATIAL_VARIANT": "NOT_REGISTERED"},
    )


def _add_fourth_coordinates(
    database: sqlite3.Connection, layers: Mapping[str, pd.DataFrame]
) -> None:
    """Put lines with m in place of those without, which are all that pyogrio can write."""
    if "trajectories" not in layers:
        return
    triggers = database.execute(
        "SELECT name, sql FROM sqlite_master WHERE tbl_name = 'trajectories' AND type = 'trigger'"
    ).fetchall()
    for name, _ in triggers:  # they call functions that GDAL adds to SQLite
        database.execute(f'DROP TRIGGER "{name}"')
    column, srs = database.execute(
        "SELECT column_name, srs_id FROM gpkg_geometry_columns WHERE table_name = 'trajectories'"
    ).fetchone()
    database.execute(
        "UPDATE gpkg_geometry_columns SET z = 1, m = 1 WHERE table_name = 'trajectories'"
    )
    blobs = _blobs(layers["trajectories"]["geometry"].to_numpy(), srs)
    update = f'UPDATE trajectories SET "{column}" = ? WHERE fid = ?'  # nosec B608 # by GDAL
    database.executemany(update, blobs)
    for _, sql in triggers:
        database.execute(sql)


def _blobs(lines: npt.NDArray[Any], srs: int) -> Iterator[tuple[bytes, int]]:
    """Geometries as GeoPackage keeps them, with the numbers of their rows: head, bounds, WKB."""
    import shapely

    texts = shapely.to_wkb(lines, output_dimension=4, flavor="iso", byte_order=1)
    bounds = shapely.bounds(lines)[:, [0, 2, 1, 3]].astype("<f8")
    head = struct.pack("<2sBBi", b"GP", 0, 0b11, srs)
    for fid, (text, extent) in enumerate(zip(texts, bounds, strict=True), start=1):
        if text is not None:
            yield head + extent.tobytes() + text, fid

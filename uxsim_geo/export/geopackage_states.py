"""States of links in time bins inside a GeoPackage: a narrow table, and two views over it.

Rows of ``link_time_values`` are numbered bin by bin, so that those of a bin follow one another::

    fid = first_fid of the bin + fid of the link − 1

With this the views find the rows of a bin, of a link, or one row, without an index of millions of
entries; SQLite takes whichever condition serves a question best.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator

import numpy as np
import pandas as pd

from uxsim_geo.export.columns import EFFECTIVE_CAPACITY, LAYERS, LINK
from uxsim_geo.export.layers import LinkTimes

VALUES = "link_time_values"
NOT_STORED = ("link_id", "begin", "end")  # but found by the views

TIME_BINS = """
    CREATE TABLE time_bins (
        bin INTEGER PRIMARY KEY NOT NULL,
        begin DATETIME NOT NULL,
        end DATETIME NOT NULL,
        first_fid INTEGER NOT NULL,
        last_fid INTEGER NOT NULL
    )
"""

VIEW = """
    CREATE VIEW {name} AS
    SELECT v.fid AS OGC_FID, {columns}
    FROM time_bins AS b JOIN links AS l JOIN link_time_values AS v
    ON v.fid BETWEEN b.first_fid AND b.last_fid
        AND v.link_fid = l.fid AND v.fid = b.first_fid + l.fid - 1
"""


def values_of(link_times: LinkTimes) -> Iterator[pd.DataFrame]:
    """The numbers of the layer link_times in rows bin by bin, some bins at a time."""
    links = len(link_times.grid.link_ids)
    for part in link_times.parts():
        bins = len(part) // links
        order = np.arange(len(part)).reshape(links, bins).T.ravel()
        values = part.drop(columns=list(NOT_STORED)).iloc[order].reset_index(drop=True)
        values.insert(0, "link_fid", order // bins + 1)
        yield values


def add_views(database: sqlite3.Connection, link_times: LinkTimes, stamp: str) -> None:
    """``time_bins``, and the views ``link_times`` and ``link_states``, as layers.

    A GIS lists them: the first as a table, the second with the geometry of links.
    """
    database.execute("CREATE UNIQUE INDEX links_by_link_id ON links (link_id)")
    _add_bins(database, link_times.bins, len(link_times.grid.link_ids))
    stored = [column.name for column in LAYERS["link_times"].columns][len(NOT_STORED) :]
    times = ["b.begin", "b.end", *(f'v."{name}"' for name in stored)]
    spatial = database.execute(
        "SELECT column_name FROM gpkg_geometry_columns WHERE table_name = 'links'"
    ).fetchone()
    of_link = [f'l."{column.name}"' for column in (*LINK, EFFECTIVE_CAPACITY)]
    columns = {
        "link_times": ["l.link_id", *times],
        "link_states": [*of_link, *times, *(f'l."{name}"' for name in spatial or ())],
    }
    for name, selected in columns.items():
        database.execute(VIEW.format(name=name, columns=", ".join(selected)))
    _register(database, len(link_times), stamp)


def _add_bins(database: sqlite3.Connection, bins: pd.DataFrame, links: int) -> None:
    begin, end = (
        bins[name].dt.strftime("%Y-%m-%dT%H:%M:%S.%f").str[:-3] + "Z" for name in ("begin", "end")
    )
    database.execute(TIME_BINS)
    database.executemany(
        "INSERT INTO time_bins VALUES (?, ?, ?, ?, ?)",
        [
            (number, first, last, number * links + 1, (number + 1) * links)
            for number, (first, last) in enumerate(zip(begin, end, strict=True))
        ],
    )


def _register(database: sqlite3.Connection, rows: int, stamp: str) -> None:
    """List the views as layers, with the number of their rows, which GDAL then need not count."""
    database.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change)"
        " VALUES ('link_times', 'attributes', 'link_times', ?, ?)",
        (LAYERS["link_times"].title, stamp),
    )
    database.execute(
        "INSERT INTO gpkg_contents SELECT 'link_states', data_type, 'link_states', ?, ?,"
        " min_x, min_y, max_x, max_y, srs_id FROM gpkg_contents WHERE table_name = 'links'",
        (LAYERS["link_states"].title, stamp),
    )
    database.execute(
        "INSERT INTO gpkg_geometry_columns SELECT 'link_states', column_name, geometry_type_name,"
        " srs_id, z, m FROM gpkg_geometry_columns WHERE table_name = 'links'"
    )
    database.executemany(
        "INSERT INTO gpkg_ogr_contents (table_name, feature_count) VALUES (?, ?)",
        [("link_times", rows), ("link_states", rows)],
    )

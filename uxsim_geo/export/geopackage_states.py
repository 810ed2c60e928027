"""States of links in time bins inside a GeoPackage: a narrow table, and two views over it.

Rows of the table of values are numbered bin by bin, so that those of a bin follow one another::

    fid = first_fid of the bin + fid of the link − 1

With this the views find the rows of a bin, of a link, or one row, without an index of millions of
entries; SQLite takes whichever condition serves a question best.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import pandas as pd

from uxsim_geo.export.columns import EFFECTIVE_CAPACITY, LINK, Layer

NOT_STORED = ("link_id", "begin", "end")  # but found by the views

TIME_BINS = """
    CREATE TABLE "{bins}" (
        bin INTEGER PRIMARY KEY NOT NULL,
        begin DATETIME NOT NULL,
        end DATETIME NOT NULL,
        first_fid INTEGER NOT NULL,
        last_fid INTEGER NOT NULL
    )
"""

VIEW = """
    CREATE VIEW "{name}" AS
    SELECT v.fid AS OGC_FID, {columns}
    FROM "{bins}" AS b JOIN "{links}" AS l JOIN "{values}" AS v
    ON v.fid BETWEEN b.first_fid AND b.last_fid
        AND v.link_fid = l.fid AND v.fid = b.first_fid + l.fid - 1
"""


class Times(Protocol):
    """Links by time as tables of some bins, which together may not fit in memory."""

    @property
    def bins(self) -> pd.DataFrame:
        """Begin and end of every bin."""

    def parts(self) -> Iterator[pd.DataFrame]:
        """Tables of some bins after the other, all links of them, link by link."""


class InTime(NamedTuple):
    """Links in time bins: names of the layer of links, of the tables of values and bins, and views.

    of_link are columns of the links that the spatial view repeats.
    """

    links: str
    values: str
    bins: str
    times: str
    states: str
    of_link: Sequence[str]


#: of a run
LINKS_IN_TIME = InTime(
    "links",
    "link_time_values",
    "time_bins",
    "link_times",
    "link_states",
    tuple(column.name for column in (*LINK, EFFECTIVE_CAPACITY)),
)


def values_of(link_times: Times, links: int) -> Iterator[pd.DataFrame]:
    """The numbers of the layer link_times in rows bin by bin, some bins at a time."""
    for part in link_times.parts():
        bins = len(part) // links
        order = np.arange(len(part)).reshape(links, bins).T.ravel()
        values = part.drop(columns=list(NOT_STORED)).iloc[order].reset_index(drop=True)
        values.insert(0, "link_fid", order // bins + 1)
        yield values


def add_bins(database: sqlite3.Connection, names: InTime, bins: pd.DataFrame, links: int) -> None:
    """Begin and end of the bins, and which rows of the values are theirs."""
    begin, end = (
        bins[name].dt.strftime("%Y-%m-%dT%H:%M:%S.%f").str[:-3] + "Z" for name in ("begin", "end")
    )
    database.execute(TIME_BINS.format(bins=names.bins))
    database.executemany(
        f'INSERT INTO "{names.bins}" VALUES (?, ?, ?, ?, ?)',  # nosec B608 # our own name
        [
            (number, first, last, number * links + 1, (number + 1) * links)
            for number, (first, last) in enumerate(zip(begin, end, strict=True))
        ],
    )


def add_views(
    database: sqlite3.Connection, names: InTime, words: Mapping[str, Layer], stamp: str
) -> None:
    """Two views as layers: links by time, and the same with the geometry of the links.

    A GIS lists them: the first as a table, the second on the map.
    """
    database.execute(f'CREATE UNIQUE INDEX "{names.links}_by_link_id" ON "{names.links}" (link_id)')
    stored = [column.name for column in words[names.times].columns][len(NOT_STORED) :]
    times = ["b.begin", "b.end", *(f'v."{name}"' for name in stored)]
    spatial = database.execute(
        "SELECT column_name FROM gpkg_geometry_columns WHERE table_name = ?", (names.links,)
    ).fetchone()
    of_link = [f'l."{name}"' for name in names.of_link]
    columns = {
        names.times: ["l.link_id", *times],
        names.states: [*of_link, *times, *(f'l."{name}"' for name in spatial or ())],
    }
    tables = {"links": names.links, "values": names.values, "bins": names.bins}
    for name, selected in columns.items():
        database.execute(VIEW.format(name=name, columns=", ".join(selected), **tables))
    _register(database, names, words, stamp)


def _register(
    database: sqlite3.Connection, names: InTime, words: Mapping[str, Layer], stamp: str
) -> None:
    """List the views as layers, with the number of their rows, which GDAL then need not count."""
    times, states = names.times, names.states
    database.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change)"
        " VALUES (?, 'attributes', ?, ?, ?)",
        (times, times, words[times].title, stamp),
    )
    database.execute(
        "INSERT INTO gpkg_contents SELECT ?, data_type, ?, ?, ?,"
        " min_x, min_y, max_x, max_y, srs_id FROM gpkg_contents WHERE table_name = ?",
        (states, states, words[states].title, stamp, names.links),
    )
    database.execute(
        "INSERT INTO gpkg_geometry_columns SELECT ?, column_name, geometry_type_name,"
        " srs_id, z, m FROM gpkg_geometry_columns WHERE table_name = ?",
        (states, names.links),
    )
    count = f'SELECT count(*) FROM "{names.values}"'  # nosec B608 # our own name
    (rows,) = database.execute(count).fetchone()
    database.executemany(
        "INSERT INTO gpkg_ogr_contents (table_name, feature_count) VALUES (?, ?)",
        [(times, rows), (states, rows)],
    )

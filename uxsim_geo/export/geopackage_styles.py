"""Styles inside a GeoPackage, in the table where QGIS looks for them."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence

from uxsim_geo.export.qml import text_of
from uxsim_geo.export.styles import NamedStyle

LAYER_STYLES_TABLE = """
    CREATE TABLE layer_styles (
        id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
        f_table_catalog TEXT(256),
        f_table_schema TEXT(256),
        f_table_name TEXT(256),
        f_geometry_column TEXT(256),
        styleName TEXT(30),
        styleQML TEXT,
        styleSLD TEXT,
        useAsDefault BOOLEAN,
        description TEXT,
        owner TEXT(30),
        ui TEXT(30),
        update_time DATETIME
    )
"""


def add_styles(
    database: sqlite3.Connection, styles: Mapping[str, Sequence[NamedStyle]], stamp: str
) -> None:
    """All styles by layer; a layer opens with its first."""
    geometry = dict(database.execute("SELECT table_name, column_name FROM gpkg_geometry_columns"))
    database.execute(LAYER_STYLES_TABLE)
    database.executemany(
        "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name,"
        " f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description, owner, ui,"
        " update_time) VALUES ('', '', ?, ?, ?, ?, '', ?, ?, '', '', ?)",
        [
            (
                layer,
                geometry.get(layer, ""),
                style.name,
                text_of(style.root),
                number == 0,
                style.description,
                stamp,
            )
            for layer, several in styles.items()
            for number, style in enumerate(several)
        ],
    )
    database.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change)"
        " VALUES ('layer_styles', 'attributes', 'layer_styles', 'Styles for QGIS', ?)",
        (stamp,),
    )

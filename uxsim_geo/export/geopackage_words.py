"""What a GeoPackage says of itself: descriptions of all columns, and how its content came about."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement, tostring

from uxsim_geo.export.columns import Column, Layer, titled
from uxsim_geo.export.qml import plain
from uxsim_geo.export.run_description import RunDescription

EXTENSIONS = "http://www.geopackage.org/spec131/"

EXTENSIONS_TABLE = """
    CREATE TABLE IF NOT EXISTS gpkg_extensions (
        table_name TEXT,
        column_name TEXT,
        extension_name TEXT NOT NULL,
        definition TEXT NOT NULL,
        scope TEXT NOT NULL,
        CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name)
    )
"""

DATA_COLUMNS = """
    CREATE TABLE gpkg_data_columns (
        table_name TEXT NOT NULL,
        column_name TEXT NOT NULL,
        name TEXT,
        title TEXT,
        description TEXT,
        mime_type TEXT,
        constraint_name TEXT,
        CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name),
        CONSTRAINT gdc_tn UNIQUE (table_name, name)
    )
"""

DATA_COLUMN_CONSTRAINTS = """
    CREATE TABLE gpkg_data_column_constraints (
        constraint_name TEXT NOT NULL,
        constraint_type TEXT NOT NULL,
        value TEXT,
        min NUMERIC,
        min_is_inclusive BOOLEAN,
        max NUMERIC,
        max_is_inclusive BOOLEAN,
        description TEXT,
        CONSTRAINT gdcc_ntv UNIQUE (constraint_name, constraint_type, value)
    )
"""

METADATA = """
    CREATE TABLE gpkg_metadata (
        id INTEGER CONSTRAINT m_pk PRIMARY KEY ASC NOT NULL,
        md_scope TEXT NOT NULL DEFAULT 'dataset',
        md_standard_uri TEXT NOT NULL,
        mime_type TEXT NOT NULL DEFAULT 'text/xml',
        metadata TEXT NOT NULL DEFAULT ''
    )
"""

METADATA_REFERENCE = """
    CREATE TABLE gpkg_metadata_reference (
        reference_scope TEXT NOT NULL,
        table_name TEXT,
        column_name TEXT,
        row_id_value INTEGER,
        timestamp DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
        md_file_id INTEGER NOT NULL,
        md_parent_id INTEGER,
        CONSTRAINT crmr_mfi_fk FOREIGN KEY (md_file_id) REFERENCES gpkg_metadata(id),
        CONSTRAINT crmr_mpi_fk FOREIGN KEY (md_parent_id) REFERENCES gpkg_metadata(id)
    )
"""


def add_descriptions(database: sqlite3.Connection, words: Mapping[str, Layer]) -> None:
    """A title and a description for every column of every layer (extension gpkg_schema)."""
    database.execute(DATA_COLUMNS)
    database.execute(DATA_COLUMN_CONSTRAINTS)
    _add_extension(
        database, "gpkg_schema", "extension_schema", "data_columns", "data_column_constraints"
    )
    listed = [name for (name,) in database.execute("SELECT table_name FROM gpkg_contents")]
    database.executemany(
        "INSERT INTO gpkg_data_columns (table_name, column_name, name, title, description)"
        " VALUES (?, ?, ?, ?, ?)",
        [
            (name, column.name, column.name, titled(column), described(column))
            for name in listed
            if name in words
            for column in words[name].columns
        ],
    )


def described(column: Column) -> str:
    """Its meaning in a sentence, without marks."""
    empty = "" if column.empty == "never" else f"; empty: {column.empty}"
    return f"{column.what}{empty}".replace("`", "")


def add_metadata(database: sqlite3.Connection, description: RunDescription, stamp: str) -> None:
    """How the content came about: items that GDAL and QGIS show, and all of it as JSON."""
    database.execute(METADATA)
    database.execute(METADATA_REFERENCE)
    _add_extension(
        database, "gpkg_metadata", "extension_metadata", "metadata", "metadata_reference"
    )
    provenance = json.dumps(description.provenance, ensure_ascii=False, indent=1)
    documents = [
        ("http://gdal.org", "text/xml", _items(description)),
        ("https://www.json.org", "application/json", provenance),
    ]
    for number, document in enumerate(documents, start=1):
        database.execute(
            "INSERT INTO gpkg_metadata VALUES (?, 'dataset', ?, ?, ?)", (number, *document)
        )
        database.execute(
            "INSERT INTO gpkg_metadata_reference (reference_scope, timestamp, md_file_id)"
            " VALUES ('geopackage', ?, ?)",
            (stamp, number),
        )


def _items(description: RunDescription) -> str:
    """Items in the form that GDAL keeps, which its tools and QGIS list."""
    root = Element("GDALMultiDomainMetadata")
    items = SubElement(root, "Metadata")
    named = {
        "run": description.name,
        "attribution": description.attribution,
        **{str(name): str(value) for name, value in description.information.items()},
    }
    for name, value in named.items():
        if value:
            SubElement(items, "MDI", {"key": plain(name)}).text = plain(value)
    return tostring(root, encoding="unicode")


def _add_extension(database: sqlite3.Connection, name: str, page: str, *tables: str) -> None:
    database.execute(EXTENSIONS_TABLE)
    database.executemany(
        "INSERT INTO gpkg_extensions (table_name, column_name, extension_name, definition, scope)"
        " VALUES (?, NULL, ?, ?, 'read-write')",
        [(f"gpkg_{table}", name, f"{EXTENSIONS}#{page}") for table in tables],
    )

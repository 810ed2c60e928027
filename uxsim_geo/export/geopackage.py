"""``results.gpkg``: everything that a GIS shows, in one file, with styles.

Geometry is stored once, in ``links``; the states are a plain table, and a view joins the two
(a third of the size of repeated geometry). The version is 1.3, which GDAL and QGIS of current
long-term distributions read without complaint.
"""

from __future__ import annotations

import sqlite3
import warnings
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import pandas as pd

from uxsim_geo.export.layers import (
    link_times_layer,
    links_layer,
    nodes_layer,
    notes_layer,
    run_info_layer,
)
from uxsim_geo.export.styles import (
    SHARE_OF_ROAD,
    nodes_style,
    notes_style,
    share_of_largest,
    table_style,
    traffic_style,
)
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network

UNDEFINED_CARTESIAN = "-1"  # GeoPackage's srs_id for plane coordinates of an unknown system

DESCRIPTIONS = {
    "nodes": "Nodes of the network",
    "links": "Directed links with the figures of the whole run",
    "link_times": "States of every link in every time bin",
    "link_states": "link_times with the geometry of links, for the temporal controller",
    "import_notes": "What was assumed or repaired on import, and where",
    "run_info": "How these results came about",
}

LINK_STATES_VIEW = """
    CREATE VIEW link_states AS
    SELECT t.fid AS OGC_FID, t.link_id, l.from_node_id, l.to_node_id, l.name, l.road_class,
           l.length_m, l.lanes, l.free_speed_kmh, l.jam_density_vpkm_per_lane,
           l.effective_capacity_vph, {times}{geometry}
    FROM link_times AS t JOIN links AS l ON l.link_id = t.link_id
"""

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


@dataclass(frozen=True)
class RunDescription:
    """What the file says beside the traffic.

    start
        what the clock shows at 0 s, with its time zone
    notes
        of the import, with the columns of :data:`uxsim_geo.network.network.NOTE_COLUMNS`
    information
        names and values for ``run_info``: configuration, versions, seed, figures; without a number
        ``reaction_time_s`` among them the capacity of the diagram is not known and stays empty
    """

    start: datetime
    notes: pd.DataFrame
    information: Mapping[str, object]

    def __post_init__(self) -> None:
        if self.start.tzinfo is None:
            raise ValueError(f"start needs a time zone, for instance UTC: {self.start.isoformat()}")

    @property
    def reaction_time(self) -> float | None:
        """τ of the run in s, as ``information`` tells it; None if it does not."""
        value = self.information.get("reaction_time_s")
        return float(value) if isinstance(value, (int, float)) else None


def write_geopackage(
    path: Path, network: Network, states: pd.DataFrame, description: RunDescription
) -> None:
    """Write nodes, links, link_times, link_states, import_notes and run_info with their styles.

    ``states`` comes from :func:`uxsim_geo.analysis.link_states.link_times`. A network whose CRS is
    None is written as plane coordinates of an undefined system; one without geometry gives tables.
    The same input gives the same bytes: every time stamp in the file is ``description.start``.
    The file replaces an existing one when it is complete.
    """
    layers = {
        "nodes": nodes_layer(network),
        "links": links_layer(network, states, description.reaction_time),
        "link_times": link_times_layer(network, states, description.start),
        "import_notes": notes_layer(description.notes),
        "run_info": run_info_layer(description.information),
    }
    stamp = pd.Timestamp(description.start).tz_convert("UTC").strftime("%Y-%m-%dT%H:%M:%S.000Z")
    with replace_when_complete(path) as temporary:
        with _time_stamps_of_gdal(stamp):
            for name, layer in layers.items():
                _write_layer(temporary, name, layer)
        with closing(sqlite3.connect(temporary)) as database, database:
            _add_link_states(database, list(layers["link_times"].columns), stamp)
            _add_styles(database, layers, stamp)


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


def _write_layer(path: Path, name: str, layer: pd.DataFrame) -> None:
    import pyogrio

    options = {"DESCRIPTION": DESCRIPTIONS[name]}
    crs = getattr(layer, "crs", None)
    # of a layer in which nothing has a place nobody could tell the kind of geometry
    kind = "Point" if name == "import_notes" and "geometry" in layer.columns else None
    if "geometry" in layer.columns and crs is None:
        options["SRID"] = UNDEFINED_CARTESIAN
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
            dataset_options={"VERSION": "1.3"},
            layer_options=options,
            geometry_type=kind,
        )


def _add_link_states(database: sqlite3.Connection, times: list[str], stamp: str) -> None:
    """The view of states with geometry, registered so that a GIS lists it as a layer."""
    database.execute("CREATE UNIQUE INDEX links_by_link_id ON links (link_id)")
    spatial = database.execute(
        "SELECT column_name FROM gpkg_geometry_columns WHERE table_name = 'links'"
    ).fetchone()
    columns = ", ".join(f't."{name}"' for name in times if name != "link_id")
    geometry = f", l.{spatial[0]}" if spatial else ""
    database.execute(LINK_STATES_VIEW.format(times=columns, geometry=geometry))
    database.execute(
        "INSERT INTO gpkg_contents SELECT 'link_states', data_type, 'link_states', ?, ?,"
        " min_x, min_y, max_x, max_y, srs_id FROM gpkg_contents WHERE table_name = 'links'",
        (DESCRIPTIONS["link_states"], stamp),
    )
    database.execute(
        "INSERT INTO gpkg_geometry_columns SELECT 'link_states', column_name, geometry_type_name,"
        " srs_id, z, m FROM gpkg_geometry_columns WHERE table_name = 'links'"
    )


def _add_styles(database: sqlite3.Connection, layers: dict[str, pd.DataFrame], stamp: str) -> None:
    """A default style for every layer, in the table where QGIS looks for it."""
    volume = float(layers["links"]["volume_veh"].max())
    state_columns = [row[1] for row in database.execute("PRAGMA table_info(link_states)")]
    styles = {name: table_style(layer.columns) for name, layer in layers.items()}
    styles["nodes"] = nodes_style(layers["nodes"].columns)
    if "geometry" in layers["import_notes"]:
        styles["import_notes"] = notes_style(layers["import_notes"].columns)
    styles["links"] = traffic_style(layers["links"].columns, share_of_largest("volume_veh", volume))
    styles["link_states"] = traffic_style(state_columns, SHARE_OF_ROAD, temporal=True)
    geometry = dict(database.execute("SELECT table_name, column_name FROM gpkg_geometry_columns"))
    database.execute(LAYER_STYLES_TABLE)
    database.executemany(
        "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name,"
        " f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description, owner, ui,"
        " update_time) VALUES ('', '', ?, ?, ?, ?, '', 1, ?, '', '', ?)",
        [
            (name, geometry.get(name, ""), name, style, DESCRIPTIONS[name], stamp)
            for name, style in styles.items()
        ],
    )
    database.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change)"
        " VALUES ('layer_styles', 'attributes', 'layer_styles', 'Styles for QGIS', ?)",
        (stamp,),
    )

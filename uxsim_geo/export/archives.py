"""The layers of a run as files of their own: GeoParquet for archives, FlatGeobuf for the web."""

from __future__ import annotations

import warnings
from pathlib import Path

import pandas as pd

from uxsim_geo.export.columns import LAYERS
from uxsim_geo.export.layers import LinkTimes
from uxsim_geo.export.run_layers import without_m
from uxsim_geo.files import replace_when_complete
from uxsim_geo.parquet import write_table


def write_geoparquet(path: Path, layer: pd.DataFrame | LinkTimes) -> None:
    """One layer, with its CRS if it has geometry; coordinates keep z and m."""
    write_table(layer.table() if isinstance(layer, LinkTimes) else layer, path)


def write_flatgeobuf(path: Path, name: str, layer: pd.DataFrame) -> None:
    """One layer with geometry, with a spatial index; coordinates lose m, rows without line are out.

    ``name`` is that of the layer. Rows stand in the order of the index, as the format wants it.
    """
    import pyogrio

    layer = without_m(layer[layer["geometry"].notna()])
    with replace_when_complete(path) as temporary, warnings.catch_warnings():
        # that there is no CRS is intended
        warnings.filterwarnings("ignore", message="'crs' was not provided")
        pyogrio.write_dataframe(
            layer,
            temporary,
            layer=name,
            driver="FlatGeobuf",
            use_arrow=True,
            layer_options={"DESCRIPTION": LAYERS[name].what, "TITLE": LAYERS[name].title},
        )

"""Tables with geometry from files: GeoPackage, GeoJSON, Shapefile, FlatGeobuf, GeoParquet ..."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from uxsim_geo.errors import Faults
from uxsim_geo.network.own_data import check_own_data

if TYPE_CHECKING:
    import geopandas

PARQUET = (".parquet", ".geoparquet", ".pq")


def read_vector_file(
    path: Path, layer: str | None, faults: Faults
) -> geopandas.GeoDataFrame | None:
    """The table in a file, or in one of its layers; None, and a fault, where there is none."""
    if not path.exists():
        faults.add("there is no such file")
        return None
    if path.is_dir() and path.suffix.lower() != ".gdb":
        faults.add("is a folder, a file was expected")
        return None
    if path.suffix.lower() in PARQUET:
        return _from_parquet(path, layer, faults)
    return _from_gdal(path, layer, faults)


def _from_parquet(path: Path, layer: str | None, faults: Faults) -> geopandas.GeoDataFrame | None:
    import geopandas
    import pyarrow as pa

    if layer is not None:
        faults.add("has no layers", column="layer", value=layer)
        return None
    try:
        return geopandas.read_parquet(path)
    except (OSError, ValueError, KeyError, pa.ArrowException) as error:
        faults.add(f"is no GeoParquet file: {error}")
        return None


def _from_gdal(path: Path, layer: str | None, faults: Faults) -> geopandas.GeoDataFrame | None:
    import geopandas
    import pyogrio
    from pyogrio.errors import DataLayerError, DataSourceError, FeatureError, GeometryError

    try:
        check_own_data(path)
        layers = [str(name) for name, _ in pyogrio.list_layers(path)]
        if layer is None and len(layers) != 1:
            held = ", ".join(layers) or "none"
            faults.add(f"must hold one layer, or layer must name it; it holds {held}")
            return None
        if layer is not None and layer not in layers:
            faults.add(f"has no such layer, only {', '.join(layers)}", column="layer", value=layer)
            return None
        table = pyogrio.read_dataframe(path, layer=layer or layers[0])
    except (DataLayerError, DataSourceError, FeatureError, GeometryError) as error:
        faults.add(f"cannot be read as a table with geometry: {error}")
        return None
    except OSError as error:
        faults.add(f"cannot be read: {error}")
        return None
    except UnicodeDecodeError as error:
        faults.add(f"has text in another encoding than it says: {error}")
        return None
    if not isinstance(table, geopandas.GeoDataFrame):
        faults.add("has no geometry: lines were expected")
        return None
    return table

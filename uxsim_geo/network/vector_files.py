"""Tables with geometry from files: GeoPackage, GeoJSON, Shapefile, FlatGeobuf, GeoParquet ..."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from uxsim_geo.damage import damage_as_fault
from uxsim_geo.errors import Faults
from uxsim_geo.network.own_data import holds_own_data
from uxsim_geo.parquet import check_parquet

if TYPE_CHECKING:
    import geopandas

PARQUET = (".parquet", ".geoparquet", ".pq")


def read_vector_file(
    path: Path, layer: str | None, faults: Faults
) -> geopandas.GeoDataFrame | None:
    """The table in a file, or in one of its layers; None, and a fault, where there is none."""
    import geopandas

    if not is_there(path, faults):
        return None
    is_parquet = path.suffix.lower() in PARQUET
    table = _from_parquet(path, layer, faults) if is_parquet else _from_gdal(path, layer, faults)
    if table is None or faults.found:
        return None
    if not isinstance(table, geopandas.GeoDataFrame):
        faults.add("has no geometry: lines, points or areas were expected")
        return None
    return table


def is_there(path: Path, faults: Faults) -> bool:
    """Whether there is a file, or a folder that GDAL takes for one, which may be read."""
    before = len(faults.found)
    if not path.exists():
        faults.add("there is no such file")
    elif path.is_dir() and path.suffix.lower() != ".gdb":
        faults.add("is a folder, a file was expected")
    elif path.is_file():
        try:
            with path.open("rb"):
                pass
        except OSError as error:
            faults.add(f"cannot be read: {error.strerror}")
    return len(faults.found) == before


def layers_of(path: Path, faults: Faults) -> dict[str, str | None]:
    """The names of the layers of a file, and their kinds of geometry: None of a plain table."""
    import pyogrio

    if not holds_own_data(path, faults):
        return {}
    with damage_as_fault(faults, "cannot be read as a table"):
        return {str(name): shape for name, shape in pyogrio.list_layers(path)}
    return {}


def read_layer(path: Path, layer: str, faults: Faults, **options: Any) -> Any:
    """A layer as a table; None, and a fault, if it cannot be read; ``options``: of pyogrio."""
    import pyogrio

    with damage_as_fault(faults, "cannot be read as a table"):
        return pyogrio.read_dataframe(path, layer=layer, **options)
    return None


def _from_parquet(path: Path, layer: str | None, faults: Faults) -> Any:
    import geopandas

    if layer is not None:
        faults.add("has no layers", column="layer", value=layer)
        return None
    if not check_parquet(path, faults):
        return None
    with damage_as_fault(faults, "is no GeoParquet file"):
        return geopandas.read_parquet(path)
    return None


def _from_gdal(path: Path, layer: str | None, faults: Faults) -> Any:
    layers = layers_of(path, faults)
    if faults.found:
        return None
    # programs keep styles and the like in tables without geometry beside the layer
    drawn = [name for name, shape in layers.items() if shape is not None] or list(layers)
    if layer is None and len(drawn) != 1:
        held = ", ".join(drawn) or "none"
        faults.add(f"must hold one layer, or layer must name it; it holds {held}")
        return None
    if layer is not None and layer not in layers:
        faults.add(f"has no such layer, only {', '.join(layers)}", column="layer", value=layer)
        return None
    return read_layer(path, layer or drawn[0], faults)

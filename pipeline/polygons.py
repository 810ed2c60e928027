"""Areas of a network by the polygons of a file that the user names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from uxsim_geo.errors import Fault, Faults, InputError

if TYPE_CHECKING:
    import geopandas as gpd

    from uxsim_geo.network.network import Network


class PolygonFile(NamedTuple):
    """A file of polygons: what the user calls it (``--areas``), its path, the column of names."""

    key: str
    path: Path
    column: str = "name"


def areas_in(
    network: Network, file: PolygonFile, find: Callable[..., dict[str, list[str]]], kind: str
) -> tuple[dict[str, list[str]], list[str]]:
    """What lies in each polygon: the areas that hold something, and the names of the others.

    ``find`` is a function of :mod:`uxsim_geo.analysis.areas`, and ``kind`` says of what: link or
    node. Raises :class:`uxsim_geo.errors.InputError` for a file that cannot be read or laid over
    the network, and where no area holds anything.
    """
    polygons = _polygons(file)
    try:
        areas = find(network, polygons, file.column)
    except InputError as error:
        source = f"{file.key} {file.path}"
        raise InputError([replace(fault, source=source) for fault in error.faults]) from None
    filled = {name: members for name, members in areas.items() if members}
    if not filled:
        what = f"{file.key}: no {kind} of the network lies in any of them; is their CRS right?"
        raise InputError([Fault(what, value=file.path)])
    return filled, [name for name in areas if name not in filled]


def _polygons(file: PolygonFile) -> gpd.GeoDataFrame:
    from uxsim_geo.network.vector_files import read_vector_file

    faults = Faults()
    polygons = read_vector_file(file.path, None, faults)
    if polygons is None:
        told = (f"{file.key}: {fault.what}" for fault in faults.found)
        raise InputError(Fault(what, value=file.path) for what in told)
    return polygons

"""All layers of a run, by name: what ``results.gpkg`` and the archives hold."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import pandas as pd

from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.analysis.state_grid import States
from uxsim_geo.export.columns import LAYERS
from uxsim_geo.export.layers import (
    LinkTimes,
    links_layer,
    nodes_layer,
    notes_layer,
    run_info_layer,
)
from uxsim_geo.export.od_layer import od_lines_layer
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.trajectory_layer import Sample, trajectories_layer
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: layers that every file has
ALWAYS = ("nodes", "links", "run_info")


@dataclass(frozen=True)
class Run:
    """A finished simulation: ``states`` of all links in all bins."""

    network: Network
    result: Result
    states: States
    passages: RunPassages


def layers_of_run(
    run: Run,
    description: RunDescription,
    wanted: Collection[str] = tuple(LAYERS),
    sample: Sample | None = None,
) -> dict[str, Any]:
    """Tables by the names of their layers, GeoDataFrames where the network has geometry.

    That of link_times is a :class:`uxsim_geo.export.layers.LinkTimes`, which makes it in parts.

    ``wanted`` beside those that every file has; ``sample`` says which trajectories. There are none
    without geometry. ``link_states`` comes with ``link_times``, as a view over it.
    """
    network, start = run.network, description.origin
    makers: dict[str, Callable[[], Any]] = {
        "nodes": lambda: nodes_layer(network),
        "links": lambda: links_layer(network, run.states, description.reaction_time),
        "link_times": lambda: LinkTimes.of(network, run.states, start),
        "od_lines": lambda: od_lines_layer(network, od_table(run.result, network)),
        "trajectories": lambda: trajectories_layer(
            run.result, network, run.passages, sample or Sample(), start
        ),
        "import_notes": lambda: notes_layer(description.notes),
        "run_info": lambda: run_info_layer(description.run_info),
    }
    return {name: makers[name]() for name in names_of_layers(network, wanted)}


def names_of_layers(network: Network, wanted: Collection[str]) -> tuple[str, ...]:
    """Those of ``wanted`` and those that every file has, as far as they are tables, in order."""
    names = {*wanted, *ALWAYS} - {"link_states"}
    if "geometry" not in network.links.columns:
        names.discard("trajectories")
    return tuple(name for name in LAYERS if name in names)


def without_m(layer: pd.DataFrame) -> pd.DataFrame:
    """The layer with coordinates of x, y and z at most, as much as pyogrio can write."""
    import shapely

    lines = layer["geometry"].to_numpy()
    if not shapely.has_m(lines).any():
        return layer
    # forcing two dimensions first leaves z behind, forcing three alone keeps m
    points = shapely.get_coordinates(lines, include_z=True)
    return layer.assign(
        geometry=shapely.set_coordinates(shapely.force_3d(shapely.force_2d(lines)), points)
    )

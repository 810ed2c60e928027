"""Density, flow or speed of a link, or of links one after the other, by time and place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.export.corridor import name_links, starts_of_links, title_of_links
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

State = Literal["density", "flow", "speed"]


class Look(NamedTuple):
    """How a state is shown: its label, the factor to people's units, and its colours."""

    label: str
    factor: float
    colours: str


#: dark is much traffic, or slow traffic
LOOKS: dict[str, Look] = {
    "density": Look("density, veh/km per lane (jam at the top)", PER_KM, "inferno_r"),
    "flow": Look("flow, veh/h per lane", PER_HOUR, "viridis_r"),
    "speed": Look("speed, km/h", KMH, "inferno"),
}

NOBODY = "#ffffff"


def space_time_states_figure(
    network: Network,
    cells: pd.DataFrame,
    link_ids: list[str],
    state: State = "density",
    size: tuple[float, float] = (12.0, 4.0),
) -> Figure:
    """Draw a state of links, one after the other upwards, by time and place.

    ``cells`` is what :func:`uxsim_geo.analysis.cells.space_time_cells` gives for these links (or
    more), ``state`` density or flow per lane, or speed. ``size`` in inches. White is where nobody
    was. The scale ends at the largest jam density, or free speed, of the links. Raises
    :class:`uxsim_geo.errors.InputError` for another state.
    """
    from matplotlib.figure import Figure

    if state not in LOOKS:
        faults = Faults()
        faults.add(f"must be {', '.join(LOOKS)}", column="state", value=state)
        faults.raise_if_any()
    links = network.links.set_index(network.links["link_id"].astype(str)).loc[link_ids]
    starts = starts_of_links(links["length"].to_numpy(float))
    look = LOOKS[state]
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    top = {"density": links["jam_density"].max(), "speed": links["free_speed"].max()}.get(state)
    own = [cells[cells["link_id"] == link_id] for link_id in link_ids]
    values = [
        _matrix(table, state, lanes) for table, lanes in zip(own, links["lanes"], strict=True)
    ]
    highest = top if top is not None else max(np.nanmax(one, initial=0.0) for one in values)
    mesh = None
    for table, matrix, start in zip(own, values, starts, strict=False):
        mesh = axes.pcolormesh(
            np.append(table["begin_s"].unique(), table["end_s"].iloc[-1]),
            start + np.append(table["begin_m"].unique(), table["end_m"].iloc[-1]),
            matrix.T * look.factor,
            cmap=look.colours,
            vmin=0.0,
            vmax=(highest or 1.0) * look.factor,
        )
    axes.set(title=title_of_links(link_ids), xlabel="time, s", ylabel="distance, m")
    axes.set_facecolor(NOBODY)
    name_links(axes, link_ids, starts, size[1])
    assert mesh is not None
    figure.colorbar(mesh, ax=axes, pad=0.01 if len(link_ids) == 1 else 0.08).set_label(look.label)
    return figure


def _matrix(cells: pd.DataFrame, state: str, lanes: float) -> np.ndarray:
    """A state of a link, shape (bins, cells), per lane if it is one of all; NaN: nobody."""
    values = cells[state].to_numpy(float) / (1.0 if state == "speed" else lanes)
    values = np.where(cells["time"].to_numpy(float) > 0, values, np.nan)
    return values.reshape(cells["begin_s"].nunique(), -1)

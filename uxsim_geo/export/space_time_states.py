"""Density, flow or speed of a link, or of links one after the other, by time and place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats
from uxsim_geo.errors import Faults
from uxsim_geo.export.corridor import name_links, note_nobody, starts_of_links, title_of_links
from uxsim_geo.export.map_sheet import speed_scale
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import PER_HOUR, PER_KM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

State = Literal["density", "flow", "speed"]


class Look(NamedTuple):
    """How a state is shown: its label, and its colours; None: those of speeds in all pictures."""

    label: str
    colours: str | None


#: the darker, the more traffic
LOOKS: dict[str, Look] = {
    "density": Look("density, veh/km per lane (jam at the top)", "inferno_r"),
    "flow": Look("flow, veh/h per lane", "viridis_r"),
    "speed": Look("speed, % of free speed", None),
}


def space_time_states_figure(  # noqa: PLR0913 -- how it looks, by keyword or by default
    network: Network,
    cells: pd.DataFrame,
    link_ids: list[str],
    state: State = "density",
    size: tuple[float, float] = (12.0, 4.0),
    *,
    reaction_time: float | None = None,
) -> Figure:
    """Draw a state of links, one after the other upwards, by time and place.

    ``cells`` is what :func:`uxsim_geo.analysis.cells.space_time_cells` gives for these links (or
    more), ``state`` density or flow per lane, or speed relative to free speed. ``size`` in inches.
    White is where nobody was. The scale of density ends at the largest jam density of the links,
    that of flow at their largest capacity for ``reaction_time``, s (None: at the largest flow).
    Raises :class:`uxsim_geo.errors.InputError` for another state.
    """
    from matplotlib.figure import Figure

    if state not in LOOKS:
        faults = Faults()
        faults.add(f"must be {', '.join(LOOKS)}", column="state", value=state)
        faults.raise_if_any()
    links = network.links.set_index(network.links["link_id"].astype(str)).loc[link_ids]
    starts = starts_of_links(links["length"].to_numpy(float))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    own = [cells[cells["link_id"] == link_id] for link_id in link_ids]
    values = [
        _matrix(table, state, link) for table, (_, link) in zip(own, links.iterrows(), strict=True)
    ]
    style = _style(state, values, _top(state, links, reaction_time))
    for table, matrix, start in zip(own, values, starts, strict=False):
        mesh = axes.pcolormesh(
            np.append(table["begin_s"].unique(), table["end_s"].iloc[-1]),
            start + np.append(table["begin_m"].unique(), table["end_m"].iloc[-1]),
            matrix.T,
            **style,
        )
    axes.set(title=title_of_links(link_ids), xlabel="time, s", ylabel="distance, m")
    name_links(axes, link_ids, starts, size[1])
    bar = figure.colorbar(mesh, ax=axes, pad=0.01)
    end = " (capacity at the top)" if state == "flow" and reaction_time is not None else ""
    bar.set_label(f"{LOOKS[state].label}{end}")
    if not any(np.isfinite(matrix).any() for matrix in values):
        note_nobody(axes)
    return figure


def _matrix(cells: pd.DataFrame, state: str, link: pd.Series[Any]) -> Floats:
    """A state of a link in the units of its label, shape (bins, cells); NaN: nobody was there."""
    factor = {
        "density": PER_KM / link["lanes"],
        "flow": PER_HOUR / link["lanes"],
        "speed": 100.0 / link["free_speed"],
    }[state]
    values = np.where(cells["time"] > 0, cells[state] * factor, np.nan)
    if state == "speed":
        values = np.minimum(values, 100.0)  # rounding, beyond the last class
    return values.reshape(cells["begin_s"].nunique(), -1)


def _top(state: str, links: pd.DataFrame, reaction_time: float | None) -> float | None:
    """Where the scale of a state per lane ends, in the units of its label; None: at the largest."""
    if state == "density":
        return float(links["jam_density"].max()) * PER_KM
    if state == "flow" and reaction_time is not None:
        per_lane = effective_capacity(links, reaction_time) / links["lanes"].to_numpy(float)
        return float(per_lane.max()) * PER_HOUR
    return None


def _style(state: str, values: list[Floats], top: float | None) -> dict[str, Any]:
    """Colours and the ends of their scale."""
    colours = LOOKS[state].colours
    if colours is None:
        classes, norm = speed_scale()
        return {"cmap": classes, "norm": norm}
    if top is None:
        top = max((float(np.nanmax(one, initial=0.0)) for one in values), default=0.0) or 1.0
    return {"cmap": colours, "vmin": 0.0, "vmax": top}

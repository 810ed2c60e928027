"""Density of a link by time and place."""

from __future__ import annotations

from typing import TYPE_CHECKING

from uxsim_geo.analysis.samples import Cells
from uxsim_geo.network.units import PER_KM

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def density_figure(
    cells: Cells, link_id: str, jam_density: float, size: tuple[float, float] = (12.0, 4.0)
) -> Figure:
    """Draw the density of a link's cells, on a scale that ends at its jam density, veh/m.

    ``size`` in inches.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    mesh = axes.pcolormesh(
        cells.time,
        cells.place,
        cells.density.T * PER_KM,
        cmap="inferno_r",
        vmin=0.0,
        vmax=jam_density * PER_KM,
    )
    axes.set(title=f"link {link_id}", xlabel="time, s", ylabel="distance, m")
    bar = figure.colorbar(mesh, ax=axes, pad=0.01)
    bar.set_label("density, veh/km of the link (jam at the top)")
    return figure

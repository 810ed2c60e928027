"""The plots of a report: from its material to pictures and films."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.attribution import attribution
from pipeline.config import Config
from pipeline.config_keys import ChosenLinks
from pipeline.material import Material
from pipeline.plot_config import PlotEntry, PlotName
from pipeline.results_files import driving_side
from pipeline.yaml_source import place_in_words
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from uxsim_geo.network.network import Network

#: in a run's folder
FOLDER = "plots"

#: told which share of a film is done, 0 to 1
Progress = Callable[[float], None]

#: plots that need coordinates
MAPS = frozenset(
    {"network_average", "network", "network_plan", "desire_lines", "network_anim", "network_fancy"}
)


#: plots of links that follow one another
CORRIDORS = frozenset({"time_space_diagram_traj_links", "time_space_diagram_state_links"})


def check_plots(config: Config, network: Network) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` with all that plots ask for in vain."""
    faults = []
    for number, entry in enumerate(config.report.plots):
        place = ("report", "plots", number)
        told = f"{place_in_words(place)} ({entry.plot})"
        for what, value in _faults(entry, network, config):
            faults.append(Fault(f"{told}: {what}", *config.report.origin(place), value=value))
    if faults:
        raise InputError(faults)


def _faults(entry: PlotEntry, network: Network, config: Config) -> Iterator[tuple[str, object]]:
    """What a plot asks for in vain, and the value that says so."""
    duration = config.simulate.duration_s
    yield from _faults_of_links(entry, network)
    yield from _faults_of_number(entry, network, config)
    if entry.time_s is not None and entry.time_s > duration:
        yield f"time_s: is after the end of the simulation, {duration:g} s", entry.time_s
    if entry.plot in MAPS and "geometry" not in network.links.columns:
        yield "the network has no coordinates: there is no map to draw", None
    if entry.region is not None:
        yield from _faults_of_region(entry.region, network)


def _faults_of_links(entry: PlotEntry, network: Network) -> Iterator[tuple[str, object]]:
    links = network.links
    known = {str(name): row for row, name in enumerate(links["link_id"])}
    rows = [known.get(name, -1) for name in entry.links]
    for name, row in zip(entry.links, rows, strict=True):
        if row < 0:
            yield "links: the network has no such link", name
    if entry.plot not in CORRIDORS or min(rows) < 0:
        return
    for before, after in pairwise(rows):
        ends, begins = links["to_node_id"].iloc[before], links["from_node_id"].iloc[after]
        if ends != begins:
            what = f"links: begins at node {begins}, the one before it ends at {ends}"
            yield what, str(links["link_id"].iloc[after])


def _faults_of_number(
    entry: PlotEntry, network: Network, config: Config
) -> Iterator[tuple[str, object]]:
    """What would be too many links, cells or pictures."""
    from uxsim_geo.analysis.table_size import MOST_CELLS
    from uxsim_geo.export.fundamental_diagram import MOST_LINKS

    duration = config.simulate.duration_s
    bin_s = entry.bin_s or config.report.bin_s
    if entry.plot == "fundamental_diagram" and len(entry.links) > MOST_LINKS:
        yield f"links: at most {MOST_LINKS} can be told apart", len(entry.links)
    if entry.plot == "time_space_diagram_state_links":
        own = network.links["link_id"].astype(str).isin(entry.links)
        cells = -(-network.links.loc[own, "length"] // entry.cell_m)
        if float(cells.sum()) * duration / bin_s > MOST_CELLS:
            what = f"cell_m: makes more than {MOST_CELLS:,} cells; take longer ones or longer bins"
            yield what, entry.cell_m
    if entry.plot == "network_anim":
        yield from _faults_of_film("bin_s", bin_s, duration)
    if entry.plot == "network_fancy":
        yield from _faults_of_film("interval_s", _interval(entry, config), duration)


def _faults_of_film(key: str, interval: float, duration: float) -> Iterator[tuple[str, object]]:
    from uxsim_geo.analysis.table_size import shortest_step
    from uxsim_geo.export.film import MOST_PICTURES

    if duration / interval > MOST_PICTURES:
        shortest = shortest_step(duration, MOST_PICTURES)
        what = f"{key}: makes more than {MOST_PICTURES:,} pictures; take {shortest:g} s or more"
        yield what, interval
    elif key == "interval_s" and interval > duration:
        yield f"{key}: is longer than the simulation, {duration:g} s", interval


def _interval(entry: PlotEntry, config: Config) -> float:
    """Between two pictures of vehicles, s: of a short run no more than the run."""
    simulated = config.simulate
    usual = 5 * simulated.reaction_time_s * simulated.platoon_size
    return entry.interval_s or min(usual, simulated.duration_s)


def _faults_of_region(region: ChosenLinks, network: Network) -> Iterator[tuple[str, object]]:
    from uxsim_geo.network.selection import select_links

    try:
        if not len(select_links(network, region.target())):
            yield "region: no link is meant", None
    except InputError as error:
        for fault in error.faults:
            yield f"region: {fault}", None


def write_plot(material: Material, entry: PlotEntry, path: Path, progress: Progress) -> None:
    """Draw a plot and write it; ``progress`` is told how far a film has come."""
    from uxsim_geo.export.attribution import add_attribution
    from uxsim_geo.export.saving import save_figure

    if entry.plot in FIGURES:
        figure = FIGURES[entry.plot](material, entry)
        add_attribution(figure, attribution(material.config))
        save_figure(figure, path)
    else:
        FILMS[entry.plot](material, entry, path, progress)


def _states(material: Material, entry: PlotEntry) -> pd.DataFrame:
    return material.states if entry.bin_s is None else material.states_in(entry.bin_s)


def _network_average(material: Material, entry: PlotEntry) -> Figure:  # noqa: ARG001
    from uxsim_geo.analysis.link_states import link_totals
    from uxsim_geo.export.plots import network_state_figure

    totals = link_totals(material.states)
    title = f"{material.config.name}: 0 to {material.result.settings.duration:,.0f} s"
    side = driving_side(material.config)
    return network_state_figure(material.network, totals, title, driving_side=side)


def _network(material: Material, entry: PlotEntry) -> Figure:
    from uxsim_geo.export.plots import network_at_time_figure

    assert entry.time_s is not None
    states = _states(material, entry)
    side, title = driving_side(material.config), material.config.name
    return network_at_time_figure(material.network, states, entry.time_s, title, side)


def _network_plan(material: Material, entry: PlotEntry) -> Figure:  # noqa: ARG001
    from uxsim_geo.export.network_plan import network_figure

    side = driving_side(material.config)
    return network_figure(
        material.network, material.config.name, size=(8.0, 8.0), driving_side=side
    )


def _macroscopic_fundamental_diagram(material: Material, entry: PlotEntry) -> Figure:
    from uxsim_geo.analysis.network_states import network_states
    from uxsim_geo.export.plots import mfd_figure
    from uxsim_geo.network.selection import select_links

    states, title = _states(material, entry), material.config.name
    if entry.region is not None:
        target = entry.region.target()
        rows = select_links(material.network, target)
        ids = material.network.links["link_id"].iloc[rows].astype(str)
        states, title = states[states["link_id"].isin(ids)], f"{title}: {target}"
    return mfd_figure(network_states(states, material.network), title)


def _trajectories(material: Material, entry: PlotEntry) -> Figure:
    from uxsim_geo.export.trajectories import trajectories_figure

    duration = material.result.settings.duration
    figure = trajectories_figure(
        material.network,
        material.passages_on(entry.links),
        entry.links,
        duration,
        by_speed=entry.by_speed,
    )
    return _with_reds(figure, material, entry)


def _states_of_links(material: Material, entry: PlotEntry) -> Figure:
    from uxsim_geo.analysis.cells import space_time_cells
    from uxsim_geo.export.space_time_states import space_time_states_figure

    cells = space_time_cells(
        material.result,
        material.network,
        bin_s=entry.bin_s or material.config.report.bin_s,
        cell_m=entry.cell_m,
        links=entry.links,
        passages=material.passages.whole,
    )
    links = list(entry.links)
    tau = material.result.settings.reaction_time
    figure = space_time_states_figure(
        material.network, cells, links, entry.state, reaction_time=tau
    )
    return _with_reds(figure, material, entry)


def _with_reds(figure: Figure, material: Material, entry: PlotEntry) -> Figure:
    """Mark the red of signals at the ends of links."""
    from uxsim_geo.export.corridor import draw_reds

    duration = material.result.settings.duration
    reds = [
        [red for signal in material.signals for red in signal.reds(link, duration)]
        for link in entry.links
    ]
    links = material.network.links
    lengths = links.set_index(links["link_id"].astype(str))["length"].loc[list(entry.links)]
    draw_reds(figure, lengths.to_numpy(float), reds)
    return figure


def _cumulative_curves(material: Material, entry: PlotEntry) -> Figure:
    from uxsim_geo.export.cumulative import cumulative_figure

    duration = material.result.settings.duration
    passages = material.passages_on(entry.links[:1])
    return cumulative_figure(material.network, passages, entry.links[0], duration)


def _fundamental_diagram(material: Material, entry: PlotEntry) -> Figure:
    from uxsim_geo.export.fundamental_diagram import fundamental_diagram_figure

    return fundamental_diagram_figure(
        material.network,
        _states(material, entry),
        entry.links,
        material.result.settings.reaction_time,
        material.config.name,
    )


def _travel_times(material: Material, entry: PlotEntry) -> Figure:  # noqa: ARG001
    from uxsim_geo.export.travel_times import travel_times_figure

    result = material.result
    return travel_times_figure(
        result.trips, material.config.name, duration=result.settings.duration
    )


def _desire_lines(material: Material, entry: PlotEntry) -> Figure:
    from uxsim_geo.analysis.od import od_table
    from uxsim_geo.export.desire_lines import desire_lines_figure

    pairs = od_table(material.result, material.network)
    return desire_lines_figure(material.network, pairs, material.config.name, most=entry.most)


def _network_anim(material: Material, entry: PlotEntry, path: Path, progress: Progress) -> None:
    from uxsim_geo.export.moving_links import animate_links

    states = _states(material, entry)
    animate_links(
        material.network,
        states,
        path,
        frame_ms=entry.frame_ms,
        driving_side=driving_side(material.config),
        attribution=attribution(material.config),
        progress=progress,
    )


def _network_fancy(material: Material, entry: PlotEntry, path: Path, progress: Progress) -> None:
    import numpy as np

    from uxsim_geo.analysis.samples import Samples, is_of_share
    from uxsim_geo.export.moving_vehicles import animate_vehicles

    duration = material.result.settings.duration
    vehicles = np.arange(len(material.result.trips))
    passages = material.passages.around(is_of_share(vehicles, entry.share))
    samples = Samples.of(passages, _interval(entry, material.config), duration)
    animate_vehicles(
        material.network,
        passages,
        samples.of_share(passages, entry.share),
        path,
        frame_ms=entry.frame_ms,
        trail=entry.trail,
        driving_side=driving_side(material.config),
        attribution=attribution(material.config),
        progress=progress,
    )


FIGURES: dict[PlotName, Callable[[Material, PlotEntry], Figure]] = {
    "network_average": _network_average,
    "network": _network,
    "network_plan": _network_plan,
    "macroscopic_fundamental_diagram": _macroscopic_fundamental_diagram,
    "time_space_diagram_traj_links": _trajectories,
    "time_space_diagram_state_links": _states_of_links,
    "cumulative_curves": _cumulative_curves,
    "fundamental_diagram": _fundamental_diagram,
    "travel_times": _travel_times,
    "desire_lines": _desire_lines,
}

FILMS: dict[PlotName, Callable[[Material, PlotEntry, Path, Progress], None]] = {
    "network_anim": _network_anim,
    "network_fancy": _network_fancy,
}

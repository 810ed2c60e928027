"""Signal plans for nodes where a network says that a signal stands, but not how it is timed.

Phases follow from where the links come from (:mod:`uxsim_geo.network.signal_phases`), cycle and
greens from what they carry (:mod:`uxsim_geo.network.signal_times`). All of it is an assumption, in
a table that one can edit (:mod:`uxsim_geo.network.signal_table`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.bearings import arrival_bearings
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import add_rows
from uxsim_geo.network.signal_options import SignalOptions
from uxsim_geo.network.signal_phases import Phase, group_phases, separate_phases, street_grain
from uxsim_geo.network.signal_rows import SignalRow, table_of
from uxsim_geo.network.signal_times import assumed_cycle, greens, webster_cycle
from uxsim_geo.network.signal_volumes import flow_ratios

Floats = npt.NDArray[np.float64]

#: neighbours from which on a node is a junction
JUNCTION = 3


@dataclass(frozen=True)
class _Junction:
    """A node with a signal and the links that end there, one value a link.

    neighbours: how many; ids: of the links; bearings: degrees, NaN if unknown; weights: assumed
    load; ratios: volume over saturation flow, NaN where there is no volume; grain: degrees, the
    direction of the streets of the whole network.
    """

    node_id: str
    neighbours: int
    ids: Sequence[str]
    bearings: Floats
    weights: Floats
    ratios: Floats
    grain: float


def signal_plans(
    network: Network,
    options: SignalOptions | None = None,
    *,
    volumes: pd.DataFrame | None = None,
    notes: Notes | None = None,
) -> pd.DataFrame:
    """A plan for every node whose control is ``signal``: one row a node, phase and link.

    The columns are :data:`uxsim_geo.network.signal_rows.COLUMNS`: node_id (text), phase (from 1,
    in their order in the cycle), link_id (text, ends at the node; null: a phase in which nobody
    drives), green_s, all_red_s (after the green), offset_s (when a first phase begins), cycle_s
    (the sum of greens and all-red times) and source, here ``assumed``. Nodes stand in the order of
    their table, the links of a phase in that of theirs.

    ``volumes`` has link_id and volume_veh_h (float64). A node with volumes on all of its in-links
    gets Webster's cycle and split; any other gets a cycle by its number of phases, split by the
    capacity of the largest approach of each phase times how busy its class is. Signals at which
    no two approaches meet are left out. ``notes`` collects what was assumed and left out.

    Raises :class:`uxsim_geo.errors.InputError` with every fault of the volumes, or for links that
    lack what gives them a capacity.
    """
    options = options or SignalOptions()
    notes = notes if notes is not None else Notes()
    rows: list[SignalRow] = []
    told = _Told()
    for junction in _junctions(network, options, volumes):
        rows += _plan(junction, options, told, with_volumes=volumes is not None)
    told.note(notes)
    if rows:
        number = len({row.node_id for row in rows})
        note = "signals whose phases, cycle and greens are assumed by rule; value: nodes"
        notes.add("signal timings assumed", note, element="node", value=number)
    return table_of(rows)


class _Told:
    """Ids of nodes, and a value of each, by what is to be noted about them."""

    TEXTS = (
        ("signal needs no plan", "no two links end here: the signal is left out"),
        ("signal at no junction", "has at most two neighbours: the signal is left out"),
        ("signal without conflict", "all in-links would share one phase: it is left out"),
        ("signal without directions", "a link has no usable line: each has a phase of its own"),
        ("signal without volumes", "links (value) lack a volume: cycle and split are assumed"),
        ("signal overloaded", "critical flow ratios sum to 1 or more (value): the longest cycle"),
    )

    def __init__(self) -> None:
        self.found: dict[str, list[tuple[str, object]]] = {topic: [] for topic, _ in self.TEXTS}

    def add(self, topic: str, node_id: str, value: object = None) -> None:
        """Remember a node."""
        self.found[topic].append((node_id, value))

    def note(self, notes: Notes) -> None:
        """Note all that was remembered, topic by topic."""
        for topic, text in self.TEXTS:
            ids = [node_id for node_id, _ in self.found[topic]]
            values = [value for _, value in self.found[topic]]
            notes.add_each(topic, text, ids, element="node", values=values)


def _junctions(
    network: Network, options: SignalOptions, volumes: pd.DataFrame | None
) -> list[_Junction]:
    """All nodes with a signal, in the order of the nodes."""
    nodes, all_links = network.nodes, network.links
    capacity = effective_capacity(all_links, options.reaction_time)
    ratios = flow_ratios(all_links["link_id"], capacity, volumes)
    if "control" not in nodes:
        return []
    signals = nodes.loc[nodes["control"] == "signal", "node_id"].tolist()
    node_of = pd.Index(signals).get_indexer(pd.Index(all_links["to_node_id"]))
    rows = np.flatnonzero(node_of >= 0)
    rows = rows[np.argsort(node_of[rows], kind="stable")]
    ends = np.searchsorted(node_of[rows], np.arange(len(signals) + 1))
    links = all_links.iloc[rows]
    _check_capacity(links, capacity[rows])
    ids = links["link_id"].tolist()
    bearings = arrival_bearings(links, options.look_back)
    weights = capacity[rows] * _loads(links, options)
    neighbours = _neighbours(all_links)
    grain = street_grain(bearings, weights)
    return [
        _Junction(
            node_id,
            neighbours.get(node_id, 0),
            ids[first:last],
            bearings[first:last],
            weights[first:last],
            ratios[rows[first:last]],
            grain,
        )
        for node_id, first, last in zip(signals, ends[:-1], ends[1:], strict=True)
    ]


def _check_capacity(links: pd.DataFrame, capacity: Floats) -> None:
    """Raise where links that end at a signal have no capacity by which to weigh them."""
    faults = Faults("links")
    with np.errstate(invalid="ignore"):
        wrong = ~(capacity > 0.0)
    advice = "give lanes, free_speed and jam_density, or a capacity above 0, to time its signal"
    add_rows(faults, wrong, "no capacity", ids=links["link_id"], advice=advice)
    faults.raise_if_any()


def _loads(links: pd.DataFrame, options: SignalOptions) -> Floats:
    """How busy a lane of each link is, by its class; shape (links,)."""
    if "road_class" not in links:
        return np.ones(len(links))
    loads = options.class_loads
    return np.array([loads.get(name, 1.0) for name in links["road_class"].tolist()])


def _neighbours(links: pd.DataFrame) -> dict[str, int]:
    """The number of nodes that each node has links from or to, itself not counted."""
    ends = ["from_node_id", "to_node_id"]
    ahead = links[ends].set_axis(["node", "other"], axis=1)
    back = links[ends[::-1]].set_axis(["node", "other"], axis=1)
    both = pd.concat([ahead, back]).drop_duplicates()
    counts = both.loc[both["node"] != both["other"], "node"].value_counts()
    return dict(zip(counts.index.tolist(), counts.tolist(), strict=True))


def _plan(
    junction: _Junction, options: SignalOptions, told: _Told, *, with_volumes: bool
) -> list[SignalRow]:
    """The rows of a node; none where it needs no signal."""
    phases, pedestrians = _phases(junction, options, told)
    if not phases:
        return []
    lacking = int(np.isnan(junction.ratios).sum())
    if with_volumes and lacking:
        told.add("signal without volumes", junction.node_id, lacking)
    lost = options.all_red * (len(phases) + pedestrians) + options.pedestrian_green * pedestrians
    if lacking:
        weights = [max(_sum(junction.weights, own) for own in phase) for phase in phases]
        cycle = assumed_cycle(len(phases) + pedestrians, options)
    else:
        weights = [max(_largest(junction.ratios, own) for own in phase) for phase in phases]
        cycle = webster_cycle(weights, lost, options)
        if sum(weights) >= 1.0:
            told.add("signal overloaded", junction.node_id, sum(weights))
    durations = greens(cycle, lost, weights, options)
    return _rows(junction, phases, durations, options, pedestrians=pedestrians)


def _rows(
    junction: _Junction,
    phases: Sequence[Phase],
    durations: Sequence[int],
    options: SignalOptions,
    *,
    pedestrians: int,
) -> list[SignalRow]:
    """The rows of a node whose phases last so many s, links in the order of their table."""
    links = [sorted(link for own in phase for link in own) for phase in phases]
    names: list[list[str | None]] = [[junction.ids[link] for link in own] for own in links]
    names += [[None]] * pedestrians
    lasting = [*map(float, durations), *[options.pedestrian_green] * pedestrians]
    cycle = sum(lasting) + options.all_red * len(lasting)
    return [
        SignalRow(junction.node_id, number, name, green, options.all_red, 0.0, cycle, "assumed")
        for number, (green, own) in enumerate(zip(lasting, names, strict=True), start=1)
        for name in own
    ]


def _sum(values: Floats, links: Sequence[int]) -> float:
    return float(sum(values[link] for link in links))


def _largest(values: Floats, links: Sequence[int]) -> float:
    return float(max(values[link] for link in links))


def _phases(junction: _Junction, options: SignalOptions, told: _Told) -> tuple[list[Phase], int]:
    """The phases of a node and how many more are for pedestrians; none where it needs no signal."""
    links = len(junction.ids)
    if links and junction.neighbours < JUNCTION and options.crossings == "pedestrians":
        return [(tuple(range(links)),)], 1
    if links < 2:
        told.add("signal needs no plan", junction.node_id)
        return [], 0
    if junction.neighbours < JUNCTION:
        told.add("signal at no junction", junction.node_id)
        return [], 0
    if np.isnan(junction.bearings).any():
        told.add("signal without directions", junction.node_id)
        return separate_phases(links), 0
    phases = group_phases(
        junction.bearings.tolist(), junction.weights.tolist(), options, grain=junction.grain
    )
    if len(phases) < 2:
        told.add("signal without conflict", junction.node_id)
        return [], 0
    return phases, 0

"""What a world has simulated so far, in the forms that tables and figures need."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import pandas as pd

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.world import options
from uxsim_geo.world.elements import unknown
from uxsim_geo.world.links import Link
from uxsim_geo.world.nodes import Node
from uxsim_geo.world.scenario import signals_of

if TYPE_CHECKING:
    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result
    from uxsim_geo.world.world import World

#: one link, by name or itself
AnyLink = Link | str


class Sight:
    """The result of a world up to where its simulation stands.

    Raises RuntimeError before anything has been simulated.
    """

    def __init__(self, world: World) -> None:
        if world.TIME <= 0:
            raise RuntimeError("nothing has been simulated yet: call exec_simulation() first")
        self.W = world
        self.source = world.result
        now = replace(self.source.settings, duration=world.TIME)
        self._result: Result = replace(self.source, settings=now)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(options.absent("Analyzer", name, dir(type(self))))

    @property
    def _network(self) -> Network:
        return self.W.network

    @cached_property
    def _states(self) -> pd.DataFrame:
        return self._states_of_bins(self.W.EULAR_DT)

    def _states_of_bins(self, bin_s: float) -> pd.DataFrame:
        bin_s = min(bin_s, self._result.settings.duration)
        return link_times(self._result, self._network, bin_s=bin_s, passages=self._passages)

    @cached_property
    def _passages(self) -> Passages:
        return Passages.of(self._result, self._network)

    @cached_property
    def _samples(self) -> Samples:
        return Samples.of(self._passages, self.W.DELTAT, self._result.settings.duration)

    def _links(self, links: AnyLink | Iterable[AnyLink] | None, *, least: int = 0) -> list[Link]:
        """Give links, or all; raises InputError for one that is not there, or fewer than least."""
        if links is None:
            return self.W.LINKS
        chosen = [links] if isinstance(links, Link | str) else list(links)
        if len(chosen) < least:
            raise InputError([Fault("there is none: name at least one", column="links")])
        return [self.W.get_link(link) for link in chosen]

    def _states_of_links(self, links: AnyLink | Iterable[AnyLink] | None) -> pd.DataFrame:
        """States of some links, or of all; raises InputError for none, or one that is not there."""
        if links is None:
            return self._states
        names = [link.name for link in self._links(links, least=1)]
        return self._states[self._states["link_id"].isin(names)]

    def _reds(self, link: Link) -> list[tuple[float, float]]:
        """When the signal at the end of a link was red, s; of one moved by hand nothing is kept."""
        node = link.end_node
        if not node.cycle_length or self.W.has_moved(node):
            return []
        (signal,) = signals_of([node], Faults())
        return signal.reds(link.name, self._result.settings.duration)

    def _cell_size(self, link: Link) -> float:
        """Length of cells, m: tenths of the link that a step cannot jump over."""
        longest = max(link.length / 10, link.free_flow_speed * self.W.DELTAT)
        return link.length / max(1, int(link.length // longest))

    @cached_property
    def _names(self) -> list[str]:
        """Names of the platoons by their row of the trips."""
        names = [str(row) for row in range(len(self._result.trips))]
        for name, row in self.W.rows_of_added_vehicles().items():
            names[row] = name
        return names

    def _areas(
        self, areas: Sequence[Iterable[Node | str]], names: Sequence[str] | None
    ) -> dict[str, list[str]]:
        """Names of the nodes of each area, by its name."""
        if isinstance(areas, str) or any(isinstance(area, str | Node) for area in areas):
            what = 'must be a list of lists of nodes, such as [["a", "b"], ["c"]]'
            raise InputError([Fault(what, column="areas", value=areas)])
        nodes = [[self.W.get_node(node).name for node in area] for area in areas]
        told = names or [f"area {number}" for number in range(len(nodes))]
        if len(set(told)) != len(nodes):
            what = f"must be a name of its own for each of {len(nodes)} areas"
            raise InputError([Fault(what, column="area_names", value=list(told))])
        return dict(zip(told, nodes, strict=True))

    def _row_of_vehicle(self, name: str | int) -> int:
        """Give the row of the trips of a vehicle added by name, or of a row given as such."""
        row = self.W.row_of_vehicle(str(name))
        if row is None and str(name).isdecimal():
            row = int(name)
        if row is None or row >= len(self._result.trips):
            raise unknown("vehicle", name, [])
        return row

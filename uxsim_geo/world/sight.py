"""What a world has simulated so far, in the forms that tables and figures need."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges
from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.world import options
from uxsim_geo.world.elements import unknown
from uxsim_geo.world.links import Link

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

    def _cell_edges(self, link: Link) -> tuple[Any, Any]:
        """Edges of cells: time bins, and tenths of the link that a step cannot jump over."""
        duration = self._result.settings.duration
        longest = max(link.length / 10, link.free_flow_speed * self.W.DELTAT)
        cells = max(1, int(link.length // longest))
        bins = bin_edges(duration, min(self.W.EULAR_DT, duration))
        return bins, np.linspace(0.0, link.length, cells + 1)

    def _row_of_vehicle(self, name: str | int) -> int:
        """Give the row of the trips of a vehicle added by name, or of a row given as such."""
        row = self.W.row_of_vehicle(str(name))
        if row is None and str(name).isdecimal():
            row = int(name)
        if row is None or row >= len(self._result.trips):
            raise unknown("vehicle", name, [])
        return row

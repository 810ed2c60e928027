"""What is shown of a study: its base, its scenarios with what was asked, and their comparisons."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.network.network import Network


class Scenario(NamedTuple):
    """name; edits (a sentence each); network; comparison with the base (None: no pair of runs)."""

    name: str
    edits: Sequence[str]
    network: Network
    comparison: Comparison | None


class FailedRun(NamedTuple):
    """scenario, seed, and why it did not come to its end."""

    scenario: str
    seed: int
    reason: str


@dataclass(frozen=True)
class Study:
    """A base and what scenarios change.

    about
        name, clock, attribution, provenance, and facts to show with them (``information``)
    base
        network of the base
    scenarios
        in the order in which they are told; names are all different
    failed
        runs that are missing
    base_name
        what the base is called
    """

    about: RunDescription
    base: Network
    scenarios: Sequence[Scenario]
    failed: Sequence[FailedRun] = ()
    base_name: str = "base"

    @property
    def clock(self) -> Clock:
        """The clock of its runs."""
        times = [comparison_of(entry).link_times for entry in self.compared]
        edges = [
            edge
            for table in times
            for name in ("begin_s", "end_s")
            for edge in table[name].unique()
        ]
        return Clock.of(self.about.start, edges)

    @property
    def compared(self) -> list[Scenario]:
        """Those of which there is a comparison."""
        return [scenario for scenario in self.scenarios if scenario.comparison is not None]


def comparison_of(scenario: Scenario) -> Comparison:
    """The comparison of one of :attr:`Study.compared`."""
    assert scenario.comparison is not None
    return scenario.comparison


def short_names(names: Iterable[str]) -> list[str]:
    """Names of tables and files for names of any kind: small letters, digits and _, all different.

    What says little is kept from being long: 40 letters at most.
    """
    taken: set[str] = set()
    found = []
    for name in names:
        plain = unicodedata.normalize("NFKD", name.casefold()).encode("ascii", "ignore").decode()
        short = re.sub(r"[^a-z0-9]+", "_", plain).strip("_")[:40] or "scenario"
        own, number = short, 1
        while own in taken:
            number += 1
            own = f"{short}_{number}"
        taken.add(own)
        found.append(own)
    return found


def joined_network(base: Network, others: Iterable[Network]) -> Network:
    """All links and nodes: those of the base first, then what others add, each once by its id.

    Geometry of the others is taken to be in the reference system of the base.
    """
    nodes, links = base.nodes, base.links
    for other in others:
        nodes = _with_new(nodes, other.nodes, "node_id")
        links = _with_new(links, other.links, "link_id")
    return replace(base, nodes=nodes, links=links)


def _with_new(table: pd.DataFrame, other: pd.DataFrame, key: str) -> pd.DataFrame:
    new = other[~other[key].astype(str).isin(table[key].astype(str))]
    if new.empty:
        return table
    if getattr(table, "crs", None) is not None and getattr(new, "crs", None) is not None:
        new = new.to_crs(table.crs)  # type: ignore[operator]
    return pd.concat([table, new], ignore_index=True)

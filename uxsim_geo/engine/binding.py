"""Measures bound to a network: what is wrong with them, told at once, and the rules they make."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, combinations

import numpy as np
import pandas as pd

from uxsim_geo.control.levers import QUANTITIES
from uxsim_geo.control.site import Measure, Rule, Site
from uxsim_geo.errors import Faults
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.network.selection import select_links
from uxsim_geo.settings import Settings


def site_of(network: Network, settings: Settings, class_names: Sequence[str], paths: Paths) -> Site:
    """Give control the network as plain arrays."""
    node_ids = pd.Index(network.nodes["node_id"].astype(str))
    links = network.links
    link_ids = pd.Index(links["link_id"].astype(str))

    def numbers(name: str) -> np.ndarray:
        return links[name].to_numpy(np.float64)

    return Site(
        link_ids=tuple(link_ids),
        node_ids=tuple(node_ids),
        from_node=node_ids.get_indexer(pd.Index(links["from_node_id"].astype(str))),
        to_node=node_ids.get_indexer(pd.Index(links["to_node_id"].astype(str))),
        length=numbers("length"),
        lanes=numbers("lanes"),
        free_speed=numbers("free_speed"),
        jam_density=numbers("jam_density"),
        capacity=effective_capacity(links, settings.reaction_time),
        merge_priority=numbers("merge_priority"),
        class_names=tuple(class_names),
        duration=settings.duration,
        step=settings.step,
        select=lambda target: select_links(network, target, link_ids=link_ids),
        drivable=lambda route: len(paths.arcs_along(route)),
    )


def bind(measures: Sequence[Measure], site: Site, faults: Faults) -> list[Rule]:
    """Bind measures to the site; their faults name them by their number, as line, from 1."""
    rules: list[Rule] = []
    measure_of_rule: list[int] = []
    for number, measure in enumerate(measures, start=1):
        own = Faults()
        bound = measure.rules(site, own)
        faults.add_of_entry(number, own)
        rules += bound
        measure_of_rule += [number] * len(bound)
    _add_conflicts(rules, measure_of_rule, site, faults)
    return rules


def _add_conflicts(
    rules: Sequence[Rule], measure_of_rule: Sequence[int], site: Site, faults: Faults
) -> None:
    """Note rules that write the same quantity of the same link or node at the same time."""
    for quantity in QUANTITIES:
        for first, second in _pairs_that_meet(rules, quantity):
            one, other = rules[first], rules[second]
            if one.begin >= other.end or other.begin >= one.end:
                continue
            shared = shared_positions(one, other, quantity)
            if shared.size:
                ids = site.node_ids if quantity in ("plan", "node_capacity") else site.link_ids
                names = ", ".join(ids[place] for place in shared[:5])
                more = f" and {shared.size - 5} more" if shared.size > 5 else ""
                earlier = f"measure {measure_of_rule[first]} ({one.name})"
                what = (
                    f"{other.name}: sets the {quantity.replace('_', ' ')} of {names}{more} at "
                    f"times at which {earlier} sets it too; part them in time, or keep one"
                )
                faults.add(what, line=measure_of_rule[second])


def _pairs_that_meet(rules: Sequence[Rule], quantity: str) -> list[tuple[int, int]]:
    """Return the pairs of rules that write a quantity of the same link or node at any time."""
    by_position: dict[int, dict[int, None]] = {}
    for number, rule in enumerate(rules):
        for claim in rule.claims:
            if claim.quantity == quantity:
                for position in claim.positions.tolist():
                    by_position.setdefault(position, {})[number] = None
    groups = {tuple(numbers) for numbers in by_position.values()}
    return sorted(set(chain.from_iterable(combinations(group, 2) for group in groups)))


def shared_positions(one: Rule, other: Rule, quantity: str) -> np.ndarray:
    """Return where two rules write the same quantity, for some row of it."""
    shared = [
        np.intersect1d(mine.positions, theirs.positions)
        for mine in one.claims
        for theirs in other.claims
        if mine.quantity == theirs.quantity == quantity
        and (
            mine.rows is None or theirs.rows is None or np.intersect1d(mine.rows, theirs.rows).size
        )
    ]
    return np.unique(np.concatenate(shared)) if shared else np.empty(0, np.int64)

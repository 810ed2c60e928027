"""A site, levers and traffic of a few links, for measures of control by themselves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Measure, Rule, Site
from uxsim_geo.control.traffic import Counts, Traffic
from uxsim_geo.errors import Faults, InputError
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.network.selection import select_links

CLASSES = ("cars", "lorries")


def site_of(network: Network, *, duration: float = 3600.0, step: float = 5.0) -> Site:
    links = network.links
    node_ids = tuple(network.nodes["node_id"])
    place = {node_id: number for number, node_id in enumerate(node_ids)}
    columns = ("length", "lanes", "free_speed", "jam_density", "merge_priority")
    return Site(
        link_ids=tuple(links["link_id"]),
        node_ids=node_ids,
        from_node=np.array([place[one] for one in links["from_node_id"]]),
        to_node=np.array([place[one] for one in links["to_node_id"]]),
        capacity=effective_capacity(links, 1.0),
        class_names=CLASSES,
        duration=duration,
        step=step,
        select=lambda target: select_links(network, target),
        **{name: links[name].to_numpy(np.float64) for name in columns},
    )


def levers_of(site: Site) -> Levers:
    """What holds without control."""
    links, nodes, classes = len(site.link_ids), len(site.node_ids), len(site.class_names)
    return Levers(
        {
            "exit_capacity": site.capacity,
            "entry_capacity": site.capacity,
            "entry_closed": np.zeros(links, bool),
            "exit_closed": np.zeros(links, bool),
            "speed_limit": site.free_speed,
            "merge_priority": site.merge_priority,
            "toll": np.zeros(links),
            "banned": np.zeros((classes, links), bool),
            "advice": np.zeros((classes, links)),
            "node_capacity": np.full(nodes, np.inf),
            "plan": np.full(nodes, -1),
            "phase": np.full(nodes, -1),
        }
    )


def traffic_of(
    site: Site,
    time: float,
    count: Sequence[float] | None = None,
    before: Traffic | None = None,
) -> Traffic:
    """So many vehicles on each link, none of which has stood or left since the start."""
    links, nodes = len(site.link_ids), len(site.node_ids)
    counts = np.zeros(links) if count is None else np.array(count, float)
    totals = Counts(time, counts, np.zeros(links))
    return Traffic(
        site,
        time,
        count=counts,
        queue=np.zeros(links),
        speed_limit=site.free_speed,
        waiting=np.zeros(nodes),
        phase=np.full(nodes, -1),
        totals=totals,
        before=totals if before is None else before.totals,
    )


def bind(measure: Measure, site: Site) -> list[Rule]:
    """The rules of a measure without faults."""
    faults = Faults()
    rules = list(measure.rules(site, faults))
    faults.raise_if_any()
    return rules


def only(measure: Measure, site: Site) -> Rule:
    """The one rule of a measure without faults."""
    (rule,) = bind(measure, site)
    return rule


def faults_of(measure: Measure, site: Site) -> str:
    """All faults of a measure, one a line."""
    faults = Faults()
    measure.rules(site, faults)
    return str(InputError(faults.found))


def assert_names(text: str, parts: Iterable[str]) -> None:
    """A message holds all of these."""
    for part in parts:
        assert part in text, f"{part!r} is not in:\n{text}"


def steps_of_rule(rule: Rule, site: Site, quantity: str) -> dict[float, np.ndarray]:
    """What a rule leaves in a quantity after each of its calls in empty traffic."""
    levers = levers_of(site)
    left = {}
    for time in sorted(rule.times(site.duration)):
        rule.act(traffic_of(site, time), levers)
        left[time] = getattr(levers, quantity).copy()
    return left


def touched(rule: Rule, site: Site, time: float | None = None) -> set[str]:
    """The quantities that a call changes; what it claims should cover them."""
    levers = levers_of(site)
    rule.act(traffic_of(site, rule.begin if time is None else time), levers)
    return levers.differences(levers_of(site))

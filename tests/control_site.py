"""A site, levers and traffic of a few links, for measures of control by themselves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from uxsim_geo.control.site import Measure, Rule, Site
from uxsim_geo.control.traffic import Counts, Traffic
from uxsim_geo.engine import binding
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.errors import Faults, InputError
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.settings import Settings

CLASSES = ("cars", "lorries")


def site_of(network: Network) -> Site:
    """An hour in steps of 5 s."""
    return binding.site_of(network, Settings(3600.0, 5), CLASSES, Paths.of(network))


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
    levers = base_levers(site)
    left = {}
    for time in sorted(rule.times(site.duration)):
        rule.act(traffic_of(site, time), levers)
        left[time] = getattr(levers, quantity).copy()
    return left


def touched(rule: Rule, site: Site, time: float | None = None) -> set[str]:
    """The quantities that a call changes; what it claims should cover them."""
    levers = base_levers(site)
    rule.act(traffic_of(site, rule.begin if time is None else time), levers)
    return levers.differences(base_levers(site))

"""Merge priorities: shares of two queues, while they are in force and after."""

from __future__ import annotations

import numpy as np
import pytest
from control_site import assert_names, faults_of, only, site_of, steps_of_rule
from small_networks import demand, exits, link, network, simulate

from uxsim_geo.control import MergePriority
from uxsim_geo.settings import Settings

MERGE = [link("a", "1", "3"), link("b", "2", "3"), link("c", "3", "4")]
SITE = site_of(network(MERGE))


def test_a_priority_follows_its_timetable() -> None:
    rule = only(MergePriority(["b"], ((0, 2.0), (600, 0.5))), SITE)
    steps = steps_of_rule(rule, SITE, "merge_priority")
    assert {time: values[1] for time, values in steps.items()} == {0: 2.0, 600: 0.5}
    assert rule.name == "merge priority of link b"


def test_a_priority_of_0_is_refused() -> None:
    text = faults_of(MergePriority(["b"], ((0, 2.0), (600, 0.0))), SITE)
    assert_names(text, ["column priority: must be a finite number above 0"])


@pytest.mark.parametrize("priority", [1.0, 3.0, 100.0])
def test_queues_share_a_merge_by_priority(priority: float) -> None:
    result = simulate(
        network(MERGE),
        demand(("1", "4", 0.0, 1000.0, 5000.0), ("2", "4", 0.0, 1000.0, 5000.0)),
        Settings(3500, 1),
        control=[MergePriority(["a"], priority, begin=600, end=2400)],
    )
    for begin, end, weight in ((150, 600, 1.0), (610, 2400, priority), (2410, 3500, 1.0)):
        first, second = (exits(result, name) for name in ("a", "b"))
        passed = [np.sum((times >= begin) & (times < end)) for times in (first, second)]
        share, count = weight / (1 + weight), sum(passed)
        assert count == pytest.approx(0.8 * (end - begin), abs=2)
        # every opening is drawn for by itself: 4 standard deviations of a binomial share
        error = 4 * np.sqrt(share * (1 - share) / count) + 1 / count
        assert passed[0] / count == pytest.approx(share, abs=error)

"""A study of a few links, with names that must come out as text, for tests of what is shown."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from functools import cache

import pandas as pd
from compared import BASE, example_comparison, placed, run

from uxsim_geo.analysis.comparison.comparing import compare
from uxsim_geo.analysis.comparison.comparison import Comparison, Facts
from uxsim_geo.export.comparison.study import FailedRun, Scenario, Study
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.network.network import Network

#: SQL, HTML, expressions of QGIS, templates, quotes, line separators and an emoji
EVIL = (
    'O\'Neill "Straße"; DROP TABLE links;-- <b>🚧</b> & [% 6 * 7 %] %]',
    "</script><script>window.harm = 1</script>",
    "<img src=x onerror='window.harm = 1'>",
    "日本 🚗\u2028\u2029{{ harm }} $x^2$",
)
START = datetime(2026, 3, 4, 7, 30, tzinfo=UTC)


def named(network: Network) -> Network:
    """The network with streets of those names, and all that a nodes table has."""
    links = network.links.assign(
        name=[EVIL[number % len(EVIL)] for number in range(len(network.links))]
    )
    nodes = network.nodes.assign(control="none", through_traffic=True)
    return replace(network, links=links, nodes=nodes)


def about(name: str = EVIL[1]) -> RunDescription:
    information = {"seed": 7, "reaction_time_s": 1.0, "remark": EVIL[2]}
    return RunDescription(
        START,
        example_comparison()[0].notes,
        information,
        name,
        attribution=f"© {EVIL[0]}",
        provenance={"sources": {"net": EVIL[3]}},
    )


@cache
def against_itself(seeds: int) -> Comparison:
    """Nothing is different at all."""
    base = placed(BASE)
    runs = [run(base, seed) for seed in range(seeds)]
    return compare(((one, one) for one in runs), Facts("base", "nothing"))


def study(seeds: int = 4) -> Study:
    """Two scenarios that were compared, one whose runs all failed."""
    base, scenario, found = example_comparison(seeds)
    base, scenario = named(base), named(scenario)
    entries = [
        Scenario(EVIL[0], [f"close: {EVIL[2]}", "add link bc"], scenario, found),
        Scenario("nothing", [], base, against_itself(seeds)),
        Scenario(EVIL[3], ["remove everything"], base, None),
    ]
    failed = [FailedRun(EVIL[3], 0, f"no way: {EVIL[1]}"), FailedRun(EVIL[0], 9, "gone")]
    return Study(about(), base, entries, failed)


def without_map(shown: Study) -> Study:
    """The same without geometry."""
    return replace(
        shown,
        base=_bare(shown.base),
        scenarios=[entry._replace(network=_bare(entry.network)) for entry in shown.scenarios],
    )


def _bare(network: Network) -> Network:
    nodes, links = (
        pd.DataFrame(table.drop(columns="geometry")) for table in (network.nodes, network.links)
    )
    return replace(network, nodes=nodes, links=links)

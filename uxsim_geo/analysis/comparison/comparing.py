"""Pairs of measured runs, one after the other, into a comparison."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison, Facts
from uxsim_geo.analysis.comparison.inference import unpaired_half_width
from uxsim_geo.analysis.comparison.measured import Measured
from uxsim_geo.analysis.comparison.moments import PairedMoments
from uxsim_geo.analysis.comparison.paired_table import PairedTable, statistics_of
from uxsim_geo.analysis.comparison.quantities import KEYS, TOTALS
from uxsim_geo.analysis.comparison.winner_tables import WinnerTables
from uxsim_geo.analysis.comparison.winners import match_trips
from uxsim_geo.analysis.comparison.zones import zones_of_pairs
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import REQUIRED_LINK_COLUMNS

#: tables that are measured in every run as they are compared
AS_MEASURED = ("links", "link_times", "od", "zone_pairs", "corridors")

#: tables of so many rows that p values of single rows are not adjusted, and say so
UNADJUSTED = ("link_times",)

ATTRIBUTES = [name for name in REQUIRED_LINK_COLUMNS if name != "link_id"]


def compare(pairs: Iterable[tuple[Measured, Measured]], facts: Facts) -> Comparison:
    """Compare base and scenario over pairs of runs, (base, scenario) of one seed each.

    One pair is looked at a time and then forgotten, so that ``pairs`` may read them from files.

    Raises :class:`uxsim_geo.errors.InputError` if there is no pair, or for runs that are measured
    in different time bins or over different durations.
    """
    sums = _Sums()
    for base, scenario in pairs:
        sums.add(base, scenario)
    if sums.first is None:
        faults = Faults("pairs")
        faults.add("there are no runs to compare")
        faults.raise_if_any()
    return sums.comparison(facts)


class _Sums:
    """What is kept of the pairs so far."""

    def __init__(self) -> None:
        self.seeds: list[tuple[int, int]] = []
        self.totals = PairedMoments.of_nothing(len(TOTALS), 1)
        self.tables = {name: PairedTable(name) for name in KEYS}
        self.winners = WinnerTables()
        self.first: tuple[float, float] | None = None
        self.each_trip = pd.DataFrame()
        self.edited: set[str] = set()

    def add(self, base: Measured, scenario: Measured) -> None:
        if self.first is None:
            self.first = base.duration_s, base.bin_s
        for run in (base, scenario):
            _check(run, self.first)
        self.seeds.append((base.seed, scenario.seed))
        self.totals.add(*(_figures(run) for run in (base, scenario)))
        for name in AS_MEASURED:
            self.tables[name].add(getattr(base, name), getattr(scenario, name))
        self.tables["zones"].add(*(zones_of_pairs(run.zone_pairs) for run in (base, scenario)))
        trips = match_trips(base.trips, scenario.trips)
        self.winners.add(trips)
        if len(self.seeds) == 1:
            self.each_trip = trips.drop(columns=["origin_zone", "destination_zone"])
        self.edited |= _edited_links(base.links, scenario.links)

    def comparison(self, facts: Facts) -> Comparison:
        assert self.first is not None
        tables = {
            name: table.table(adjusted=name not in UNADJUSTED)
            for name, table in self.tables.items()
        }
        links = tables["links"]
        changed = links["link_id"].isin(self.edited | set(facts.changed_links))
        links.insert(2, "changed", changed | (links["exists"] != "both"))
        return Comparison(
            facts=facts,
            seeds=tuple(self.seeds),
            duration_s=self.first[0],
            bin_s=self.first[1],
            remarks=tuple(self._remarks()),
            totals=_table_of_totals(self.totals),
            trips=self.winners.trips(),
            trip_changes=self.winners.trip_changes(),
            trip_statuses=self.winners.trip_statuses(),
            each_trip=self.each_trip,
            **tables,
        )

    def _remarks(self) -> Iterator[str]:
        if len(self.seeds) == 1:
            yield "One pair of runs: differences have no intervals, and no test."
        if any(base != scenario for base, scenario in self.seeds):
            yield (
                "Seeds differ between base and scenario: the same trips meet other draws, and a "
                "part of every difference is chance."
            )
        statuses = self.winners.statuses.items()
        for side, name in enumerate(("base", "scenario")):
            alone = sum(vehicles for status, vehicles in statuses if status[1 - side] == "absent")
            if alone:
                mean = f"{alone / len(self.seeds):,.1f}".removesuffix(".0")
                yield f"Vehicles in the {name} alone: {mean}; they are no winners or losers."


def _check(run: Measured, first: tuple[float, float]) -> None:
    faults = Faults(f"run of seed {run.seed}")
    same = "runs that are compared must have the same"
    if run.duration_s != first[0]:
        what = f"ends at {run.duration_s:g} s, the first at {first[0]:g} s: {same} duration"
        faults.add(what)
    if run.bin_s != first[1]:
        what = f"has time bins of {run.bin_s:g} s, the first of {first[1]:g} s: {same} bins"
        faults.add(f"{what}; measure one of them again")
    faults.raise_if_any()


def _figures(run: Measured) -> Any:
    """Values of the totals, in the order of the table."""
    by_name = run.totals.set_index("figure")["value"]
    return by_name.reindex([quantity.name for quantity in TOTALS]).to_numpy(float)[:, None]


def _table_of_totals(moments: PairedMoments) -> pd.DataFrame:
    (found,) = statistics_of(moments)
    half, unpaired = found.half_width, unpaired_half_width(moments)[:, 0]
    nothing = np.full(len(half), np.nan)
    narrowing = np.divide(unpaired, half, out=nothing, where=(half > 0) & (unpaired > 0))
    columns: dict[str, Any] = {
        "figure": [quantity.name for quantity in TOTALS],
        "title": [quantity.title for quantity in TOTALS],
        "unit": [quantity.unit for quantity in TOTALS],
        "better": [quantity.better for quantity in TOTALS],
        "base": found.base,
        "scenario": found.scenario,
        "difference": found.difference,
        "low": found.difference - half,
        "high": found.difference + half,
        "half_width": half,
        "unpaired_half_width": unpaired,
        "narrowing": narrowing,
        "relative": found.relative,
        "p": found.p,
        "seeds": found.seeds.astype(np.int64),
    }
    return pd.DataFrame(columns)


def _edited_links(base: pd.DataFrame, scenario: pd.DataFrame) -> set[str]:
    """Links of both networks that differ in an attribute."""
    sides = [table.set_index("link_id")[ATTRIBUTES] for table in (base, scenario)]
    common = sides[0].index.intersection(sides[1].index)
    before, after = (side.loc[common] for side in sides)
    same = (before == after) | (before.isna() & after.isna())
    return set(common[~same.all(axis=1)])

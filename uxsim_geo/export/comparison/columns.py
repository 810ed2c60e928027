"""Every layer and column of ``comparison.gpkg`` in words, made from what runs are compared by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from uxsim_geo.analysis.comparison.quantities import (
    CORRIDORS,
    LINK_TIMES,
    LINKS,
    TRIPS,
    Quantity,
)
from uxsim_geo.export.columns import BIN, LINK, Column, Layer

NO_PAIR = "where no pair of runs has both"
ONE_SEED = "where no pair of runs has both, and with one pair only"

#: what stands behind the name of a quantity: suffix, title, unit (None: its own), meaning, empty
_SUFFIXES = (
    ("base", "{} in the base", None, "mean over the seeds; {}", "where it is undefined"),
    ("scenario", "{} in the scenario", None, "mean over the seeds; {}", "where it is undefined"),
    ("difference", "change of {}", None, "mean of scenario − base", NO_PAIR),
    ("low", "change of {}, at least", None, "lower end of the 95 % interval", ONE_SEED),
    ("high", "change of {}, at most", None, "upper end of the 95 % interval", ONE_SEED),
    ("relative", "relative change of {}", "–", "change / base", "where the base is 0 or undefined"),
    ("p", "p of {}", "–", "paired t test against no change", ONE_SEED),
    (
        "adjusted_p",
        "adjusted p of {}",
        "–",
        "by Benjamini and Hochberg over all rows of the table",
        ONE_SEED,
    ),
    (
        "significant",
        "{} changes for sure",
        "boolean",
        "whether the adjusted p is at most 0.05: of the rows marked, 5 % at most are chance",
        ONE_SEED,
    ),
    ("seeds", "pairs for {}", "–", "pairs of runs in which both are defined", "never"),
)

#: of links in time: as many rows as links and bins make more columns too much
IN_TIME = ("base", "scenario", "difference", "low", "high")


def _columns(
    quantities: Sequence[Quantity], suffixes: Sequence[str] | None = None
) -> Iterator[Column]:
    for quantity in quantities:
        for suffix, title, unit, what, empty in _SUFFIXES:
            if suffixes is None or suffix in suffixes:
                yield Column(
                    f"{quantity.name}_{suffix}",
                    title.format(quantity.title),
                    quantity.unit if unit is None else unit,
                    what.format(quantity.what),
                    empty,
                )


SCENARIO = Column("scenario", "scenario", "text", "its name")

EXISTS = Column(
    "exists",
    "exists in",
    "text",
    "`both` networks, the `base` alone, or the `scenario` alone: then nothing is compared",
)

CHANGED = Column(
    "changed",
    "edited",
    "boolean",
    "whether the scenario edits it: attributes, closures, or that it exists",
)

LINKS_LAYER = Layer(
    "Differences of links, whole run",
    "Lines: the directed links of base and scenario, with what the scenario changes over the whole "
    "run. One layer a scenario, `links_` and its name.",
    (*LINK, EXISTS, CHANGED, *_columns(LINKS)),
)

LINK_TIMES_LAYER = Layer(
    "Differences of links by time",
    "A table, one row a link and time bin; a view, `link_times_` and the name of the scenario.",
    (LINK[0], *BIN, *_columns(LINK_TIMES, IN_TIME)),
)

LINK_STATES_LAYER = Layer(
    "Differences of links in time",
    "Lines: the same joined to the links, for the Temporal Controller; a view, `link_states_` and "
    "the name of the scenario.",
    (*LINK, EXISTS, CHANGED, *BIN, *_columns(LINK_TIMES, IN_TIME)),
)

OD_LAYER = Layer(
    "Differences of pairs",
    "Straight lines from where trips start to where they end, with what the scenario changes for "
    "them: the 3,000 pairs of nodes whose total delay changes most. Trips within one node, and "
    "nodes without a place, have no line. One layer a scenario, `od_` and its name.",
    (
        Column("origin", "from", "text", "node_id"),
        Column("destination", "to", "text", "node_id"),
        *_columns(TRIPS),
    ),
)

ZONES_LAYER = Layer(
    "Differences of zones",
    "A table: trips that start and that end in every zone.",
    (
        SCENARIO,
        Column("end", "end", "text", "`origin` or `destination`: which end of the trips"),
        Column("zone", "zone", "text", "its name"),
        *_columns(TRIPS),
    ),
)

CORRIDORS_LAYER = Layer(
    "Differences of corridors",
    "A table: travel times along paths of links, by time bin.",
    (
        SCENARIO,
        Column("corridor", "corridor", "text", "its name"),
        Column("begin_s", "from", "s", "begin of the bin, after the start"),
        Column("end_s", "to", "s", "its end"),
        EXISTS,
        *_columns(CORRIDORS),
    ),
)

TOTALS_LAYER = Layer(
    "Key figures",
    "A table: figures of the whole run, a row a scenario and figure.",
    (
        SCENARIO,
        Column("figure", "figure", "text", "its name, with the unit"),
        Column("title", "title", "text", "what a reader calls it"),
        Column("unit", "unit", "text", "of the columns"),
        Column("better", "better", "–", "−1: the less the better, 1: the more, 0: neither"),
        Column("base", "in the base", "see unit", "mean over the seeds", NO_PAIR),
        Column("scenario_value", "in the scenario", "see unit", "mean over the seeds", NO_PAIR),
        Column("difference", "change", "see unit", "mean of scenario − base", NO_PAIR),
        Column("low", "change, at least", "see unit", "lower end of the 95 % interval", ONE_SEED),
        Column("high", "change, at most", "see unit", "upper end of the 95 % interval", ONE_SEED),
        Column("half_width", "half width", "see unit", "of the 95 % interval", ONE_SEED),
        Column(
            "unpaired_half_width",
            "half width if unpaired",
            "see unit",
            "what it would be had the runs not been paired by their seeds",
            ONE_SEED,
        ),
        Column(
            "narrowing",
            "narrower by",
            "–",
            "how many times wider the interval would be without pairing",
            "where either width is 0 or not known",
        ),
        Column("relative", "relative change", "–", "change / base", "where the base is 0"),
        Column("p", "p", "–", "paired t test against no change", ONE_SEED),
        Column("seeds", "pairs", "–", "pairs of runs"),
    ),
)

WINNERS_LAYER = Layer(
    "Winners and losers",
    "A table: shares of vehicles whose trip is noticeably shorter or longer, by group.",
    (
        SCENARIO,
        Column("group", "group", "text", "`all`, `class`, `origin_zone` or `destination_zone`"),
        Column("name", "name", "text", "of the class or zone", "for all"),
        Column("vehicles", "vehicles", "veh", "in both runs; mean of the pairs"),
        Column("gaining_share", "gain", "–", "share that gains"),
        Column("gaining_share_low", "gain, at least", "–", "95 % interval", ONE_SEED),
        Column("gaining_share_high", "gain, at most", "–", "95 % interval", ONE_SEED),
        Column("losing_share", "lose", "–", "share that loses"),
        Column("losing_share_low", "lose, at least", "–", "95 % interval", ONE_SEED),
        Column("losing_share_high", "lose, at most", "–", "95 % interval", ONE_SEED),
        Column("little_change_share", "little change", "–", "share with little change"),
        Column("undetermined_share", "unknown", "–", "share whose end was not seen in both runs"),
        Column("gained_veh_h", "gained", "veh·h", "by those who gain"),
        Column("lost_veh_h", "lost", "veh·h", "by those who lose"),
        Column("mean_change_s", "mean change", "s", "of those who arrived in both", NO_PAIR),
        Column("mean_change_s_low", "mean change, at least", "s", "95 % interval", ONE_SEED),
        Column("mean_change_s_high", "mean change, at most", "s", "95 % interval", ONE_SEED),
        Column("change_p05_s", "5 %", "s", "5 % change by less", NO_PAIR),
        Column("change_p50_s", "50 %", "s", "the median change", NO_PAIR),
        Column("change_p95_s", "95 %", "s", "95 % change by less", NO_PAIR),
    ),
)

EDITS_LAYER = Layer(
    "What was asked",
    "A table: what the scenarios change, an edit a row.",
    (
        SCENARIO,
        Column("edit", "edit", "text", "a sentence"),
    ),
)

FACTS_LAYER = Layer(
    "About the study",
    "A table: settings, versions, seeds, failed runs.",
    (
        Column("item", "item", "text", "name"),
        Column("value", "value", "text", "value"),
    ),
)

#: layers of which each scenario has one, by the first part of their names
OF_SCENARIO = {
    "links": LINKS_LAYER,
    "link_times": LINK_TIMES_LAYER,
    "link_states": LINK_STATES_LAYER,
    "od": OD_LAYER,
}

#: tables of all scenarios
OF_ALL = {
    "totals": TOTALS_LAYER,
    "winners": WINNERS_LAYER,
    "corridors": CORRIDORS_LAYER,
    "zones": ZONES_LAYER,
    "edits": EDITS_LAYER,
    "study_info": FACTS_LAYER,
}


def titled_for(layer: Layer, scenario: str) -> Layer:
    """The layer of one scenario, by whose name it is called."""
    return replace(layer, title=f"{scenario}: {layer.title[0].lower()}{layer.title[1:]}")

"""The differences between a base and a scenario over paired runs: tables, and their grounds."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd


@dataclass(frozen=True)
class Facts:
    """What a comparison is called.

    base, scenario
        names of the two sides
    changed_links
        link_ids that the scenario changes otherwise than in the tables of the network, as by
        closures; those whose attributes differ are found
    """

    base: str = "base"
    scenario: str = "scenario"
    changed_links: tuple[str, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """A base and a scenario, compared over runs that are paired by their seed.

    facts
        names, and what was changed
    seeds
        of the pairs, in their order: (of the base's run, of the scenario's); equal where they are
        paired as they should be
    duration_s, bin_s
        of the runs and of the time bins, s
    remarks
        what to know before the figures are believed, a sentence each

    All tables have ids as text, numbers as float64, null (NaN) where a quantity is undefined: it is
    never 0 instead. Statistics of a quantity q, here as columns, are over the pairs in which q is
    defined in both runs:

    q_base, q_scenario
        means over those pairs; where there is no such pair, over the runs in which it is defined
    q_difference
        mean of scenario − base; null where no pair has both
    q_low, q_high
        95 % interval of it (paired t); null with one pair only
    q_relative
        difference / base; null where the base is 0
    q_p
        p value of the paired t test against no difference; 1 where all differences are exactly 0;
        null with one pair only
    q_adjusted_p
        the same by Benjamini and Hochberg over all rows of the table
    q_significant
        (nullable boolean) whether that is at most 0.05: among the rows so marked, 5 % at most are
        there by chance; null where there is no p
    q_seeds
        pairs in which it is defined in both (integer)

    totals
        one row a figure of :data:`uxsim_geo.analysis.comparison.quantities.TOTALS`: figure, title,
        unit, better (-1 lower is better, 1 higher, 0 neither), base, scenario, difference, low,
        high, half_width, unpaired_half_width (what it would be had the runs not been paired:
        Welch), narrowing (unpaired / paired half width; null where either is 0 or null), relative,
        p, seeds
    links
        link_id, exists (``both``, ``base`` or ``scenario``: in which network), changed (bool: its
        attributes differ, it exists in one only, or ``facts`` names it), and the columns above for
        the quantities of :data:`~uxsim_geo.analysis.comparison.quantities.LINKS`; a link that is
        in one network alone is null on the other side and in its differences. Order: links of the
        base, then those of the scenario alone
    link_times
        link_id, begin_s, end_s (of a time bin), exists, and without adjusted_p and significant the
        columns above for LINK_TIMES; rows of the links in turn, bins within
    od
        origin, destination (node_id), and the columns above for TRIPS
    zone_pairs
        origin_zone, destination_zone, and the same
    zones
        end (``origin`` or ``destination``: at which end of the trips), zone, and the same
    corridors
        corridor, begin_s, end_s, exists, and the columns above for CORRIDORS
    trips
        winners and losers, one row a group of vehicles: group (``all``, ``class``, ``origin_zone``,
        ``destination_zone``), name, vehicles (in both runs; mean of the pairs, as all that
        follows), gaining_share, losing_share, little_change_share, undetermined_share (of those;
        they add up to 1), each of the first two with _low and _high; gained_veh_h and lost_veh_h
        (sums over those who gain, or lose, and are known to have arrived in both); mean_change_s,
        mean_change_s_low, mean_change_s_high, change_p05_s, change_p50_s, change_p95_s (of those
        who arrived in both)
    trip_changes
        distribution of the change of those who arrived in both: from_s, to_s (±infinity at the
        ends), vehicles, share
    trip_statuses
        status_base, status_scenario (completed, running, waiting, aborted, not_departed, absent),
        vehicles
    each_trip
        every platoon of the first pair: origin, destination, class, number, vehicles, status_base,
        status_scenario, depart_s_base, depart_s_scenario, travel_time_s_base,
        travel_time_s_scenario (so far), change_s (null unless it departed in both), outcome
        (gains, loses, little_change, undetermined, base_only, scenario_only)
    """

    facts: Facts
    seeds: tuple[tuple[int, int], ...]
    duration_s: float
    bin_s: float
    remarks: tuple[str, ...]
    totals: pd.DataFrame
    links: pd.DataFrame
    link_times: pd.DataFrame
    od: pd.DataFrame
    zone_pairs: pd.DataFrame
    zones: pd.DataFrame
    corridors: pd.DataFrame
    trips: pd.DataFrame
    trip_changes: pd.DataFrame
    trip_statuses: pd.DataFrame
    each_trip: pd.DataFrame

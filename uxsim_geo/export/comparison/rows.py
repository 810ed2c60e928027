"""Rows of the tables of ``comparison.html``, as text that stands there without a script too."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison
from uxsim_geo.analysis.comparison.quantities import CORRIDORS
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.comparison.study import Scenario, Study, comparison_of
from uxsim_geo.export.comparison.words import NOTHING, change_in_words, is_sure, number, percent

#: rows of tables of pairs and zones, those that change most
MOST_ROWS = 12

#: of winners and losers: classes and zones, the largest
MOST_GROUPS = 10

GROUPS = {
    "all": "all",
    "class": "class",
    "origin_zone": "from zone",
    "destination_zone": "to zone",
}


def total_rows(study: Study) -> list[dict[str, Any]]:
    """Figures in turn, each of all scenarios; figures that are 0 everywhere are left out."""
    rows = []
    tables = [(entry.name, comparison_of(entry).totals) for entry in study.compared]
    figures = tables[0][1]["figure"].tolist() if tables else []
    for at, figure in enumerate(figures):
        own = [(name, table.iloc[at]) for name, table in tables]
        if all(
            not np.nan_to_num(row[["base", "scenario"]].to_numpy(float)).any() for _, row in own
        ):
            continue
        rows += [
            {
                "figure": figure,
                "title": row["title"],
                "unit": row["unit"],
                "first": place == 0,
                "count": len(own),
                "scenario": name,
                "base": number(row["base"]),
                "value": number(row["scenario"]),
                "change": _interval(row),
                "relative": _relative(row),
                "p": _p(row["p"]),
                "sure": is_sure(row),
            }
            for place, (name, row) in enumerate(own)
        ]
    return rows


def pairing_rows(study: Study) -> list[dict[str, str]]:
    """How much narrower pairing made the intervals of the figures that have one."""
    rows = []
    for entry in study.compared:
        table = comparison_of(entry).totals
        for _, row in table[table["narrowing"].notna()].iterrows():
            rows.append(
                {
                    "scenario": entry.name,
                    "title": row["title"],
                    "half": f"± {number(row['half_width'])} {row['unit']}",
                    "unpaired": f"± {number(row['unpaired_half_width'])} {row['unit']}",
                    "narrowing": f"{row['narrowing']:.1f}",
                }
            )
    return rows


def winner_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """All vehicles, then classes, then the largest zones."""
    table, rows = comparison.trips, []
    classes = table[table["group"] == "class"]
    for group, title in GROUPS.items():
        own = table[table["group"] == group].nlargest(MOST_GROUPS, "vehicles", keep="first")
        if group == "class" and len(classes) < 2:
            continue
        for _, row in own.iterrows():
            rows.append(
                {
                    "group": title,
                    "name": row["name"] or "vehicles",
                    "vehicles": f"{row['vehicles']:,.0f}",
                    "gain": _share(row, "gaining_share"),
                    "lose": _share(row, "losing_share"),
                    "bars": [
                        round(100 * float(np.nan_to_num(row[f"{part}_share"])), 2)
                        for part in ("gaining", "little_change", "undetermined", "losing")
                    ],
                    "mean": _seconds(row),
                    "gained": number(row["gained_veh_h"]),
                    "lost": number(row["lost_veh_h"]),
                }
            )
    return rows


def distribution(comparison: Comparison) -> list[dict[str, Any]]:
    """Classes of the change of travel times: words, percent, height of 100, and whether a gain."""
    table = comparison.trip_changes
    most = float(np.nan_to_num(table["share"]).max(initial=0.0))
    return [
        {
            "label": span_in_words(row["from_s"], row["to_s"]),
            "percent": percent(100 * row["share"]),
            "height": round(100 * float(np.nan_to_num(row["share"])) / most, 1) if most else 0.0,
            "kind": "gain" if row["to_s"] <= 0 else "loss" if row["from_s"] >= 0 else "same",
        }
        for _, row in table.iterrows()
    ]


def span_in_words(low: float, high: float) -> str:
    """``−5 to −2 min``; ends without a limit as such."""
    unit, factor = ("min", 60.0) if min(abs(low), abs(high)) >= 60 else ("s", 1.0)
    if np.isinf(low):
        return f"under {number(high / factor)} {unit}"
    if np.isinf(high):
        return f"over {number(low / factor, signed=True)} {unit}"
    signed = low >= 0
    return f"{number(low / factor, signed=signed)} to {number(high / factor, signed=signed)} {unit}"


def corridor_tables(comparison: Comparison, clock: Clock) -> list[dict[str, Any]]:
    """Each corridor: its name, and travel times by time bin."""
    time = next(one for one in CORRIDORS if one.name == "experienced_travel_time_s")
    found = []
    for name, table in comparison.corridors.groupby("corridor", sort=False):
        alone = table["exists"].iloc[0] if "exists" in table else "both"
        rows = [
            {
                "when": clock.span(row["begin_s"], row["end_s"]),
                "vehicles": f"{number(row['vehicles_veh_base'])} → "
                f"{number(row['vehicles_veh_scenario'])}",
                "base": _duration(row[f"{time.name}_base"]),
                "scenario": _duration(row[f"{time.name}_scenario"]),
                "change": _of_quantity(row, time.name, "s"),
            }
            for _, row in table.iterrows()
            if np.nan_to_num(
                row[["vehicles_veh_base", "vehicles_veh_scenario"]].to_numpy(float)
            ).any()
        ]
        found.append({"name": str(name), "alone": "" if alone == "both" else alone, "rows": rows})
    return found


def pair_rows(comparison: Comparison) -> list[dict[str, str]]:
    """Pairs of zones, or of nodes where there are none, whose total delay changes most."""
    table, ends = comparison.zone_pairs, ("origin_zone", "destination_zone")
    if table.empty:
        table, ends = comparison.od, ("origin", "destination")
    return _most_changed(table, lambda row: " → ".join(str(row[end]) for end in ends))


def zone_rows(comparison: Comparison) -> list[dict[str, str]]:
    """Zones at either end of trips whose total delay changes most."""
    words = {"origin": "from", "destination": "to"}
    return _most_changed(comparison.zones, lambda row: f"{words[row['end']]} {row['zone']}")


def link_rows(entry: Scenario) -> list[dict[str, str]]:
    """Links whose delay changes most."""
    return _most_changed(comparison_of(entry).links, lambda row: str(row["link_id"]))


def _most_changed(
    table: pd.DataFrame, named: Callable[[pd.Series], str], name: str = "delay_veh_h"
) -> list[dict[str, str]]:
    size = table[f"{name}_difference"].abs().fillna(0.0)
    order = np.argsort(-size.to_numpy(), kind="stable")[:MOST_ROWS]
    chosen = table.iloc[order[size.to_numpy()[order] > NOTHING]]
    extra = next((one for one in ("departed_veh", "volume_veh") if f"{one}_base" in table), None)
    return [
        {
            "name": named(row),
            "vehicles": ""
            if extra is None
            else f"{number(row[f'{extra}_base'])} → {number(row[f'{extra}_scenario'])}",
            "base": number(row[f"{name}_base"]),
            "scenario": number(row[f"{name}_scenario"]),
            "change": _of_quantity(row, name, "veh·h"),
            "sure": _sure(row, name),
        }
        for _, row in chosen.iterrows()
    ]


def _sure(row: pd.Series, name: str) -> str:
    known = row.get(f"{name}_significant")
    return "–" if known is None or pd.isna(known) else "yes" if known else "no"


def _of_quantity(row: pd.Series, name: str, unit: str) -> str:
    change, low, high = (row[f"{name}_{end}"] for end in ("difference", "low", "high"))
    if np.isnan(change):
        return "not comparable"
    told = f"{number(change, signed=True)} {unit}"
    return told if np.isnan(low) else f"{told} ({number(low)} to {number(high)})"


def _interval(row: pd.Series) -> str:
    change = number(row["difference"], signed=True)
    if np.isnan(row["low"]):
        return change
    return f"{change} ({number(row['low'])} to {number(row['high'])})"


def _relative(row: pd.Series) -> str:
    return change_in_words(row) if np.isfinite(row["relative"]) else "–"


def _p(value: float) -> str:
    return "–" if np.isnan(value) else "< 0.001" if value < 0.001 else f"{value:.3f}"


def _share(row: pd.Series, name: str) -> str:
    share, low, high = (100 * row[f"{name}{end}"] for end in ("", "_low", "_high"))
    if np.isnan(low):
        return f"{percent(share)} %"
    return f"{percent(share)} % ({percent(max(low, 0.0))} to {percent(min(high, 100.0))} %)"


def _seconds(row: pd.Series) -> str:
    mean, low, high = (row[f"mean_change_s{end}"] for end in ("", "_low", "_high"))
    if np.isnan(mean):
        return "–"
    told = f"{number(mean, signed=True)} s"
    return told if np.isnan(low) else f"{told} ({number(low)} to {number(high)})"


def _duration(seconds: float) -> str:
    if np.isnan(seconds):
        return "–"
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02} min"

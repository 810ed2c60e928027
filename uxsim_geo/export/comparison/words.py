"""Changes in words: the answer of a study in sentences, with its intervals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison
from uxsim_geo.analysis.comparison.winners import NOTICED
from uxsim_geo.export.comparison.study import Scenario, comparison_of
from uxsim_geo.export.map_sheet import in_words
from uxsim_geo.export.street_names import street_names

#: figures that are told first, if they are there; the first always
KEY_FIGURES = (
    "total_delay_veh_h",
    "completed_average_travel_time_s",
    "average_speed_kmh",
    "vehicles_unfinished",
    "total_distance_veh_km",
)

#: what an exact 0 leaves after rounding
NOTHING = 1e-9

#: delay of a link that is not worth a sentence, veh·h
LITTLE = 0.05


def answer(scenario: Scenario) -> list[str]:
    """What a scenario changes, a sentence each, the most important first."""
    found = comparison_of(scenario)
    if is_nothing(found):
        pairs = in_words(len(found.seeds), "pair")
        return [f"Nothing changes: all figures are equal in the {pairs} of runs."]
    rows = [found.totals[found.totals["figure"] == name] for name in KEY_FIGURES]
    first, *others = (row.iloc[0] for row in rows if len(row))
    told = [_sentence(first)]
    told += [
        _sentence(row)
        for row in others
        if is_sure(row) is not False and abs(row["difference"]) > NOTHING
    ]
    return [*told, *_winners(found), *_links(scenario, found), *found.remarks]


def is_nothing(comparison: Comparison) -> bool:
    """Whether every figure and every link is the same."""
    changes = comparison.totals["difference"].fillna(0.0).abs().max()
    links = comparison.links
    delay = links["delay_veh_h_difference"].fillna(0.0).abs().max()
    volume = links["volume_veh_difference"].fillna(0.0).abs().max()
    alone = (links["exists"] != "both").any()
    return bool(max(changes, delay, volume) <= NOTHING and not alone)


def is_sure(row: pd.Series) -> bool | None:
    """Whether the interval of a figure leaves out 0; None: there is no interval."""
    if np.isnan(row["low"]):
        return None
    return bool(row["low"] > 0 or row["high"] < 0)


def change_in_words(row: pd.Series) -> str:
    """Change with its interval: ``+12 % (10 to 14 %)``, or in its unit where the base is 0."""
    base = row["base"]
    if np.isnan(row["difference"]):
        return "not known"
    if np.isfinite(base) and abs(base) > NOTHING and row["unit"] != "share of runs":
        values = [100.0 * row[name] / abs(base) for name in ("difference", "low", "high")]
        return _with_interval(values, "%")
    return _with_interval([row[name] for name in ("difference", "low", "high")], row["unit"])


def number(value: float, *, signed: bool = False) -> str:
    """Three digits or all before the point, with a real minus; a dash for none."""
    if value is None or not np.isfinite(value):
        return "–"
    size = abs(value)
    digits = 0 if size >= 99.95 else 1 if size >= 9.995 else 2 if size >= 0.9995 else 3
    text = f"{size:,.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    if text == "0":
        return "0"
    return f"{'−' if value < 0 else '+' if signed else ''}{text}"


def percent(value: float, *, signed: bool = False) -> str:
    """Whole percents from 10 on, else one digit after the point; of less than 0.1 one digit."""
    if not np.isfinite(value):
        return number(value)
    size = abs(value)
    rounded = round(value) if size >= 9.95 else round(value, 1) if size >= 0.095 else value
    if 0 < size < 0.095:
        rounded = float(f"{value:.1g}")
    return number(float(rounded), signed=signed)


def _with_interval(values: list[Any], unit: str) -> str:
    change, low, high = values
    told, space = percent if unit == "%" else number, "\u00a0"
    mean = f"{told(change, signed=True)}{space}{unit}"
    return mean if np.isnan(low) else f"{mean} ({told(low)} to {told(high)}{space}{unit})"


def _sentence(row: pd.Series) -> str:
    """In words, as ``Total delay rises by 12 % (10 to 14 %), from 4,736 to 5,300 veh·h``."""
    title = row["title"][0].upper() + row["title"][1:]
    ends = f"from {number(row['base'])} to {number(row['scenario'])} {row['unit']}"
    if abs(row["difference"]) <= NOTHING:
        return f"{title} stays at {number(row['base'])} {row['unit']}."
    sure = is_sure(row)
    if sure is False:
        return f"{title} changes by {change_in_words(row)}, {ends}: this may be chance."
    way = "rises" if row["difference"] > 0 else "falls"
    flip = -1.0 if row["difference"] < 0 else 1.0
    low, high = sorted((flip * row["low"], flip * row["high"]))
    size = row.copy()
    size[["difference", "low", "high"]] = abs(row["difference"]), low, high
    return f"{title} {way} by {change_in_words(size).removeprefix('+')}, {ends}."


def _winners(comparison: Comparison) -> Iterator[str]:
    every = comparison.trips[comparison.trips["group"] == "all"]
    if every.empty or not every["vehicles"].iloc[0] > 0:
        return
    row = every.iloc[0]
    gain, lose, unknown = (
        percent(100 * row[f"{part}_share"]) for part in ("gaining", "losing", "undetermined")
    )
    rest = f"; of {unknown} % the end was not seen" if row["undetermined_share"] > 0.0005 else ""
    yield (
        f"Of {row['vehicles']:,.0f} vehicles, {gain} % arrive noticeably earlier and {lose} % "
        f"noticeably later, by more than {noticed()} of their trip{rest}."
    )


def noticed() -> str:
    """From what change on somebody gains or loses."""
    return f"{NOTICED.seconds:g} s and {100 * NOTICED.share:g} %"


def _links(scenario: Scenario, comparison: Comparison) -> Iterator[str]:
    """On how many links delay changes, and where most, of those that are sure if that is known."""
    links = comparison.links
    significant = links["delay_veh_h_significant"].astype("boolean")
    change = links["delay_veh_h_difference"].fillna(0.0)
    if significant.notna().any():
        sure = significant.fillna(False).to_numpy(bool)
        yield f"Delay changes for sure on {sure.sum():,} of {len(links):,} links."
        change = change.where(sure, 0.0)
    names = street_names(scenario.network.links)
    ids = scenario.network.links["link_id"].astype(str)
    streets = dict(zip(ids, names, strict=True))
    for done, at in (("added", int(change.argmax())), ("saved", int(change.argmin()))):
        size = float(change.iloc[at])
        if (done == "added") == (size > 0) and abs(size) >= LITTLE:
            named = _named(str(links["link_id"].iloc[at]), streets)
            yield f"Most delay is {done} on {named}: {number(size, signed=True)} veh·h."


def _named(link_id: str, streets: Mapping[str, str]) -> str:
    alone = f"link {link_id}"
    street = streets.get(link_id, alone)
    return alone if street == alone else f"{street} ({alone})"

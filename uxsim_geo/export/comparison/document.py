"""What the scripts of ``comparison.html`` read: plain values, and packed numbers beside them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.numbers import NOTHING
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.comparison.changes import (
    ADDED,
    ADDED_ON_DARK,
    NOT_COMPARED,
    ONLY_BASE,
    ONLY_SCENARIO,
    REMOVED,
    REMOVED_ON_DARK,
    UNKNOWN,
    UNKNOWN_ON_DARK,
    Shown,
    classes_of,
    shown_in_time,
    shown_of_links,
    significance,
)
from uxsim_geo.export.comparison.extent import LOCAL, changed_part
from uxsim_geo.export.comparison.study import Scenario, Study, comparison_of, joined_network
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.page.document import TICKS, link_columns, plain
from uxsim_geo.export.page.packing import packed_json, packed_lines, packed_numbers
from uxsim_geo.export.page.places import Places
from uxsim_geo.network.network import Network

#: more rows of links, bins and scenarios than this would make the page too large (of a city, about
#: 15 bytes each): it has no time
MOST_CELLS = 1_500_000

#: of links, as the scripts know them: in both networks, in one alone, in another scenario's alone
KINDS = {"both": 0, "base": 1, "scenario": 2}
ABSENT = 3

#: numbers of each link over the whole run, and in each time bin
WHOLE = ("base", "scenario", "difference", "half", "relative", "sure")
#: the scripts take difference and sureness from these
IN_TIME = ("base", "scenario", "half")

#: in the place of half a width: both sides are known, and of no pair of runs together
NO_PAIR = np.inf

#: τ of engines, for capacities that nobody sees where the run does not tell it, s
USUAL_REACTION_TIME = 1.0


def parts_of(study: Study) -> dict[str, str]:
    """All that the scripts unpack, by the id of its tag."""
    network = joined_network(study.base, [entry.network for entry in study.compared])
    places = Places.of(network)
    points, deltas = packed_lines(places.lines)
    has_time = _has_time(study, len(network.links))
    whole, relative = (shown_of_links(study, relative=is_relative) for is_relative in (False, True))
    in_time = shown_in_time(study)
    parts = {
        "document": packed_json(_document(study, network, places, (whole, relative, in_time))),
        "points": points,
        "places": deltas,
    }
    ids = pd.Index(network.links["link_id"].astype(str))
    for number, entry in enumerate(study.compared):
        found = comparison_of(entry)
        rows = ids.get_indexer(pd.Index(found.links["link_id"]))
        for at, (shown, later) in enumerate(zip(whole, in_time, strict=True)):
            values = np.full((len(ids), len(WHOLE)), np.nan)
            values[rows] = _numbers(found.links, shown, WHOLE)
            parts[f"whole-{number}-{at}"] = packed_numbers(values)
            if has_time:
                cells = np.full((len(ids), _bins(found.link_times), len(IN_TIME)), np.nan)
                numbers = _in_time(found.link_times, later)
                cells[rows] = numbers.reshape(len(rows), -1, len(IN_TIME))
                parts[f"time-{number}-{at}"] = packed_numbers(cells)
    return parts


def _has_time(study: Study, links: int) -> bool:
    bins = [_bins(comparison_of(entry).link_times) for entry in study.compared]
    return 0 < sum(bins) * links <= MOST_CELLS


def _bins(link_times: pd.DataFrame) -> int:
    return int(link_times["begin_s"].nunique())


def _numbers(table: pd.DataFrame, shown: Shown, wanted: Sequence[str]) -> Floats:
    """Columns of a quantity, shape (rows, wanted); NaN where there is nothing."""
    name = shown.quantity.name
    columns = {
        "half": (table[f"{name}_high"] - table[f"{name}_low"]).to_numpy(float) / 2,
        "sure": significance(table, shown),
    }
    for suffix in wanted:
        if suffix not in columns:
            columns[suffix] = table[f"{name}_{suffix}"].to_numpy(float)
    values = np.stack([columns[suffix] for suffix in wanted], axis=1)
    # what sums leave of 0 would stretch the axes of charts
    return np.where(np.abs(values) < NOTHING, 0.0, values)


def _in_time(link_times: pd.DataFrame, shown: Shown) -> Floats:
    """As :func:`_numbers` of :data:`IN_TIME`, with :data:`NO_PAIR`."""
    values = _numbers(link_times, shown, IN_TIME)
    name = shown.quantity.name
    no_pair = link_times[f"{name}_difference"].isna().to_numpy(bool)
    values[no_pair & ~np.isnan(values[:, :2]).any(axis=1), 2] = NO_PAIR
    return values


def _document(
    study: Study, network: Network, places: Places, shown: tuple[list[Shown], ...]
) -> dict[str, Any]:
    about = study.about
    volume = _volume(study, network)
    tau = about.reaction_time or USUAL_REACTION_TIME
    has_time = _has_time(study, len(network.links))
    edges, clock = (_edges(study) if has_time else [0.0, 1.0]), study.clock
    return {
        "edges": plain(edges, 3),
        "spans": [clock.span(*span) for span in pairwise(edges)],
        "ticks": {str(most): clock.ticks(most) for most in TICKS},
        "has_time": has_time,
        "map": {"on_earth": places.on_earth, "left": about.driving_side == "left"},
        "view": _view(study, network, places, shown[0]),
        "links": link_columns(network, tau, volume),
        "quantities": [_quantity(one) for several in shown for one in several],
        "count": len(shown[0]),
        "fields": {"whole": WHOLE, "time": IN_TIME},
        "scenarios": [_scenario(entry, network) for entry in study.compared],
        # what the map of a report has beside its links
        "junctions": {"points": [], "links": [], "largest_min": 0, "least": 1},
        "worst": [],
    }


def _view(
    study: Study, network: Network, places: Places, whole: Sequence[Shown]
) -> list[float | int | None]:
    """West, south, east and north of what the map shows at first: where volumes change."""
    volume = next(one for one in whole if one.quantity.name == "volume_veh")
    ids = pd.Index(network.links["link_id"].astype(str))
    sizes, edited = np.zeros(len(ids)), np.zeros(len(ids), bool)
    for entry in study.compared:
        links = comparison_of(entry).links.set_index("link_id").reindex(ids)
        change = np.nan_to_num(np.abs(volume.of(links)))
        sizes = np.maximum(sizes, np.where(change >= volume.breaks[0], change, 0.0))
        few = links["changed"].fillna(False).to_numpy(bool)
        edited |= few if few.mean() < LOCAL else False
    return plain(changed_part(MapPlane(places.lines, places.points, None), sizes, edited), 5)


def _edges(study: Study) -> list[float]:
    times = comparison_of(study.compared[0]).link_times
    return [*np.unique(times["begin_s"]).tolist(), float(times["end_s"].max())]


def _volume(study: Study, network: Network) -> Floats:
    """The most vehicles of any run, by which links are drawn over one another."""
    ids = network.links["link_id"].astype(str)
    most: Floats = np.zeros(len(ids))
    for entry in study.compared:
        links = comparison_of(entry).links.set_index("link_id")
        for side in ("base", "scenario"):
            own = links[f"volume_veh_{side}"].reindex(ids).fillna(0.0)
            most = np.maximum(most, own.to_numpy(float))
    return most


def _quantity(shown: Shown) -> dict[str, Any]:
    classes = classes_of(shown)
    return {
        "key": shown.quantity.name,
        "label": shown.label[0].upper() + shown.label[1:],
        "title": shown.quantity.title,
        "unit": shown.unit,
        "relative": shown.relative,
        "breaks": list(shown.breaks),
        "labels": [one.label for one in classes] + [ONLY_BASE, ONLY_SCENARIO, NOT_COMPARED],
        "colours": [one.colour for one in classes] + [REMOVED, ADDED, UNKNOWN],
        "colours_on_dark": [one.on_dark for one in classes]
        + [REMOVED_ON_DARK, ADDED_ON_DARK, UNKNOWN_ON_DARK],
    }


def _scenario(entry: Scenario, network: Network) -> dict[str, Any]:
    links = comparison_of(entry).links.set_index("link_id")
    ids = pd.Index(network.links["link_id"].astype(str))
    kinds = links["exists"].map(KINDS).reindex(ids).fillna(ABSENT).astype(int)
    changed = links["changed"].reindex(ids).fillna(False).to_numpy(bool)
    return {
        "name": entry.name,
        "seeds": len(comparison_of(entry).seeds),
        "kinds": kinds.tolist(),
        "changed": np.flatnonzero(changed & (kinds.to_numpy() == KINDS["both"])).tolist(),
    }

"""What the import of an OpenStreetMap file assumed, repaired or left out, as notes."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pandas as pd

from uxsim_geo.network.note_words import note_in_words
from uxsim_geo.network.notes import Notes, Severity
from uxsim_geo.network.osm_defaults import Defaults
from uxsim_geo.network.osm_file import OsmFile
from uxsim_geo.network.osm_links import SHORTEST, DirectedLinks
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.osm_sections import Sections
from uxsim_geo.network.osm_ways import Ways
from uxsim_geo.network.units import KMH

#: the same remark on more links than this is one note with their number
MOST_SINGLE_NOTES = 1000

#: regions of a country that a note names
REGIONS_TOLD = 5

#: kinds of tags whose conditions are not applied
CONDITIONAL = frozenset(
    [
        *("maxspeed", "access", "motor_vehicle", "vehicle", "motorcar", "oneway"),
        *("lanes", "bus", "psv"),
    ]
)


def note_file(file: OsmFile, options: OsmOptions, notes: Notes) -> None:
    """Say which side is driven on, what was left out, what is not applied."""
    notes.add(
        "driving side", "the side driven on: geometry does not depend on it", value=options.side
    )
    for reason, number in sorted(file.dropped.items()):
        notes.add("ways left out", f"{reason}: no links; value: ways", element="link", value=number)
    conditions = Counter(
        key
        for tags in file.way_tags
        for key in tags
        if key.endswith(":conditional") and key.partition(":")[0] in CONDITIONAL
    )
    for key, number in sorted(conditions.items()):
        notes.add(
            "conditional tag", f"{key} is not applied; value: ways", element="link", value=number
        )


def note_missing_nodes(
    file: OsmFile, sections: Sections, links: DirectedLinks, notes: Notes
) -> None:
    """Ways of which the file lacks nodes, told of the first link of each, if it has any."""
    note = "the way names nodes (value: how many) that the file lacks: cut there"
    incomplete = np.flatnonzero(sections.missing)
    first = np.searchsorted(links.way, incomplete)
    linked = np.isin(incomplete, links.way)
    missing = sections.missing[incomplete].tolist()
    ids = links.ids.iloc[first[linked]].tolist()
    notes.warn_each("missing nodes", note, ids, [missing[row] for row in np.flatnonzero(linked)])
    for row in np.flatnonzero(~linked).tolist():
        name = str(file.way_ids[incomplete[row]])
        text = f"way {name} names nodes (value: how many) that the file lacks: nothing is left"
        notes.add("missing nodes", text, element="link", severity="warning", value=missing[row])


def note_ways(file: OsmFile, ways: Ways, links: DirectedLinks, notes: Notes) -> None:
    """Remarks on ways, told of the first link of each."""
    first = np.searchsorted(links.way, np.arange(len(ways.open)))
    ids = links.ids.tolist()
    for row in np.setdiff1d(np.arange(len(ways.open)), links.way).tolist():
        note = "a way (value) without two nodes or a direction open to cars: no links"
        notes.add("way without links", note, element="link", value=int(file.way_ids[row]))
    found: dict[tuple[str, str], tuple[list[str], list[object]]] = {}
    for row, remark in ways.remarks:
        link = int(first[row])
        if link == len(ids) or links.way[link] != row:
            continue  # no link is left of it
        told, values = found.setdefault((remark.topic, remark.note), ([], []))
        told.append(ids[link])
        values.append(remark.value)
    for (topic, note), (told, values) in sorted(found.items()):
        if len(told) <= MOST_SINGLE_NOTES:
            notes.add_each(topic, note, told, values=values)
        else:
            many = f"{note_in_words(note)}; value: how many ways"
            notes.add(topic, many, element="link", value=len(told))


def note_assumptions(links: pd.DataFrame, options: OsmOptions, notes: Notes) -> None:
    """How many links of each class have an assumed speed or assumed lanes, and which."""
    speed_kmh = (links["free_speed"] * KMH).round(1)
    implied = links["free_speed_source"] == "assumed"
    of_class = implied & links["free_speed_basis"].str.startswith("class ")
    kind = ("free speed assumed", "km/h")
    _note_by_class(kind, links, speed_kmh[of_class], options.country, notes)
    for basis, found in speed_kmh[implied & ~of_class].groupby(links["free_speed_basis"]):
        used = ", ".join(f"{value:g}" for value in sorted(found.unique()))
        note = f"{basis}: {used} km/h as the table of zones says; value: links"
        notes.add("free speed implied", note, element="link", value=len(found))
    lanes = links["lanes"][links["lanes_source"] == "assumed"]
    _note_by_class(("lanes assumed", "lanes"), links, lanes, options.country, notes)
    short = links["link_id"][links["length"] <= SHORTEST]
    note = f"both ends at one place: a length of {SHORTEST:g} m assumed"
    notes.add_each("length assumed", note, list(short))
    loops = links["link_id"][links["from_node_id"] == links["to_node_id"]]
    notes.add_each("self-loop", "the link leads back to its own node", list(loops))


def note_whose_defaults(
    links: pd.DataFrame, options: OsmOptions, defaults: Defaults, notes: Notes
) -> None:
    """Say whose speeds and lanes stand where the file has none, if it lacks any.

    A warning where no country is given, or a region of which no table has a row.
    """
    assumed = (links["free_speed_source"] == "assumed") | (links["lanes_source"] == "assumed")
    if not assumed.any():
        return
    country = options.country
    regions = defaults.regions_beside(country)
    note = f"speeds and lanes that the file lacks are those usual in {country}"
    if country == "default":
        note = "no country is given, as DE: speeds and lanes that the file lacks are those of the "
        note += "rows default of the tables, of no country in particular"
    elif regions is not None:
        first = [*regions[:REGIONS_TOLD], *(["..."] if len(regions) > REGIONS_TOLD else [])]
        note = f"no table has a row of the region {country}: speeds and lanes that the file lacks "
        note += f"are those of {country.partition('-')[0]}"
        note += f"; regions with rows: {', '.join(first)}" if regions else ""
    known = country != "default" and regions is None
    severity: Severity = "info" if known else "warning"
    note += "; value: share of the links"
    notes.add("country", note, element="link", severity=severity, value=float(assumed.mean()))


def _note_by_class(
    kind: tuple[str, str], links: pd.DataFrame, assumed: pd.Series, country: str, notes: Notes
) -> None:
    """One note a road class: what was assumed, and on which share of its links.

    ``kind``: topic and unit of what was assumed; ``assumed``: the values of those links.
    """
    topic, unit = kind
    total = links.groupby("road_class").size()
    for road_class, found in assumed.groupby(links["road_class"]):
        used = ", ".join(f"{value:g}" for value in sorted(found.unique()))
        what = "1 lane" if (used, unit) == ("1", "lanes") else f"{used} {unit}"
        note = (
            f"{road_class}: {what} assumed (country {country}) "
            f"on {len(found)} of {total[road_class]} links; value: share"
        )
        notes.add(topic, note, element="link", value=len(found) / total[road_class])

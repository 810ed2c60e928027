"""What a scenario changes, told to those who read its results: in sentences, places by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pipeline.dry_run import EXISTS, NOTHING, Change, changes_of, cut_off_in_words
from pipeline.scenarios import Scenario, Tables
from uxsim_geo.network.rows import listed

#: so many streets or ids are named
NAMED = 4

#: ends of the names of attributes that are units, and how they are written
UNITS = {
    "_kmh": "km/h",
    "_vph": "veh/h",
    "_vpkm": "veh/km",
    "_m": "m",
    "_s": "s",
}


def edits_in_sentences(scenario: Scenario, base: Scenario, read: Tables) -> tuple[str, ...]:
    """Return a sentence for each attribute that the scenario's edits change.

    ``read``: tables of the base.
    """
    names = _street_names(scenario, base, read)
    found = [_sentence(change, names) for change in changes_of(scenario, base, read)]
    return (*found, *cut_off_in_words(scenario))


def _sentence(change: Change, names: Mapping[str, str]) -> str:
    of = _elements(change, names)
    if change.attribute == EXISTS:
        return f"{of} {change.what}"
    attribute, unit = _attribute(change.attribute)
    before, after = change.before, change.after
    if change.attribute == "closed" and before == NOTHING:
        return f"{of} closed, {after}"
    if change.attribute == "banned":
        return f"{of} {'banned' if before == NOTHING else 'banned no more'}"
    becomes = f"{attribute} {after}" if before == NOTHING else f"{attribute} {before} → {after}"
    if after == NOTHING:
        becomes = f"no {attribute} (was {before})"
    becomes = f"{becomes} {unit}".rstrip()
    return f"{of}: {becomes}" if of else becomes


def _elements(change: Change, names: Mapping[str, str]) -> str:
    """Say how many elements there are and which; of pairs how many alone."""
    if not change.how_much or change.element == "demand":
        return change.how_much
    told = list(dict.fromkeys(names.get(one, one) for one in change.ids))
    return f"{change.how_much} ({listed(told[:NAMED], len(told))})"


def _attribute(name: str) -> tuple[str, str]:
    """Return an attribute's name as words, and its unit."""
    for ending, unit in UNITS.items():
        if name.endswith(ending) and "." not in name:
            return name.removesuffix(ending).replace("_", " "), unit
    return (name if "." in name else name.replace("_", " ")), ""


def _street_names(scenario: Scenario, base: Scenario, read: Tables) -> dict[str, str]:
    """Return the street of each link that has a name."""
    found: dict[str, str] = {}
    for tables in (read, base.tables, scenario.tables):
        if tables is not None and "name" in tables.network.links:
            links: Sequence[tuple[object, object]] = list(
                zip(tables.network.links["link_id"], tables.network.links["name"], strict=True)
            )
            found |= {str(id_): name for id_, name in links if isinstance(name, str) and name}
    return found

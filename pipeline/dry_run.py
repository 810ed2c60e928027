"""What the scenarios of a study change, before anything runs: as a table and as a map layer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.scenario_changes import all_changes
from pipeline.scenarios import BASE, Scenario, Tables
from pipeline.warned import number_in_words
from uxsim_geo.network.rows import count, listed

if TYPE_CHECKING:
    import pandas as pd

#: so many pairs without a way are named
NAMED_PAIRS = 5

#: so many texts are named where they differ
NAMED_TEXTS = 3


def dry_run_text(scenarios: Mapping[str, Scenario], read: Tables) -> str:
    """Return what each scenario changes: a line for each edit and attribute.

    ``scenarios``: as :func:`pipeline.scenarios.resolve` gives them; ``read``: tables of the base.
    """
    base = scenarios[BASE]
    parts = [
        "\n".join(_of_scenario(scenario, base, read))
        for name, scenario in scenarios.items()
        if name != BASE
    ]
    return "\n\n".join(parts)


def _of_scenario(scenario: Scenario, base: Scenario, read: Tables) -> Iterator[str]:
    yield f"{scenario.name}: {count(len(scenario.edits), 'edit')}"
    if scenario.tables is None:
        yield "  reads other files (ingest): what it changes of tables is seen when it is run"
    changes = all_changes(scenario, base, read)
    cells = list(_cells(changes, scenario, base, read))
    widths = [max(len(row[place]) for row in cells) for place in range(3)] if cells else []
    for row in cells:
        padded = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=False))
        yield f"  {padded}  {row[3]}"
    if not cells and scenario.tables is not None:
        yield "  changes nothing"
    yield from _cut_off(scenario)


def _cells(
    changes: pd.DataFrame, scenario: Scenario, base: Scenario, read: Tables
) -> Iterator[tuple[str, str, str, str]]:
    """Yield line, edit, how much, and what becomes of what, of each edit and attribute."""
    keys = ["line", "edit", "element", "attribute"]
    grouped = changes.groupby(keys, sort=False, dropna=False)
    order = list(dict.fromkeys(map(tuple, changes[keys].astype(object).to_numpy().tolist())))
    numbers = grouped.ngroup()
    for number, (line, edit, element, attribute) in enumerate(order):
        own = changes[numbers == number]
        at = f"line {line}" if line == line and line is not None else "base"
        what = _before_and_after(own, attribute)
        yield at, edit, _how_much(own, element, scenario, base, read), what


def _how_much(
    own: pd.DataFrame, element: str, scenario: Scenario, base: Scenario, read: Tables
) -> str:
    """Say how many elements an edit changes: links with their length, pairs with their vehicles."""
    ids = own["id"].drop_duplicates()
    if element == "link":
        known = [tables.network.links for tables in (scenario.tables, base.tables, read) if tables]
        metres: dict[str, float] = {}
        for links in known:
            own_length = zip(links["link_id"].astype(str), links["length"], strict=True)
            metres = dict(own_length) | metres
        total = sum(metres.get(one, 0.0) for one in ids)
        return f"{count(len(ids), 'link')}, {total / 1000:,.1f} km"
    if element == "demand":
        return count(len(ids), "pair")
    if element in ("control", "setting"):
        return ""
    return count(len(ids), element)


def _before_and_after(own: pd.DataFrame, attribute: str) -> str:
    if attribute == "exists":
        return "added" if own["before"].isna().all() else "removed"
    before, after = (_range(own[name]) for name in ("before", "after"))
    if attribute == "vehicles":
        sums = [own[name].dropna().astype(float).sum() for name in ("before", "after")]
        before, after = (number_in_words(total) for total in sums)
    return f"{attribute}: {before} → {after}"


def _range(values: pd.Series) -> str:
    """One value, or from the lowest to the highest, or some texts; – where there is none."""
    import pandas as pd

    texts = values.dropna().drop_duplicates()
    if not len(texts):
        return "–"
    numbers = pd.to_numeric(texts, errors="coerce")
    if numbers.notna().all():
        low, high = (f"{number:,.6g}" for number in (numbers.min(), numbers.max()))
        told = low if low == high else f"{low} to {high}"
    else:
        told = listed(texts.tolist()[:NAMED_TEXTS], len(texts))
    return f"{told} (where given)" if values.isna().any() else told


def _cut_off(scenario: Scenario) -> Iterator[str]:
    """Name pairs without any way that had one in the base."""
    lost = scenario.cut_off
    if not len(lost) or not lost["had_way"].any():
        return
    lost = lost[lost["had_way"]]
    named = [
        f"{row.origin} to {row.destination}"
        for row in lost.head(NAMED_PAIRS).itertuples(index=False)
    ]
    vehicles = number_in_words(lost["vehicles"].sum())
    yield (
        f"  warning: no way is left for {count(len(lost), 'pair')} with {vehicles} trips: "
        f"{listed(named, len(lost))}"
    )


def write_changes(path: Path, scenarios: Mapping[str, Scenario], read: Tables) -> None:
    """Write a GeoPackage of what changes where: layers of links, and of nodes and turns."""
    import pandas as pd

    from uxsim_geo.export.run_description import RunDescription
    from uxsim_geo.export.scenario_changes import Edited, write_scenario_changes

    base = scenarios[BASE]
    edited = []
    for name, scenario in scenarios.items():
        if name != BASE:
            network = (scenario.tables or read).network
            edited.append(Edited(name, network, all_changes(scenario, base, read)))
    report = base.config.report
    description = RunDescription(
        report.start,
        pd.DataFrame(),
        {"name": base.config.name},
        base.config.name,
        report.driving_side or "right",
        report.attribution or "",
    )
    write_scenario_changes(path, read.network, edited, description)

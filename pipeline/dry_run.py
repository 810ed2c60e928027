"""What the scenarios of a study change, before anything runs: as a table and as a map layer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pipeline.scenario_changes import all_changes
from pipeline.scenarios import BASE, Scenario, Tables
from uxsim_geo.network.note_words import number_in_words
from uxsim_geo.network.rows import count, listed

if TYPE_CHECKING:
    import pandas as pd


class Change(NamedTuple):
    """What an edit makes of an attribute: where it stands, its key, of what, how much, from, to.

    ``ids`` are those of the elements; ``before`` and ``after`` words, – where there was nothing
    """

    at: str
    edit: str
    element: str
    ids: Sequence[str]
    how_much: str
    attribute: str
    before: str
    after: str

    @property
    def what(self) -> str:
        """What becomes of it, in short."""
        if self.attribute == EXISTS:
            return "added" if self.before == NOTHING else "removed"
        return f"{self.attribute}: {self.before} → {self.after}"


#: attribute of what comes or goes
EXISTS = "exists"

#: in the place of a value that is not there
NOTHING = "–"


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
    cells = changes_of(scenario, base, read)
    shown = [(row.at, row.edit, row.how_much) for row in cells]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    for row, told in zip(cells, shown, strict=True):
        padded = "  ".join(cell.ljust(width) for cell, width in zip(told, widths, strict=True))
        yield f"  {padded}  {row.what}"
    if not cells and scenario.tables is not None:
        yield "  changes nothing"
    yield from (f"  {line}" for line in cut_off_in_words(scenario))


def changes_of(scenario: Scenario, base: Scenario, read: Tables) -> list[Change]:
    """Return what each edit of a scenario makes of each attribute, in the order of the edits."""
    return list(_changes(all_changes(scenario, base, read), scenario, base, read))


def _changes(
    changes: pd.DataFrame, scenario: Scenario, base: Scenario, read: Tables
) -> Iterator[Change]:
    """Yield what each edit makes of each attribute."""
    import pandas as pd

    known = _lengths(scenario, base, read)
    keys = ["line", "edit", "element", "attribute"]
    grouped = changes.groupby(keys, sort=False, dropna=False)
    order = list(dict.fromkeys(map(tuple, changes[keys].astype(object).to_numpy().tolist())))
    numbers = grouped.ngroup()
    for number, (line, edit, element, attribute) in enumerate(order):
        own = changes[numbers == number]
        at = f"line {line}" if pd.notna(line) else "base"
        ids = own["id"].drop_duplicates().tolist()
        much = _how_much(ids, element, known)
        yield Change(at, edit, element, ids, much, attribute, *_before_and_after(own, attribute))


def _lengths(scenario: Scenario, base: Scenario, read: Tables) -> dict[str, float]:
    """Length of every link that the scenario has or had, m."""
    metres: dict[str, float] = {}
    for tables in (read, base.tables, scenario.tables):
        if tables is not None:
            links = tables.network.links
            metres |= dict(zip(links["link_id"].astype(str), links["length"], strict=True))
    return metres


def _how_much(ids: Sequence[str], element: str, metres: Mapping[str, float]) -> str:
    """Say how many elements an edit changes; of links with their length, of settings which."""
    if element == "link":
        total = sum(metres.get(one, 0.0) for one in ids)
        return f"{count(len(ids), 'link')}, {total / 1000:,.1f} km"
    if element == "demand":
        return _pairs(len(ids))
    return "" if element in ("control", "setting") else count(len(ids), element)


def _pairs(number: int) -> str:
    return f"{number:,} pair{'' if number == 1 else 's'}"


def _before_and_after(own: pd.DataFrame, attribute: str) -> tuple[str, str]:
    before, after = (_range(own[name]) for name in ("before", "after"))
    if attribute == "vehicles":
        sums = [own[name].dropna().astype(float).sum() for name in ("before", "after")]
        before, after = (number_in_words(total) for total in sums)
    return before, after


def _range(values: pd.Series) -> str:
    """One value, or from the lowest to the highest, or some texts; – where there is none."""
    import pandas as pd

    texts = values.dropna().drop_duplicates()
    if not len(texts):
        return NOTHING
    numbers = pd.to_numeric(texts, errors="coerce")
    if numbers.notna().all():
        low, high = (f"{number:,.6g}" for number in (numbers.min(), numbers.max()))
        told = low if low == high else f"{low} to {high}"
    else:
        told = listed(texts.tolist()[:NAMED_TEXTS], len(texts))
    return f"{told} (where given)" if values.isna().any() else told


def cut_off_in_words(scenario: Scenario) -> Iterator[str]:
    """Name pairs without any way that had one in the base, in a line where there are some."""
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
        f"warning: no way is left for {_pairs(len(lost))} with {vehicles} trips: "
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
            changes = all_changes(scenario, base, read)
            elsewhere = changes["element"].isin(("demand", "control", "setting"))
            told = _changes(changes[elsewhere], scenario, base, read)
            others = pd.DataFrame(
                [(row.element, row.how_much, row.what, f"{row.edit} ({row.at})") for row in told],
                columns=["element", "id", "what", "edits"],
            )
            edited.append(Edited(name, network, changes[~elsewhere], others))
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

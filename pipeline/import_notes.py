"""What is told of an import beside its tables: doubts, places of notes, the page, a summary."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.attribution import owners
from pipeline.config import Config
from uxsim_geo.network.note_words import percent
from uxsim_geo.network.ready_options import ReadyOptions

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import pandas as pd

    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network

#: the page in a run folder
PAGE = "import_notes.html"

#: classes of roads in a summary
CLASSES_SHOWN = 5


def with_doubts(network: Network, as_read: Network) -> Network:
    """The network with notes on what looks wrong in it, and the place of every note.

    Elements that are no longer there have the place that they had in ``as_read``.
    """
    import pandas as pd

    from uxsim_geo.network.doubts import note_doubts
    from uxsim_geo.network.note_geometry import placed
    from uxsim_geo.network.notes import Notes

    notes = Notes()
    note_doubts(network, notes)
    told = pd.concat([network.notes, notes.table()], ignore_index=True)
    return replace(network, notes=placed(told, network, as_read))


def write_page(config: Config, network: Network, demand: Demand, path: Path) -> Path:
    """Write the page of a run's import; its path."""
    import pandas as pd

    from uxsim_geo.export.import_page import ImportDescription, write_import_page

    section = config.ingest
    description = ImportDescription(
        config.name,
        pd.concat([network.notes, demand.notes], ignore_index=True),
        ReadyOptions.step if section.steps is None else section.steps.step_s,
        openstreetmap=section.format == "osm",
        attribution=owners(section),
    )
    write_import_page(path, network, description)
    return path


def summary_rows(network: Network) -> list[tuple[str, ...]]:
    """What is given, assumed and doubtful, in a few rows: name, figures, what they are of."""
    from uxsim_geo.network.import_shares import shares_by_class, shares_of_all, short_links

    links = network.links
    classes = shares_by_class(links).to_dict("records")
    whole = shares_of_all(links)
    rows = [("given by the source", *_shares(whole))]
    if len(classes) > 1:
        rows += [(f"  {row['road_class']}", *_shares(row)) for row in classes[:CLASSES_SHOWN]]
    if len(classes) > CLASSES_SHOWN:
        km = sum(row["km"] for row in classes[CLASSES_SHOWN:])
        rows.append((f"  {len(classes) - CLASSES_SHOWN} more", f"see {PAGE}", f"of {km:,.1f} km"))
    short = len(short_links(network, ReadyOptions.step))
    share = percent(short / len(links)) if len(links) else "–"
    rows.append(
        ("short links", f"{short:,}, {share}", f"driven in less than {ReadyOptions.step:g} s")
    )
    return [*rows, *_told(network.notes)]


def _shares(row: Mapping[Any, Any]) -> tuple[str, str]:
    lanes, speed = percent(row["lanes_given"]), percent(row["free_speed_given"])
    return f"lanes {lanes}, speed {speed}", f"of {row['km']:,.1f} km"


def _told(notes: pd.DataFrame) -> Iterator[tuple[str, str, str]]:
    """How the network hangs together, and how many doubts there are of each kind."""
    from uxsim_geo.network.doubts import CONNECTIONS, DOUBTS
    from uxsim_geo.network.import_shares import number_of_spots

    looked = notes[notes["topic"] == CONNECTIONS]
    for value, note in zip(looked["value"], looked["note"], strict=True):
        parts, _, _ = note.partition(";")
        yield "connections", f"{percent(float(value))} of the length", f"in the greatest; {parts}"
    numbers = {topic: number_of_spots(notes[notes["topic"] == topic]) for topic in DOUBTS}
    found = {topic: number for topic, number in numbers.items() if number}
    for topic, number in found.items():
        yield topic, f"{number:,}", "spots to look at"
    if len(looked) and not found:
        yield "doubtful spots", "none", ""

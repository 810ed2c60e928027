"""What one run is compared by: small tables that are kept in files beside the run."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete
from uxsim_geo.parquet import read_tables, write_table

#: names of the tables, each a file
TABLES = ("totals", "links", "link_times", "od", "zone_pairs", "corridors", "trips")

FACTS = "measured.json"

#: names of all the files
FILES = (FACTS, *(f"{name}.parquet" for name in TABLES))

#: grows whenever the tables change their meaning
FORMAT = 1


@dataclass(frozen=True)
class Measured:
    """Figures and tables of one run; units as their names say, ids as text, NaN where undefined.

    seed, duration_s, bin_s
        of the run, and of the time bins
    totals
        figure, value: those of :data:`uxsim_geo.analysis.comparison.quantities.TOTALS`
    links
        link_id, from_node_id, to_node_id, length, lanes, free_speed, jam_density, capacity,
        merge_priority (as in the network), and the quantities LINKS; in the network's order
    link_times
        link_id, begin_s, end_s, and LINK_TIMES: links first
    od
        origin, destination (node_id), and TRIPS: pairs that have any trips
    zone_pairs
        origin_zone, destination_zone, and TRIPS
    corridors
        corridor, begin_s, end_s, and CORRIDORS
    trips
        one row a platoon: origin, destination, class, number (its identity), vehicles, status
        (``not_departed`` where it wanted to depart after the end), depart_s, travel_time_s and
        delay_s (so far), origin_zone, destination_zone (null outside of all zones)
    """

    seed: int
    duration_s: float
    bin_s: float
    totals: pd.DataFrame
    links: pd.DataFrame
    link_times: pd.DataFrame
    od: pd.DataFrame
    zone_pairs: pd.DataFrame
    corridors: pd.DataFrame
    trips: pd.DataFrame


def write_measured(measured: Measured, folder: Path) -> list[str]:
    """Write facts and tables into a folder (made if absent); the names of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in TABLES:
        write_table(getattr(measured, name), folder / f"{name}.parquet")
    facts = {
        "format": FORMAT,
        "seed": measured.seed,
        "duration_s": measured.duration_s,
        "bin_s": measured.bin_s,
    }
    with replace_when_complete(folder / FACTS) as path:
        path.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    return list(FILES)


def read_measured(folder: Path) -> Measured:
    """Read what :func:`write_measured` wrote.

    Raises :class:`uxsim_geo.errors.InputError` for files that are absent, damaged, or of another
    version.
    """
    path = folder / FACTS
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
        known = facts.pop("format") == FORMAT
    except (OSError, ValueError, KeyError, AttributeError):
        known = False
    if not known:
        what = "holds no measures that this version reads: measure the run again"
        raise InputError([Fault(what, str(path))])
    tables = read_tables(*(folder / f"{name}.parquet" for name in TABLES))
    values: dict[str, Any] = facts | dict(zip(TABLES, tables, strict=True))
    return Measured(**values)

"""TNTP flow files: volume and cost of a static assignment, link by link."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.tntp_net import END_NAMES, ENDS, find_column
from uxsim_geo.network.tntp_rows import id_column, number_column, read_rows


def read_flow(path: Path, faults: Faults) -> pd.DataFrame | None:
    """from_node_id, to_node_id, volume, cost (in the file's units) and line, one row a link.

    None, and at least one fault, where nothing can be made of the file.
    """
    rows = read_rows(path, faults, names=("from", "to", "volume", "cost"))
    if rows is None:
        return None
    start = find_column(rows, "from", END_NAMES["init_node"], faults)
    end = find_column(rows, "to", END_NAMES["term_node"], faults)
    for name in ("volume", "cost"):
        find_column(rows, name, (name,), faults)
    if faults.found:
        return None
    flow = pd.DataFrame(
        {
            "from_node_id": id_column(rows, start, faults),
            "to_node_id": id_column(rows, end, faults),
            "volume": number_column(rows, "volume", faults),
            "cost": number_column(rows, "cost", faults),
            "line": rows.lines,
        }
    )
    return flow.drop_duplicates(ENDS, ignore_index=True)


def add_unknown_link_faults(flow: pd.DataFrame, table: pd.DataFrame, faults: Faults) -> None:
    """Note every row of the flow file whose link the net file lacks."""
    known = pd.MultiIndex.from_frame(table[ENDS])
    unknown = flow[~pd.MultiIndex.from_frame(flow[ENDS]).isin(known)]
    for start, end, line in zip(
        unknown["from_node_id"], unknown["to_node_id"], unknown["line"], strict=True
    ):
        faults.add("the net file has no such link", line=line, value=f"{start}-{end}")


def with_flow(table: pd.DataFrame, flow: pd.DataFrame, notes: Notes) -> pd.DataFrame:
    """The net file's table with the columns volume and cost, empty where the flow file is."""
    joined = table.merge(flow.drop(columns="line"), on=ENDS, how="left", validate="one_to_one")
    missing = int(joined["volume"].isna().sum())
    if missing:
        note = "links without a row in the flow file: no volume and cost; value: links"
        notes.add("flow missing", note, element="link", value=missing)
    return joined.set_index(table.index)

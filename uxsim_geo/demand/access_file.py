"""Access nodes of zones that were chosen by hand, in a CSV or Parquet file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.demand.access import ENDS, Access, with_shares
from uxsim_geo.demand.od_table import add_of_rows, natural_order
from uxsim_geo.demand.table_files import find_columns, ids_of, numbers_of, read_table_file
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import is_among, lacking


def read_access(path: Path, network: Network) -> Access:
    """Read access nodes that were chosen by hand: zone, node, weight, for both ends.

    CSV or Parquet; without the column weight all count alike; a column end (origin, destination
    or both, the default) may say for which end a row is meant. Raises
    :class:`uxsim_geo.errors.InputError` with every fault, its line, column and value.
    """
    faults = Faults(str(path))
    table = read_table_file(path, faults)
    faults.raise_if_any()
    assert table is not None, "else there was a fault"
    names = {"zone": ("zone", "zone_id"), "node": ("node", "node_id")}
    found = find_columns(table, names | {"weight": ("weight",), "end": ("end",)}, {}, faults)
    for name in names:
        if name not in found:
            there = ", ".join(map(str, table.columns))
            faults.add(f"lacks the column {name} (columns here: {there})")
    faults.raise_if_any()
    rows = pd.DataFrame({name: ids_of(table, found[name], faults) for name in names})
    rows["weight"] = numbers_of(table, found["weight"], faults) if "weight" in found else 1.0
    rows["end"] = table[found["end"]].astype("str") if "end" in found else "both"
    rows["end"] = rows["end"].replace("", "both").fillna("both")
    _add_access_faults(rows, network, faults)
    faults.raise_if_any()
    order = pd.Index(natural_order(rows["zone"].unique()), dtype="str")
    rows = rows.iloc[np.lexsort((rows["node"], order.get_indexer(pd.Index(rows["zone"]))))]
    sides = [rows[rows["end"].isin([end, "both"])] for end in ENDS]
    tables = [with_shares(side, side["weight"].to_numpy(np.float64)) for side in sides]
    return Access(order, *tables)


def _add_access_faults(rows: pd.DataFrame, network: Network, faults: Faults) -> None:
    weight = rows["weight"].to_numpy(np.float64)
    unknown = ~is_among(rows["node"], network.nodes["node_id"].astype("str"))
    twice = rows.duplicated(["zone", "node", "end"]).to_numpy(bool)
    for wrong, column, what in (
        (lacking(rows["zone"]), "zone", "needs a name"),
        (unknown, "node", "is no node of the network"),
        (~(np.isfinite(weight) & (weight > 0)), "weight", "must be a finite number above 0"),
        (
            ~rows["end"].isin([*ENDS, "both"]).to_numpy(bool),
            "end",
            "must be origin, destination or both",
        ),
        (twice, "node", "the node serves this zone in an earlier row already"),
    ):
        add_of_rows(faults, rows, wrong, column, what)

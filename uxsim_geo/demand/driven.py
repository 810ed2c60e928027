"""The demand that is driven, with what edits take out and move, as a plain table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from uxsim_geo.demand.demand import Demand, no_changes


def driven(demand: Demand) -> Demand:
    """Return the vehicles that are expected to drive, without batches and changes.

    Rows of which a share is moved become two. The platoons cut from it are others than those of
    the demand itself: it is for sums and pictures.
    """
    if not len(demand.changes) and "batch" not in demand.table:
        return demand
    table = demand.table.drop(columns="batch", errors="ignore")
    table = table.assign(of=np.arange(len(table)))
    for number in sorted(set(demand.changes["edit"].tolist())):
        edit = demand.changes[demand.changes["edit"] == number]
        one = edit.iloc[0]
        table = _changed(table, table["of"].isin(edit["row"]).to_numpy(bool), one)
    table = table.sort_values("of", kind="stable").drop(columns="of").reset_index(drop=True)
    return replace(demand, table=table, changes=no_changes())


def _changed(table: pd.DataFrame, chosen: np.ndarray, one: pd.Series) -> pd.DataFrame:
    share, by_s = float(one["share"]), float(one["by_s"])
    meant = table[chosen].assign(vehicles=table["vehicles"][chosen] * share)
    if one["kind"] == "stays":
        return pd.concat([table[~chosen], meant[meant["vehicles"] > 0]])
    moved = meant.assign(start_s=meant["start_s"] + by_s, end_s=meant["end_s"] + by_s)
    rest = table[chosen].assign(vehicles=table["vehicles"][chosen] * (1 - share))
    return pd.concat([table[~chosen], rest[rest["vehicles"] > 0], moved])

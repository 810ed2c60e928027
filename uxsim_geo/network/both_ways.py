"""Rows that stand for both directions of a road, made into two links."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults

ENDS = ["from_node_id", "to_node_id"]

#: what follows the id of a row in that of its second direction
REVERSE = "-reverse"


def with_both_directions(
    links: pd.DataFrame, taken: Collection[str], faults: Faults
) -> pd.DataFrame:
    """Each row whose ``both_ways`` holds as two, the second ``ID-reverse`` the other way.

    ``taken`` are all link ids of the file, of which none may be that of a second one.
    """
    import shapely

    both = links["both_ways"].to_numpy(dtype=bool)
    if not both.any():
        return links
    doubled = links.loc[links.index.repeat(np.where(both, 2, 1))]
    second = doubled.index.duplicated()
    turned = doubled.loc[second].copy()
    turned["link_id"] = turned["link_id"] + REVERSE
    turned[ENDS] = turned[ENDS[::-1]].set_axis(ENDS, axis=1)
    turned["geometry"] = shapely.reverse(turned["geometry"].to_numpy())
    for link_id in sorted(set(turned["link_id"]) & set(taken)):
        what = "is the id of the opposite direction of a row for both: rename it"
        faults.add(what, column="link_id", value=link_id)
    order = np.argsort(np.r_[np.flatnonzero(~second), np.flatnonzero(second)], kind="stable")
    return pd.concat([doubled.loc[~second], turned]).iloc[order].reset_index(drop=True)

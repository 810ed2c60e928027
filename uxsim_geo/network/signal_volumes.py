"""Volumes of links, as far as they are known, beside what the links can carry."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.rows import add_missing_columns, add_rows, is_among, numbers

Floats = npt.NDArray[np.float64]

VOLUME_COLUMNS = ("link_id", "volume_veh_h")

#: veh/h: no road carries as much
LARGEST_VOLUME = 1e6

_HOUR = 3600.0  # s


def flow_ratios(link_ids: pd.Series, capacity: Floats, volumes: pd.DataFrame | None) -> Floats:
    """Volume over saturation flow of each link, NaN where there is no volume; shape (links,).

    The saturation flow is the ``capacity`` (veh/s), since that is how the queues of the model
    discharge. ``volumes``: link_id, volume_veh_h. Raises :class:`uxsim_geo.errors.InputError` for
    columns that lack, unknown and repeated links, and volumes that are no number from 0 on.
    """
    ratios = np.full(len(link_ids), np.nan)
    if volumes is None:
        return ratios
    faults = Faults("volumes")
    if not add_missing_columns(faults, volumes, VOLUME_COLUMNS):
        ids, volume = volumes["link_id"], numbers(volumes["volume_veh_h"])
        add_rows(faults, ~is_among(ids, link_ids), "a link_id that the network lacks", ids=ids)
        add_rows(faults, ids.duplicated(), "the link_id of an earlier row", ids=ids)
        with np.errstate(invalid="ignore"):
            wrong = ~((volume >= 0.0) & (volume <= LARGEST_VOLUME))
        what = f"a volume_veh_h that is no number from 0 to {LARGEST_VOLUME:,.0f}"
        add_rows(faults, wrong, what, ids=ids)
    faults.raise_if_any()
    rows = pd.Index(link_ids).get_indexer(pd.Index(ids))
    ratios[rows] = volume / _HOUR / capacity[rows]
    return ratios

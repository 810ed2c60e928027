"""Which platoons edits take out or move: a share of them, drawn by who they are.

All platoons that an edit concerns are put in an order by a draw of their own identity, and the
first of them are chosen, so many that the share holds. So nobody else feels an edit, and those
chosen by a small share are among those chosen by a larger one.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.draws import MOVED, STAYS, Keys, combine, unit
from uxsim_geo.settings import Settings

Flags = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def changed_platoons(
    changes: pd.DataFrame, row: Ints, key: Keys, settings: Settings
) -> tuple[Flags, Floats]:
    """Return whether each platoon still drives, and by how much later, s; shape (platoons,) each.

    ``row``: of the demand table from which each platoon was cut; ``key``: who they are.
    """
    stays, later = np.ones(row.size, bool), np.zeros(row.size)
    for number in sorted(set(changes["edit"].tolist())):
        edit = changes[changes["edit"] == number]
        one = edit.iloc[0]
        concerned = np.flatnonzero(stays & np.isin(row, edit["row"].to_numpy(np.int64)))
        purpose = STAYS if one["kind"] == "stays" else MOVED
        chosen = _first(key[concerned], purpose, (number, float(one["share"])), settings)
        if one["kind"] == "stays":
            stays[concerned[~chosen]] = False
        else:
            later[concerned[chosen]] += float(one["by_s"])
    return stays, later


@np.errstate(over="ignore")  # hashes overflow by design
def _first(keys: Keys, purpose: np.uint64, edit: tuple[int, float], settings: Settings) -> Flags:
    """Choose a share of platoons; what is left of a whole number is drawn for all together."""
    number, share = edit
    own = combine(combine(keys, purpose), np.uint64(number))
    seed = combine(np.uint64(settings.seed), purpose)
    chance = 0.5 if settings.deterministic else float(unit(combine(seed, np.uint64(number))))
    count = math.floor(share * keys.size + chance) if share < 1 else keys.size
    chosen = np.zeros(keys.size, bool)
    chosen[np.argsort(own, kind="stable")[:count]] = True
    return chosen

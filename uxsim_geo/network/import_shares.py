"""How much of a network is given by its source and how much is assumed, by road class."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.network.incidence import Floats, rank_of
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import numbers

#: stands for the class of roads that have none
NO_CLASS = "(none)"

#: columns with a source, and the name of their share
SHARES = {"lanes_source": "lanes_given", "free_speed_source": "free_speed_given"}


def shares_by_class(links: pd.DataFrame) -> pd.DataFrame:
    """One row a road class, the longest first.

    Columns road_class, links, km, lanes_given, free_speed_given. The last two are shares in the
    km, 0 to 1, of what the source gives; the rest is assumed, or follows from something else that
    it gives. NaN where it is not known, or there is no length.
    """
    table = pd.DataFrame({"road_class": _classes(links), "km": _kilometres(links)})
    for source, share in SHARES.items():
        table[share] = table["km"] * _given(links, source)
    groups = table.groupby("road_class")
    found = groups.sum(min_count=1).assign(links=groups.size()).reset_index()
    for share in SHARES.values():
        found[share] = found[share] / found["km"].where(found["km"] > 0)
    order = np.lexsort((found["road_class"].to_numpy(dtype=object).astype("U"), -found["km"]))
    columns = ["road_class", "links", "km", *SHARES.values()]
    return found.iloc[order][columns].reset_index(drop=True)


def shares_of_all(links: pd.DataFrame) -> dict[str, float]:
    """The same over all links: links, km, lanes_given, free_speed_given."""
    km = _kilometres(links)
    total = float(km.sum())
    shares = {
        share: float((km * _given(links, source)).sum() / total) if total else float("nan")
        for source, share in SHARES.items()
    }
    return {"links": float(len(links)), "km": total, **shares}


def kilometres_by_basis(links: pd.DataFrame) -> pd.Series:
    """Length, km, by what the free speed goes by (column free_speed_basis), the longest first.

    Empty where the source knows no such thing.
    """
    if "free_speed_basis" not in links:
        return pd.Series(dtype="float64")
    km = pd.Series(_kilometres(links), index=links.index)
    found = km.groupby(links["free_speed_basis"].fillna(NO_CLASS)).sum().sort_index()
    return found.sort_values(ascending=False, kind="stable")


def short_links(network: Network, step: float) -> pd.DataFrame:
    """The links that are driven in less than ``step`` (s) at free speed, the shortest time first.

    Columns link_id and time (s).
    """
    links = network.links
    time = numbers(links["length"]) / numbers(links["free_speed"])
    table = pd.DataFrame({"link_id": links["link_id"], "time": time})
    short = np.flatnonzero(time < step)
    order = np.lexsort((rank_of(links["link_id"])[short], time[short]))
    return table.iloc[short[order]].reset_index(drop=True)


def number_of_spots(notes: pd.DataFrame) -> int:
    """How many spots notes of one topic are about: the value says it of doubts not listed."""
    counted = notes["element_id"].isna() & (notes["severity"] == "doubt")
    more = pd.to_numeric(notes["value"][counted], errors="coerce").sum()
    return int((~counted).sum() + more)


def _classes(links: pd.DataFrame) -> pd.Series:
    """Road class of each link."""
    if "road_class" not in links:
        return pd.Series(NO_CLASS, index=links.index)
    return links["road_class"].astype("str").fillna(NO_CLASS)


def _kilometres(links: pd.DataFrame) -> Floats:
    return np.asarray(np.nan_to_num(numbers(links["length"])) / 1000.0)


def _given(links: pd.DataFrame, source: str) -> Floats:
    """1 where the source gave the value, 0 elsewhere; NaN where that is not known."""
    if source not in links:
        return np.full(len(links), np.nan)
    known = np.asarray(links[source].notna(), dtype=bool)
    return np.where(known, np.asarray(links[source] == "given", dtype=bool).astype(float), np.nan)

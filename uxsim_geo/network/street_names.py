"""What people call a link: by its street."""

from __future__ import annotations

import pandas as pd


def given_names(links: pd.DataFrame) -> pd.Series:
    """The name of every link: its street's, else its road's number; null where it has neither."""
    names = pd.Series(pd.NA, index=links.index, dtype="str")
    for column in ("name", "ref"):
        if column in links:
            given = links[column].astype("str").str.strip()
            names = names.fillna(given.mask(given == ""))
    return names


def street_names(links: pd.DataFrame) -> pd.Series:
    """The name of every link: its street's, else its road's number, else ``link`` and its id."""
    ids = "link " + links["link_id"].astype("string")
    return given_names(links).astype("string").fillna(ids).astype(str)

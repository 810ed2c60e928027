"""What people call a link: by its street."""

from __future__ import annotations

import pandas as pd


def street_names(links: pd.DataFrame) -> pd.Series:
    """The name of every link: its street's, else its road's number, else ``link`` and its id."""
    names = pd.Series(pd.NA, index=links.index, dtype="string")
    for column in ("name", "ref"):
        if column in links:
            given = links[column].astype("string").str.strip()
            names = names.fillna(given.mask(given == ""))
    ids = "link " + links["link_id"].astype("string")
    return names.fillna(ids).astype(str)

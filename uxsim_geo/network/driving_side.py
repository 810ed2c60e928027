"""On which side of the road a country drives.

Left-hand traffic is the rule in 75 countries and territories, as lists of them agree (Wikipedia,
"Left- and right-hand traffic"); they are named here by ISO 3166-1 code. Everywhere else is right.
"""

from __future__ import annotations

from typing import Literal

DrivingSide = Literal["right", "left"]

#: countries and territories that drive on the left, by part of the world
LEFT = frozenset(
    (
        *("CY", "GB", "GG", "IE", "IM", "JE", "MT", "UK"),
        *("BW", "KE", "LS", "MU", "MW", "MZ", "NA", "SC", "SH", "SZ", "TZ", "UG", "ZA", "ZM", "ZW"),
        *("BD", "BN", "BT", "HK", "ID", "IN", "JP", "LK", "MO", "MV", "MY", "NP", "PK", "SG"),
        *("TH", "TL"),
        *("AU", "CC", "CK", "CX", "FJ", "KI", "NF", "NR", "NU", "NZ", "PG", "PN", "SB", "TK"),
        *("TO", "TV", "WS"),
        *("AG", "AI", "BB", "BM", "BS", "DM", "FK", "GD", "GY", "JM", "KN", "KY", "LC", "MS"),
        *("SR", "TC", "TT", "VC", "VG", "VI"),
    )
)


def side_of(country: str) -> DrivingSide:
    """The side driven on in a country, or in the country of a region (``AU-WA``)."""
    return "left" if country.partition("-")[0] in LEFT else "right"

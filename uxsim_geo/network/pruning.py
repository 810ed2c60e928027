"""Links that cannot be driven, or lead nowhere, go."""

from __future__ import annotations

import numpy as np

from uxsim_geo.network.incidence import Flags, without
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import count, numbers


def drop_undrivable(network: Network, classes: tuple[str, ...], notes: Notes) -> Network:
    """Drop links of some road classes, without lanes or speed, and from a node to itself.

    Nodes at which no link is left go too. A link from a node to itself takes nobody anywhere: no
    trip can begin or end on it, and no shortest way uses it.
    """
    links = network.links
    dropped = np.zeros(len(links), dtype=bool)
    for why, wrong in (
        ("of a road class left out", _of_classes(network, classes)),
        ("without a lane or a speed", _standing(network)),
        ("from a node to itself", np.asarray(links["from_node_id"] == links["to_node_id"])),
    ):
        number = int((wrong & ~dropped).sum())
        if number:
            km = float(numbers(links["length"])[wrong & ~dropped].sum()) / 1000.0
            note = f"{count(number, 'link')} {why}: left out; value: km"
            notes.add("undrivable", note, element="link", value=km)
        dropped |= wrong
    return without(network, dropped)


def _of_classes(network: Network, classes: tuple[str, ...]) -> Flags:
    if not classes or "road_class" not in network.links:
        return np.zeros(len(network.links), dtype=bool)
    return np.asarray(network.links["road_class"].isin(classes), dtype=bool)


def _standing(network: Network) -> Flags:
    """Links whose lanes or speed are known to be none; those that lack them are kept."""
    links = network.links
    return (numbers(links["lanes"]) < 1) | (numbers(links["free_speed"]) <= 0)

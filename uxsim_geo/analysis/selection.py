"""Who uses some links or zones: select-link and select-zone analysis."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.bins import numbers_of
from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.subsets import check_links, named_rows, names_of, node_rows
from uxsim_geo.analysis.types import Booleans, Floats, Integers
from uxsim_geo.demand.loading import zone_nodes
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: columns of the trips that say who a user is
WHO = ("vehicle", "origin", "destination", "class", "vehicles", "status", "depart_s", "arrive_s")

USES = ("any", "all")
ENDS = ("origin", "destination", "either")


class UserFlows(NamedTuple):
    """Where some users drive, and from where to where.

    users
        as :func:`users_of_links` or :func:`users_of_zones` gives them
    links
        one row a link, in the order of the links table: link_id, user_entries (vehicles, counted
        at every entry of the whole trip), entries (those of everybody), share (the quotient; NaN
        where nobody entered)
    pairs
        one row a pair that has users, ordered by origin and destination in the order of the nodes
        table: origin, destination, user_vehicles, vehicles (everybody's demand of that pair), share
    """

    users: pd.DataFrame
    links: pd.DataFrame
    pairs: pd.DataFrame


def users_of_links(
    result: Result,
    links: str | Iterable[str],
    *,
    between: tuple[float, float] | None = None,
    use: Literal["any", "all"] = "any",
) -> pd.DataFrame:
    """The trips that entered any (or all) of some links, in the order of the trips.

    ``links`` are link_ids; ``between`` two moments (s): only entries from the first on and before
    the second count. Columns: vehicle (row of the trips), origin, destination, class, vehicles,
    status, depart_s, arrive_s, link and link_enter_s: the first of those links that it entered
    then, and when. No rows if nobody did.

    Raises :class:`uxsim_geo.errors.InputError` if ``links`` is empty or names one that is not
    there, if ``between`` does not ascend, or for another ``use``.
    """
    _check_word(use, USES, "use")
    known = result.log.link_ids
    asked = named_rows(links, known, "links")
    used = result.log.some(
        "vehicle", "link", "enter_s", links=np.isin(np.arange(len(known)), asked)
    )
    events = pd.DataFrame(used)[_inside(used["enter_s"], between)]
    events = events.sort_values(["vehicle", "enter_s"], kind="stable")
    first = events.drop_duplicates("vehicle")
    if use == "all":
        number = events.drop_duplicates(["vehicle", "link"]).groupby("vehicle").size()
        first = first[(number == len(asked)).to_numpy()]
    users = result.trips.loc[first["vehicle"].to_numpy(), list(WHO)].reset_index(drop=True)
    link = pd.Categorical.from_codes(first["link"].to_numpy(), categories=known)
    return users.assign(link=link, link_enter_s=first["enter_s"].to_numpy(float))


def users_of_zones(
    result: Result,
    network: Network,
    zones: str | Iterable[str],
    *,
    end: Literal["origin", "destination", "either"] = "either",
    between: tuple[float, float] | None = None,
) -> pd.DataFrame:
    """The trips that start or end in some zones, in the order of the trips.

    ``end`` says at which end they are to touch them; ``between`` two moments (s) of the wish to
    depart, from the first on and before the second. The nodes of zones are those of
    :func:`uxsim_geo.demand.loading.zone_nodes`; a node that serves several counts for each of
    them. Columns: vehicle, origin, destination, class, vehicles, status, depart_s, arrive_s.

    Raises :class:`uxsim_geo.errors.InputError` if ``zones`` is empty or names one that is not
    there, if ``between`` does not ascend, for another ``end``, or if the result is of another
    network.
    """
    _check_word(end, ENDS, "end")
    ends = ENDS[:2] if end == "either" else (end,)
    nodes = {name: zone_nodes(network, name) for name in ends}
    known = pd.Index(pd.concat([nodes[name][f"{name}_zone"] for name in ends]).unique())
    asked = known[named_rows(zones, known, "zones")]
    touch = np.zeros(len(result.trips), bool)
    for name in ends:
        own = nodes[name].loc[nodes[name][f"{name}_zone"].isin(asked), name]
        inside = network.nodes["node_id"].astype(str).isin(own).to_numpy()
        touch |= inside[node_rows(result, network, name)]
    touch &= _inside(result.trips["depart_s"].to_numpy(float), between)
    return result.trips.loc[touch, list(WHO)].reset_index(drop=True)


def select_link(
    result: Result,
    network: Network,
    links: str | Iterable[str],
    *,
    between: tuple[float, float] | None = None,
    use: Literal["any", "all"] = "any",
) -> UserFlows:
    """Flows on all links, and by pair, of those who use some links.

    Arguments and errors as of :func:`users_of_links`, and an error if the result is of another
    network.
    """
    return flows_of(result, network, users_of_links(result, links, between=between, use=use))


def select_zone(
    result: Result,
    network: Network,
    zones: str | Iterable[str],
    *,
    end: Literal["origin", "destination", "either"] = "either",
    between: tuple[float, float] | None = None,
) -> UserFlows:
    """Flows on all links, and by pair, of those who start or end in some zones.

    Arguments and errors as of :func:`users_of_zones`.
    """
    users = users_of_zones(result, network, zones, end=end, between=between)
    return flows_of(result, network, users)


def flows_of(result: Result, network: Network, users: pd.DataFrame) -> UserFlows:
    """Flows on all links, and by pair, of users: any table with the trips' column vehicle."""
    is_user = np.zeros(len(result.trips), bool)
    is_user[users["vehicle"].to_numpy()] = True
    return UserFlows(
        users, _link_flows(result, network, is_user), _pair_flows(result, network, is_user)
    )


def _link_flows(result: Result, network: Network, is_user: Booleans) -> pd.DataFrame:
    check_links(result, network)
    weight = result.trips["vehicles"].to_numpy(float)
    own, entries = np.zeros((2, len(network.links)))
    for piece in result.log.pieces("vehicle", "link"):
        np.add.at(own, piece["link"], (weight * is_user)[piece["vehicle"]])
        np.add.at(entries, piece["link"], weight[piece["vehicle"]])
    return pd.DataFrame(
        {
            "link_id": network.links["link_id"].astype(str).to_numpy(),
            "user_entries": own,
            "entries": entries,
            "share": ratio(own, entries),
        }
    )


def _pair_flows(result: Result, network: Network, is_user: Booleans) -> pd.DataFrame:
    ends: list[Integers] = [node_rows(result, network, end) for end in ("origin", "destination")]
    groups, weight = Groups.of(*ends), result.trips["vehicles"].to_numpy(float)
    own, everybody = groups.total(weight * is_user), groups.total(weight)
    ids = network.nodes["node_id"]
    table = pd.DataFrame(
        {
            "origin": names_of(groups.keys[0], ids),
            "destination": names_of(groups.keys[1], ids),
            "user_vehicles": own,
            "vehicles": everybody,
            "share": ratio(own, everybody),
        }
    )
    return table[own > 0].reset_index(drop=True)


def _check_word(word: str, known: tuple[str, ...], argument: str) -> None:
    if word not in known:
        faults = Faults()
        faults.add(f"must be {', '.join(known[:-1])} or {known[-1]}", column=argument, value=word)
        faults.raise_if_any()


def _inside(moments: Floats, between: tuple[float, float] | None) -> Booleans:
    """Whether each moment lies from the first of two on and before the second."""
    if between is None:
        return np.ones(len(moments), bool)
    asked = numbers_of(between, "between")
    begin, end = asked if asked.shape == (2,) else (np.nan, np.nan)
    if not begin < end:
        faults = Faults()
        faults.add("must be an earlier and a later moment, s", column="between", value=between)
        faults.raise_if_any()
    inside: Booleans = (moments >= begin) & (moments < end)
    return inside

"""Measures of control in words: what was closed or changed, where and when."""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from pipeline.control_config import MeasureEntry
from pipeline.control_config_flow import (
    ClosureEntry,
    IncidentEntry,
    LinkCapacityEntry,
    MergePriorityEntry,
    NodeCapacityEntry,
    PerimeterEntry,
    RampMeterEntry,
    SignalEntry,
    SpeedLimitEntry,
)
from pipeline.control_config_routes import (
    AdviceEntry,
    CongestionTollEntry,
    EnforcedRouteEntry,
    TollEntry,
)

if TYPE_CHECKING:
    from pipeline.config import Config
    from pipeline.config_keys import ChosenLinks
    from uxsim_geo.export.run_description import Change
    from uxsim_geo.network.network import Network

#: of longer lists of streets, links and nodes only so many are named
NAMED = 3


def changes_of(config: Config, network: Network) -> list[Change]:
    """All measures of a configuration, in the order of its keys."""
    from uxsim_geo.export.run_description import Change

    return [
        Change(_what(entry), _where(entry, network), entry.begin_s, entry.end)
        for _, _, entry in config.simulate.control.entries()
    ]


def _what(entry: MeasureEntry) -> str:
    match entry:
        case IncidentEntry():
            return f"{_count(entry.lanes_closed, 'lane')} blocked"
        case ClosureEntry():
            return f"closed{_to(entry.classes)}"
        case SpeedLimitEntry():
            return f"speed limit of {_values(entry.speed_kmh)} km/h"
        case LinkCapacityEntry() | NodeCapacityEntry():
            return _capacity(entry)
        case RampMeterEntry() | PerimeterEntry():
            return _gate(entry)
        case SignalEntry():
            return f"signal plan of {_count(len(entry.phases), 'phase')}"
        case MergePriorityEntry():
            return f"merge priority {_values(entry.priority)}"
        case TollEntry() | CongestionTollEntry() | AdviceEntry() | EnforcedRouteEntry():
            return _steering(entry)
        case _:
            assert_never(entry)


def _capacity(entry: LinkCapacityEntry | NodeCapacityEntry) -> str:
    """At most so many vehicles an hour."""
    if isinstance(entry, NodeCapacityEntry):
        return f"at most {_values(entry.capacity_veh_per_h)} veh/h may pass"
    rates = {"leave": entry.exit_veh_per_h, "enter": entry.entry_veh_per_h}
    told = [f"{_values(rate)} veh/h may {way}" for way, rate in rates.items() if rate is not None]
    return "at most " + " and ".join(told)


def _gate(entry: RampMeterEntry | PerimeterEntry) -> str:
    if isinstance(entry, RampMeterEntry):
        rate = entry.rate_veh_per_h
        return "metered by density" if rate is None else f"metered to {_values(rate)} veh/h"
    if entry.target_vehicles is None:
        flow = entry.flow_veh_per_h
        return "perimeter" if flow is None else f"perimeter that lets in {_values(flow)} veh/h"
    return f"perimeter that aims at {entry.target_vehicles:g} vehicles inside"


def _steering(entry: TollEntry | CongestionTollEntry | AdviceEntry | EnforcedRouteEntry) -> str:
    match entry:
        case TollEntry():
            return f"toll of {_values(entry.amount)}"
        case CongestionTollEntry():
            return f"toll that follows the density, at most {entry.max_amount:g}"
        case AdviceEntry():
            return f"advice as if each link took {_values(entry.seconds)} s longer"
        case EnforcedRouteEntry():
            return f"given route for {100 * entry.share:g} % of drivers{_to(entry.classes)}"


def _where(entry: MeasureEntry, network: Network) -> str:
    match entry:
        case SignalEntry():
            return f"node {entry.node_id}"
        case NodeCapacityEntry():
            return _listed("node", list(entry.nodes))
        case EnforcedRouteEntry():
            return f"from node {entry.origin} to node {entry.destination}"
        case PerimeterEntry():
            return f"round {_streets(entry.region, network)}"
        case _:
            return _streets(entry, network)


def _streets(chosen: ChosenLinks, network: Network) -> str:
    """Names of streets, and the ids of the links where they are few."""
    from uxsim_geo.network.selection import select_links
    from uxsim_geo.network.street_names import street_names

    links = network.links.iloc[select_links(network, chosen.target())]
    ids = links["link_id"].astype(str).tolist()
    calls = street_names(links)
    named = list(dict.fromkeys(calls[calls != "link " + links["link_id"].astype(str)]))
    if not named:
        return _listed("link", ids)
    inside = _listed("link", ids) if len(ids) <= NAMED else f"{len(ids):,} links"
    return f"{_listed('', named)} ({inside})"


def _listed(kind: str, names: list[str]) -> str:
    """As link a; links a, b; links a, b, c and 9 more."""
    rest = f" and {len(names) - NAMED:,} more" if len(names) > NAMED else ""
    plural = "s" if kind and len(names) > 1 else ""
    return f"{kind}{plural} {', '.join(names[:NAMED])}{rest}".strip()


def _values(timetable: float | tuple[tuple[float, float], ...]) -> str:
    """A number, or the least and the greatest of a timetable."""
    if not isinstance(timetable, tuple):
        return f"{timetable:g}"
    values = [value for _, value in timetable]
    return f"{min(values):g} to {max(values):g}" if min(values) < max(values) else f"{values[0]:g}"


def _to(classes: tuple[str, ...]) -> str:
    return f" to class {', '.join(classes)}" if classes else ""


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"

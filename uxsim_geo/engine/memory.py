"""How much memory a run will take, told before it takes it."""

from __future__ import annotations

from uxsim_geo.demand.platoons import Platoons
from uxsim_geo.engine import records
from uxsim_geo.engine.arrays import Records, Wishes, worth_of_updates
from uxsim_geo.engine.records import LANES
from uxsim_geo.engine.router import Router
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.machine import GB, Machine
from uxsim_geo.settings import Settings

_COLUMNS = 8 * 8  # bytes of a platoon in the tables that describe it
_BYTES_OF_A_WEIGHT = 4
_RING = 8  # places on a link at the start


def check_memory(needs: dict[str, float], machine: Machine) -> None:
    """Raise :class:`InputError` where a run needs more memory than it may have.

    ``needs`` are bytes, by what for.
    """
    total, usable = sum(needs.values()), machine.usable_bytes
    if total <= usable:
        return
    largest = sorted(needs.items(), key=lambda need: -need[1])
    parts = ", ".join(f"{size / GB:.3g} GB for {what}" for what, size in largest)
    what = (
        f"the run needs {total / GB:.3g} GB of memory, and {usable / GB:.3g} GB are free: {parts}; "
        "take fewer destinations (larger zones), a smaller network or larger platoons, or, if it "
        "may have more, say how much by UXSIM_GEO_MEMORY_GB (Machine.memory_gb in Python)"
    )
    raise InputError([Fault(what)])


def memory_needs(
    router: Router, platoons: Platoons, wishes: Wishes, drivers: Records, settings: Settings
) -> dict[str, float]:
    """Foretell what the largest parts of a run take, bytes.

    Not counted: the network's tables, what is the same for all runs, and the events, of which
    nobody knows yet how many there will be.
    """
    paths = router.paths
    vertices, arcs, links = paths.node.size, paths.tail.size, paths.start.size
    destinations = wishes.destinations
    # as many batches of the same drivers as there are at most
    batches = destinations // LANES + min(destinations, drivers.size)
    each = len(worth_of_updates(settings)) or _BYTES_OF_A_WEIGHT
    weights = float(batches) * each * arcs * LANES
    times = 8.0 * links * (int(drivers["rows"].sum()) + drivers.size)
    of_arc = records.ARC.itemsize + records.INCOMING.itemsize + 16
    search = arcs * of_arc + vertices * records.VERTEX.itemsize + 16.0 * (arcs + vertices)
    if router.hierarchy is not None:
        rooms = min(router.threads, batches) * vertices * LANES * 4.0
        search += rooms + 12.0 * router.hierarchy.upper.size + 16.0 * arcs
    of_platoon = records.PLATOON.itemsize + records.TRIP.itemsize + 4 + _COLUMNS
    of_link = records.QUEUE.itemsize + records.ROAD.itemsize + _RING * records.PLATOON.itemsize
    return {
        f"the weights of {arcs:,} ways on for {destinations:,} destinations": weights,
        "the travel times that drivers see": times,
        "the search for routes": search,
        f"{platoons.depart.size:,} platoons": float(platoons.depart.size * of_platoon),
        f"{links:,} links": float(links * of_link),
    }

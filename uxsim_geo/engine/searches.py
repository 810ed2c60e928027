"""What Python calls of the search for routes."""

from __future__ import annotations

from uxsim_geo.engine.detours import find_ways, lead_all_on, lead_lanes_on, strand
from uxsim_geo.engine.elimination import find_parents, list_ways, number_subtrees
from uxsim_geo.engine.free_flow import price_free_flow, time_by_heap, time_lanes
from uxsim_geo.engine.loop import hash_of_sources
from uxsim_geo.engine.records import compiled
from uxsim_geo.engine.routes import renew_lanes, renew_wanted, update_routes
from uxsim_geo.engine.sweep import customise


def _of_updates(sources: str):
    """Give what updates call; like all entry points, it encloses the hash of the sources.

    They are many and small, so that a run compiles only what it needs.
    """

    @compiled
    def update(w, step, most):
        return update_routes(w, step, most) if len(sources) > 0 else -1

    @compiled
    def introduce(w, most):
        return find_ways(w, most) if len(sources) > 0 else -1

    @compiled
    def cost_ways(h, arc):
        return len(sources) > 0 and customise(h, arc)

    @compiled
    def renew(w, h, batch, room):
        return len(sources) > 0 and renew_lanes(w, h, batch, room)

    @compiled
    def renew_rest(w):
        return len(sources) > 0 and renew_wanted(w)

    return update, introduce, cost_ways, renew, renew_rest


def _of_detours(sources: str):
    """Give what closures call."""

    @compiled
    def find_stranded(w, number, avoided):
        return strand(w, number, avoided) if len(sources) > 0 else 0

    @compiled
    def lead(routes, h, room, avoided):
        return len(sources) > 0 and lead_lanes_on(routes, h, room, avoided)

    @compiled
    def lead_rest(routes, avoided):
        return len(sources) > 0 and lead_all_on(routes, avoided)

    return find_stranded, lead, lead_rest


def _of_free_flow(sources: str):
    """Give what the end of a run calls."""

    @compiled
    def price_free(w):
        return len(sources) > 0 and price_free_flow(w)

    @compiled
    def time_free(w, h, room, alike):
        return len(sources) > 0 and time_lanes(w, h, room, alike)

    @compiled
    def time_rest(w, room, alike):
        return len(sources) > 0 and time_by_heap(w, room, alike)

    return price_free, time_free, time_rest


def _of_building(sources: str):
    """Give what the building of a hierarchy calls."""

    @compiled
    def number_below(start, near, parent, room, number):
        find_parents(start, near, parent, room)
        return len(sources) > 0 and number_subtrees(parent, room, number)

    @compiled
    def list_upper(start, near, parent, room, end, upper):
        return len(sources) > 0 and list_ways(start, near, parent, room, end, upper)

    return number_below, list_upper


_SOURCES = hash_of_sources()
update, introduce, cost_ways, renew, renew_rest = _of_updates(_SOURCES)
find_stranded, lead, lead_rest = _of_detours(_SOURCES)
price_free, time_free, time_rest = _of_free_flow(_SOURCES)
number_below, list_upper = _of_building(_SOURCES)

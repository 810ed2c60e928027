"""What Python calls of the search for routes: small functions, a run compiles those it needs."""

from __future__ import annotations

from uxsim_geo.engine.detours import find_ways, lead_all_on, lead_lanes_on, strand
from uxsim_geo.engine.elimination import find_parents, list_ways, number_subtrees
from uxsim_geo.engine.free_flow import price_free_flow, time_by_heap, time_lanes
from uxsim_geo.engine.records import compiled
from uxsim_geo.engine.routes import renew_lanes, renew_wanted, update_routes
from uxsim_geo.engine.sweep import customise

# updates


@compiled
def update(w, step, most):
    """See `update_routes`."""
    return update_routes(w, step, most)


@compiled
def introduce(w, most):
    """See `find_ways`."""
    return find_ways(w, most)


@compiled
def cost_ways(h, arc):
    """See `customise`."""
    return customise(h, arc)


@compiled
def renew(w, h, batch, room):
    """See `renew_lanes`."""
    return renew_lanes(w, h, batch, room)


@compiled
def renew_rest(w):
    """See `renew_wanted`."""
    return renew_wanted(w)


# closures


@compiled
def find_stranded(w, number, avoided):
    """See `strand`."""
    return strand(w, number, avoided)


@compiled
def lead(routes, h, room, avoided):
    """See `lead_lanes_on`."""
    return lead_lanes_on(routes, h, room, avoided)


@compiled
def lead_rest(routes, avoided):
    """See `lead_all_on`."""
    return lead_all_on(routes, avoided)


# the end of a run


@compiled
def price_free(w):
    """See `price_free_flow`."""
    return price_free_flow(w)


@compiled
def time_free(w, h, room, alike):
    """See `time_lanes`."""
    return time_lanes(w, h, room, alike)


@compiled
def time_rest(w, room, alike):
    """See `time_by_heap`."""
    return time_by_heap(w, room, alike)


# the building of a hierarchy


@compiled
def number_below(start, near, parent, room, number):
    """Find the parents of all vertices and number them, see `number_subtrees`."""
    find_parents(start, near, parent, room)
    return number_subtrees(parent, room, number)


@compiled
def list_upper(start, near, parent, room, end, upper):
    """See `list_ways`."""
    return list_ways(start, near, parent, room, end, upper)

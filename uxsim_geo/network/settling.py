"""Junctions merged as far as shortest ways stay what they were."""

from __future__ import annotations

from collections.abc import Callable

from uxsim_geo.network.changed_ways import Seen, junctions_to_leave
from uxsim_geo.network.clusters import JunctionSizes
from uxsim_geo.network.distortion import LENGTH, TIME
from uxsim_geo.network.incidence import Flags
from uxsim_geo.network.junctions import Found, find_junctions, merged_of
from uxsim_geo.network.merged_steps import MergedSteps
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes


def merge_within(
    network: Network, sizes: JunctionSizes, notes: Notes, tell: Callable[[float], None]
) -> Network:
    """Merge junctions, but for those over which ways would change by too much.

    ``tell`` is called with the share done. All lengths and speeds must be known.
    """
    found = find_junctions(network, sizes)
    tell(0.3)
    seen: Seen | None = None
    number = len(found.merged)
    if found.merged:
        steps = MergedSteps.of(found)
        apart, seen = junctions_to_leave(steps, lambda share: tell(0.3 + 0.7 * share))
        found = found.without(_names(found, apart))
    merged = merged_of(found, notes)
    note = "junctions left apart, since ways over them changed too much; value: junctions"
    notes.add("junctions merged", note, element="node", value=number - len(found.merged))
    if seen is not None:
        _note_seen(seen, notes)
    return merged


def _names(found: Found, apart: Flags) -> frozenset[str]:
    """Ids of the nodes of some junctions."""
    left = [one.junction for one, is_apart in zip(found.merged, apart, strict=True) if is_apart]
    ids = found.network.nodes["node_id"].to_numpy()
    return frozenset(ids[sorted({node for one in left for node in one.nodes})])


def _note_seen(seen: Seen, notes: Notes) -> None:
    """Say by how much ways below 1 km have changed at most."""
    for measure, unit in ((LENGTH, "m"), (TIME, "s")):
        most = float(seen.most[measure].max(initial=0.0))
        note = f"{measure} of all ways that are shorter than 1 km: greatest change; value: {unit}"
        notes.add("distortion", note, value=most)

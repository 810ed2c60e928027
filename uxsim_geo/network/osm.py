"""OpenStreetMap files to network tables: the entry point.

The same data give the same network, byte for byte, whatever the file's format and order.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.osm_access import reason_to_drop
from uxsim_geo.network.osm_barriers import closed_nodes, note_barriers
from uxsim_geo.network.osm_defaults import read_defaults
from uxsim_geo.network.osm_file import OsmFile, read_osm_file
from uxsim_geo.network.osm_junctions import junctions_of
from uxsim_geo.network.osm_links import direct, links_table, nodes_table
from uxsim_geo.network.osm_notes import (
    note_assumptions,
    note_file,
    note_missing_nodes,
    note_ways,
    note_whose_defaults,
)
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.osm_relations import places_of
from uxsim_geo.network.osm_sections import cut_ways
from uxsim_geo.network.osm_signals import note_signals, place_signals
from uxsim_geo.network.osm_turns import banned_turns
from uxsim_geo.network.osm_ways import read_ways
from uxsim_geo.network.telling import Telling, silent


def read_osm_network(
    path: Path, options: OsmOptions, *, progress: Telling | None = None
) -> Network:
    """Read the roads of an OpenStreetMap file (.osm, .xml, also .gz or .bz2, or .pbf) into tables.

    ``link_id`` is ``way:from-to``, ``node_id`` the node's own; geometry is in EPSG:4326. Links
    have these columns beside the shared ones: direction (``forward`` or ``backward`` along the
    way's drawing), oneway, ref, junction, layer, bridge, tunnel, access, turn_lanes,
    free_speed_basis (the tag or class that the speed comes from), source_node_ids (all along the
    link, with blanks between). Nodes have highway, barrier (tags), beyond (``other way``: a
    path or another way that is no road here meets the node; ``noexit``: the tag), signal_node_ids
    (whose signals control the junction). Movements have via_link_ids (null, or the links between,
    with blanks), restriction (its kind, or ``barrier``), source_id (the relation, or the node of
    the barrier).

    ``progress`` is called with a word and the share done. Raises
    :class:`uxsim_geo.errors.InputError` for a file or a table of defaults that cannot be used.
    """
    tell = progress or silent
    tell("reading", 0.0)
    defaults = read_defaults(options)
    choose = partial(reason_to_drop, options=options)
    file = read_osm_file(
        path, choose, options.max_unpacked_mb, lambda share: tell("reading", 0.6 * share)
    )
    _check_roads(path, file)
    notes = Notes()
    tell("tags", 0.6)
    ways = read_ways(file.way_tags, options, defaults, lambda share: tell("tags", 0.6 + share / 5))
    tell("links", 0.8)
    closed = closed_nodes(file, options)
    sections = cut_ways(file, np.union1d(places_of(file.restrictions), closed))
    links = direct(file, sections, ways)
    _check_links(path, len(links.ids))
    note_file(file, options, notes)
    note_missing_nodes(file, sections, links, notes)
    note_ways(file, ways, links, notes)
    table = links_table(file, sections, ways, links, options.jam_density)
    note_assumptions(table, options, notes)
    note_whose_defaults(table, options, defaults, notes)
    signals = place_signals(file, sections, ways, options.signal_distance)
    note_signals(file, sections, signals, notes)
    tell("turns", 0.95)
    junctions = junctions_of(file, sections, links)
    note_barriers(file, closed, junctions, notes)
    movements = banned_turns(junctions, closed, notes)
    nodes = nodes_table(file, links, signals.at)
    tell("done", 1.0)
    return Network(nodes, table, movements, notes.table())


def _check_roads(path: Path, file: OsmFile) -> None:
    """Raise where nothing would be left of the network."""
    faults = Faults(str(path))
    reasons = ", ".join(f"{number} ways {why}" for why, number in sorted(file.dropped.items()))
    if not len(file.way_ids):
        faults.add(
            f"has no road of the classes asked for ({reasons or 'no way has the tag highway'})"
        )
    elif not len(file.node_ids):
        faults.add("has none of the nodes that its roads name: it was cut without them")
    faults.raise_if_any()


def _check_links(path: Path, number: int) -> None:
    """Raise where no way has two nodes and a direction open to cars."""
    faults = Faults(str(path))
    if not number:
        faults.add("has no piece of road between two nodes that cars may drive on")
    faults.raise_if_any()

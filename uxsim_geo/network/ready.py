"""From a network as it was read to one that can be simulated: the list of steps.

Every step is optional and leaves notes of what it did. Rows keep their order; the result depends
on the tables alone, not on the order of their rows, on threads or on the machine.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from uxsim_geo.network.distortion import compare, note_distortion, sample_nodes
from uxsim_geo.network.joining import join_links
from uxsim_geo.network.junctions import merge_junctions
from uxsim_geo.network.largest_part import keep_largest_part
from uxsim_geo.network.network import NOTE_COLUMNS, Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.projection import project
from uxsim_geo.network.pruning import drop_undrivable
from uxsim_geo.network.ready_check import check_ids
from uxsim_geo.network.ready_options import ReadyOptions
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.settling import merge_within
from uxsim_geo.network.telling import Telling, silent
from uxsim_geo.network.tight_rings import open_tight_rings
from uxsim_geo.network.u_turns import ban_u_turns

#: seed of the sample by which the result is judged
SEED = 2


def make_ready(
    network: Network, options: ReadyOptions, *, progress: Telling | None = None
) -> Network:
    """Take the steps that ``options`` ask for; their notes stand after those that are there.

    ``progress`` is called with a word and the share done. Raises
    :class:`uxsim_geo.errors.InputError` if ids are missing, not unique or not known.
    """
    check_ids(network)
    tell = progress or silent
    notes = Notes()
    notes.add(
        "driving side", "the side driven on: no step depends on it", value=options.driving_side
    )
    note_short_links(network, options.step, "before", notes)
    tell("projection", 0.0)
    if options.project:
        network = project(network, options.crs, notes)
    tell("largest part", 0.1)
    if options.drop_undrivable:
        network = drop_undrivable(network, options.dropped_classes, notes)
    if options.largest_part:
        network = keep_largest_part(network, notes)
    tell("joining", 0.2)
    if options.join:
        network = join_links(network, options.short_piece, notes)
    whole = network
    known = _speeds_are_known(network, notes)
    tell("junctions", 0.3)
    if options.merge_junctions and known:
        network = merge_within(network, options.junctions, notes, partial(_tell_part, tell))
    elif options.merge_junctions:
        network = merge_junctions(network, options.junctions, notes)
    if options.merge_junctions and options.join:
        network = join_links(network, options.short_piece, notes)
    network = open_tight_rings(network, options.ring_storage, notes)
    tell("turning back", 0.85)
    network = ban_u_turns(network, options.u_turns, notes)
    if options.largest_part:
        network = keep_largest_part(network, notes)
    tell("comparing", 0.9)
    _judge(whole, network, options.sampled_ways if known else 0, notes)
    note_short_links(network, options.step, "after", notes)
    tell("done", 1.0)
    return replace(network, notes=_together(network.notes, notes.table()))


def _tell_part(tell: Telling, share: float) -> None:
    tell("junctions", 0.3 + 0.5 * share)


def _speeds_are_known(network: Network, notes: Notes) -> bool:
    """Whether every link has a length and a speed: without them no way can be measured."""
    time = numbers(network.links["length"]) / numbers(network.links["free_speed"])
    known = bool((np.isfinite(time) & (time > 0)).all())
    if not known:
        notes.add("distortion", "not measured: some links have no length or speed")
    return known


def _judge(before: Network, after: Network, ways: int, notes: Notes) -> None:
    """Compare sampled ways with those before merging."""
    if ways and len(after.nodes):
        sample = sample_nodes(before, after, ways, SEED)
        if not len(sample.nodes):
            notes.add("distortion", "not measured: every node left is a merged junction")
            return
        note_distortion(compare(before, after, sample), notes)


def note_short_links(network: Network, step: float, when: str, notes: Notes) -> None:
    """Say how many links are driven in less than one step (s) at free speed."""
    links = network.links
    short = numbers(links["length"]) < numbers(links["free_speed"]) * step
    note = f"driven in less than {step:g} s, of {len(links)} {when} these steps; value: links"
    notes.add("short links", note, element="link", value=int(short.sum()))


def _together(before: pd.DataFrame, own: pd.DataFrame) -> pd.DataFrame:
    table = pd.concat([before, own], ignore_index=True)
    return table.reindex(columns=list(NOTE_COLUMNS)).astype("str")

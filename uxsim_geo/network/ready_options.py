"""Which steps make a network ready to be simulated, and how far each goes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import get_args

from uxsim_geo.errors import Faults
from uxsim_geo.network.clusters import JunctionSizes
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.u_turns import Where


@dataclass(frozen=True)
class ReadyOptions:
    """Steps, each of which can be left out, and their limits.

    project, crs
        put geometry into metres; into this system, or that of the data's own UTM zone
    drop_undrivable, dropped_classes
        drop links without lanes or speed or from a node to itself, and those of these road classes
    largest_part
        keep the part in which every origin reaches every destination
    join, short_piece
        join links at nodes of degree two; a piece with other lanes or speed that is shorter than
        this (m) becomes a part of its neighbour
    merge_junctions, junctions
        make one node of junctions of several nodes; what is taken for one
    ring_storage
        veh; one-way rings of links that each hold fewer become direct links, see
        :mod:`uxsim_geo.network.tight_rings`; 0: they stay
    u_turns
        where turning back is banned: ``nowhere``, at ``signals``, at all ``junctions``; at
        merged junctions it is open where a way round was there
    driving_side
        recorded: no step depends on it, since no geometry is made of roads with two sides
    sampled_ways
        so many ways, from some nodes to all, are compared before and after merging; 0: none
    step
        s, reaction time times platoon size: links that are driven in less are counted
    """

    project: bool = True
    crs: str | None = None
    drop_undrivable: bool = True
    dropped_classes: tuple[str, ...] = ()
    largest_part: bool = True
    join: bool = True
    short_piece: float = 50.0
    merge_junctions: bool = True
    junctions: JunctionSizes = field(default_factory=JunctionSizes)
    ring_storage: float = 5.0
    u_turns: Where = "signals"
    driving_side: DrivingSide = "right"
    sampled_ways: int = 500_000
    step: float = 5.0

    def __post_init__(self) -> None:
        faults = Faults("options of making ready")
        for name in ("short_piece", "step", "ring_storage"):
            if not 0 <= getattr(self, name) < math.inf:
                what = "must be a finite number, 0 or above"
                faults.add(what, column=name, value=getattr(self, name))
        if self.sampled_ways < 0:
            faults.add("must be 0 or above", column="sampled_ways", value=self.sampled_ways)
        for name, known in (("u_turns", get_args(Where)), ("driving_side", get_args(DrivingSide))):
            if getattr(self, name) not in known:
                what = f"must be one of {', '.join(known)}"
                faults.add(what, column=name, value=getattr(self, name))
        _add_crs_fault(faults, self.crs)
        faults.raise_if_any()


def _add_crs_fault(faults: Faults, crs: str | None) -> None:
    if crs is None:
        return
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        system = CRS.from_user_input(crs)
    except CRSError:
        what = "is not a reference system; write one as EPSG:32632"
        faults.add(what, column="crs", value=crs)
        return
    if not system.is_projected or system.axis_info[0].unit_conversion_factor != 1.0:
        what = "must be a plane system in metres, as EPSG:32632"
        faults.add(what, column="crs", value=crs)

"""From the columns of a net file to links in SI units.

    free speed u   length / free-flow time, or the column speed; moved into [min_speed, max_speed]
    lanes          the column lanes, otherwise max(1, round(capacity / capacity of a lane))
    capacity       kept exactly, veh/s of the whole link; infinite ones are left to the diagram
    length         as in the file; 0 becomes what u covers in the free-flow time, at least in 1 s

Where a capacity is more than the lanes carry at that speed, u κ / (1 + u κ τ) each, lanes and
capacity stay as they are and a note says so: the simulation holds the smaller of the two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.network.check import PLACEHOLDER
from uxsim_geo.network.diagram import diagram_capacity
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.placeholders import is_copy
from uxsim_geo.network.rows import is_among, whole_where_possible
from uxsim_geo.network.tntp_net import ENDS, NetFile
from uxsim_geo.network.tntp_options import TntpOptions
from uxsim_geo.network.units import KMH, PER_HOUR, Quantity, Unit

#: s, for the note on capacities above those of the diagram; the simulation has its own τ
REACTION_TIME = 1.0

#: a speed beyond a limit by this factor cannot have been meant: rounded times are off by less
IMPLAUSIBLE = 1.5


@dataclass(frozen=True)
class Conversion:
    """What every step of the conversion needs: the file, the options, the notes.

    connectors: a boolean, one a row of the file: whether the link stands for a zone's streets
    """

    net: NetFile
    options: TntpOptions
    notes: Notes
    connectors: np.ndarray

    @property
    def table(self) -> pd.DataFrame:
        """The file's rows."""
        return self.net.table

    def si(self, column: str, quantity: Quantity) -> np.ndarray:
        """The column in SI units, per lane where the file's unit is."""
        values = np.asarray(self.table[column], dtype=np.float64)
        return values * self.unit(quantity).factor

    def unit(self, quantity: Quantity) -> Unit:
        """The unit stated; reading has made sure of it."""
        unit = self.options.unit(quantity)
        assert unit is not None, f"{quantity}_unit was checked on reading"
        return unit


def links_table(
    net: NetFile, options: TntpOptions, notes: Notes, centroids: pd.Index
) -> pd.DataFrame:
    """Links in SI units, without geometry, of a net file read without faults.

    The file's own columns follow the shared ones under ``tntp_`` and their name, unconverted.
    """
    table = net.table
    connectors = is_among(table["from_node_id"], centroids)
    connectors |= is_among(table["to_node_id"], centroids)
    known = Conversion(net, options, notes, connectors)
    link_id = table["from_node_id"] + "-" + table["to_node_id"]
    speed, speed_source = _free_speed(known, link_id)
    length = _length(known, speed, link_id)
    lanes, lanes_source = _lanes(known)
    capacity = _capacity(known, lanes)
    links = pd.DataFrame(
        {
            "link_id": link_id,
            "from_node_id": table["from_node_id"],
            "to_node_id": table["to_node_id"],
            "length": length,
            "lanes": whole_where_possible(lanes),
            "free_speed": speed,
            "jam_density": options.jam_density,
            "capacity": capacity,
            "merge_priority": np.where(np.isnan(lanes), 1.0, lanes),
            "road_class": table.get("link_type"),
            "name": None,
            "source_id": (table.index + 1).astype("str"),
            "lanes_source": lanes_source,
            "free_speed_source": speed_source,
        }
    )
    text = ["road_class", "name", "source_id", "lanes_source", "free_speed_source"]
    links[text] = links[text].astype("str")
    _note_capacity_above_diagram(links, notes)
    own = [name for name in table if name not in (*ENDS, "line")]
    return links.join(table[own].add_prefix("tntp_"))


def _free_speed(known: Conversion, link_id: pd.Series) -> tuple[np.ndarray, np.ndarray]:
    """Free speed (m/s; NaN where it cannot be known) and its source, given or assumed."""
    options, notes = known.options, known.notes
    if _speed_is_unknown(known):
        return np.full(len(link_id), np.nan), np.full(len(link_id), None, dtype=object)
    if options.free_speed_from == "time":
        found, assumed = _speed_from_time(known)
    else:
        found = known.si("speed", "speed")
        assumed = np.zeros(len(found), dtype=bool)
        ids = list(link_id[found == 0])
        notes.add_each("no free speed", "the file says speed 0: left empty", ids)
        found = np.where(found == 0, np.nan, found)
    speed = np.clip(found, options.min_speed, options.max_speed)
    timeless = np.isinf(found) & ~known.connectors
    note = "the file says free-flow time 0: a free speed (value, m/s) assumed"
    ids, values = list(link_id[timeless]), speed[timeless].tolist()
    notes.warn_each("no free-flow time", note, ids, values)
    moved = (speed != found) & ~np.isnan(found)
    _note_clipped(known, link_id, found, moved & np.isfinite(found))
    source = np.where(moved | assumed, "assumed", "given").astype(object)
    source[np.isnan(speed)] = None
    return speed, source


def _note_clipped(
    known: Conversion, link_id: pd.Series, found: np.ndarray, moved: np.ndarray
) -> None:
    """Tell of speeds that were moved into the limits; warn where they cannot have been meant."""
    options, notes = known.options, known.notes
    note = (
        "free speed (value, km/h) moved into "
        f"{options.min_speed * KMH:g} to {options.max_speed * KMH:g} km/h"
    )
    far = (found > IMPLAUSIBLE * options.max_speed) | (found < options.min_speed / IMPLAUSIBLE)
    speed_kmh = found * KMH
    far_off, near = list(link_id[moved & far]), list(link_id[moved & ~far])
    why = f"{note}: look at its length and free-flow time, or their units"
    notes.warn_each("free speed implausible", why, far_off, speed_kmh[moved & far].tolist())
    notes.add_each("free speed clipped", note, near, values=speed_kmh[moved & ~far].tolist())


def _speed_from_time(known: Conversion) -> tuple[np.ndarray, np.ndarray]:
    """Length / time, and where the typical speed stands for it, since the length is 0."""
    length = known.si("length", "length")
    with np.errstate(divide="ignore", invalid="ignore"):
        found = length / known.si("free_flow_time", "time")
    none = length == 0
    return np.where(none, _typical_speed(found, known.options), found), none


def _speed_is_unknown(known: Conversion) -> bool:
    """Whether the column that free speed is made of is a placeholder; says so."""
    table, notes = known.table, known.notes
    column = "speed" if known.options.free_speed_from == "speed" else "free_flow_time"
    none = column in known.net.placeholders
    if column == "free_flow_time" and is_copy(table["length"], table[column]):
        notes.add(
            "length copied",
            f"length and free_flow_time are the same number on all {len(table)} links: "
            "lengths are what length_unit makes of them",
            element="link",
            severity="warning",
        )
        note = "all links have the same free speed, since length copies free_flow_time"
        notes.add("free speeds equal", note, element="link")
    if none:
        first = table[column].iloc[: 6 if table[column].nunique() > 1 else 1]
        sample = ", ".join(f"{value:g}" for value in first)
        notes.add(
            PLACEHOLDER,
            f"the file's {column} was not measured ({sample} on and on, {len(table)} links)",
            element="link",
            severity="warning",
            value="free_speed",
        )
    return none


def _typical_speed(speed: np.ndarray, options: TntpOptions) -> float:
    """The median of the speeds above 0, m/s, within the limits; max_speed if there is none."""
    known = speed[speed > 0]
    typical = float(np.median(known)) if len(known) else options.max_speed
    return min(max(typical, options.min_speed), options.max_speed)


def _length(known: Conversion, speed: np.ndarray, link_id: pd.Series) -> np.ndarray:
    """Length, m; where the file says 0, what the free speed covers in the time it says."""
    length = known.si("length", "length")
    none = length == 0
    if not none.any():
        return length
    seconds = np.ones(len(length))
    timed = known.options.free_speed_from == "time" and not np.isnan(speed).all()
    if timed:
        seconds = np.maximum(seconds, known.si("free_flow_time", "time"))
    covered = np.where(np.isnan(speed), known.options.max_speed, speed) * seconds
    note = "the file says length 0: a length (value, m) assumed"
    ids, values = list(link_id[none]), covered[none].tolist()
    known.notes.warn_each("length assumed", note, ids, values)
    return np.where(none, covered, length)


def infinite_capacity(table: pd.DataFrame, options: TntpOptions) -> np.ndarray:
    """Where the file's capacity is so large that it means no limit."""
    if "capacity" not in table:
        return np.zeros(len(table), dtype=bool)
    return np.asarray(table["capacity"] >= options.infinite_capacity)


def _lanes(known: Conversion) -> tuple[np.ndarray, np.ndarray]:
    """Lanes (float64, NaN where they cannot be known) and their source, given or assumed."""
    table, options = known.table, known.options
    if "lanes" in table:
        return np.asarray(table["lanes"], dtype=np.float64), np.full(len(table), "given")
    source = np.full(len(table), "assumed", dtype=object)
    if options.capacity == "diagram":
        known.notes.add("lanes assumed", "one lane on every link", element="link")
        return np.ones(len(table)), source
    if "capacity" in known.net.placeholders:
        return np.full(len(table), np.nan), np.full(len(table), None, dtype=object)
    per_hour = known.si("capacity", "capacity") * PER_HOUR
    lanes = np.maximum(1.0, np.rint(per_hour / options.lane_capacity))
    infinite = infinite_capacity(table, options)
    widest = lanes[~infinite].max(initial=1.0)
    lanes[infinite] = widest
    note = f"one for every {options.lane_capacity:g} veh/h of capacity, at least 1"
    if infinite.any():
        note += f"; links of infinite capacity have {widest:g}, as the widest other link"
    known.notes.add("lanes assumed", note, element="link")
    return lanes, source


def _capacity(known: Conversion, lanes: np.ndarray) -> np.ndarray:
    """Capacity of the whole link, veh/s; NaN where it is left to the diagram."""
    table, options, notes = known.table, known.options, known.notes
    if options.capacity == "diagram":
        return np.full(len(table), np.nan)
    if "capacity" in known.net.placeholders:
        notes.add(
            PLACEHOLDER,
            f"the file's capacity was not measured ({table['capacity'].iloc[0]:g} on all "
            f"{len(table)} links); or set capacity: diagram",
            element="link",
            severity="warning",
            value="lanes",
        )
        return np.full(len(table), np.nan)
    capacity = known.si("capacity", "capacity")
    if known.unit("capacity").per_lane:
        capacity = capacity * lanes
    infinite = infinite_capacity(table, options)
    if infinite.any():
        note = f"{options.infinite_capacity:g} and more means no limit: left empty; value: links"
        notes.add("infinite capacity", note, element="link", value=int(infinite.sum()))
    return np.where(infinite, np.nan, capacity)


def _note_capacity_above_diagram(links: pd.DataFrame, notes: Notes) -> None:
    carried = diagram_capacity(links, REACTION_TIME)
    above = int((links["capacity"] > carried * (1.0 + 1e-9)).sum())
    if above:
        notes.add(
            "capacity above diagram",
            f"links whose lanes carry less at their free speed (reaction time {REACTION_TIME:g} s) "
            "than the file's capacity: the smaller holds; value: links",
            element="link",
            value=above,
        )

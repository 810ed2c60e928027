"""Every layer and column of ``results.gpkg`` in words: the one place that says what they mean.

The file's own descriptions (``gpkg_data_columns``), the forms of QGIS and the page of the results
are made from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

NEVER = "never"
NOBODY = "nobody was on the link"
NOBODY_LEFT = "nobody left"


class Column(NamedTuple):
    """A column: name, what a reader calls it, unit, meaning, and where it is empty."""

    name: str
    title: str
    unit: str
    what: str
    empty: str = NEVER


@dataclass(frozen=True)
class Layer:
    """A layer: its title, what a row is, and its columns in their order."""

    title: str
    what: str
    columns: tuple[Column, ...]

    def column(self, name: str) -> Column:
        """The column of that name; raises KeyError if there is none."""
        return {column.name: column for column in self.columns}[name]


def titled(column: Column) -> str:
    """What a reader calls it, with its unit if it has one: ``flow (veh/h)``."""
    has_unit = column.unit not in ("text", "boolean", "–")
    return f"{column.title} ({column.unit})" if has_unit else column.title


NODES = Layer(
    "Nodes",
    "Points: the nodes of the network.",
    (
        Column("node_id", "node", "text", "the source's id"),
        Column(
            "zone_id",
            "zone",
            "text",
            "the zone whose trips start and end here",
            "where the node is no zone",
        ),
        Column("control", "control", "text", "`none` or `signal`"),
        Column(
            "through_traffic",
            "through traffic",
            "boolean",
            "whether routes may lead through the node",
        ),
    ),
)

LINK = (
    Column("link_id", "link", "text", "id of the link; in TNTP from-to, as `12-7`"),
    Column("from_node_id", "from node", "text", "where it begins"),
    Column("to_node_id", "to node", "text", "where it ends"),
    Column("name", "name", "text", "as in the source", "where the source has none"),
    Column("ref", "road number", "text", "as `B 37`", "where the source has none"),
    Column("road_class", "road class", "text", "as in the source", "where the source has none"),
    Column("length_m", "length", "m", "length that vehicles drive; the drawn line may differ"),
    Column("lanes", "lanes", "–", "lanes of this direction"),
    Column(
        "free_speed_kmh",
        "free speed",
        "km/h",
        "speed without hindrance and without control: no speed limit that the run set changes it",
    ),
    Column(
        "jam_density_vpkm_per_lane",
        "jam density of a lane",
        "veh/km of a lane",
        "density of standing traffic",
    ),
)

EFFECTIVE_CAPACITY = Column(
    "effective_capacity_vph",
    "effective capacity",
    "veh/h, all lanes",
    "the capacity that holds: the lower of the given one and that of the diagram, "
    "m·u·κ/(1 + u·τ·κ)",
    "for files made in Python without `reaction_time_s` in their information",
)

LINKS = Layer(
    "Links, whole run",
    "Lines: the directed links, with the figures of the whole run.",
    (
        *LINK,
        Column(
            "capacity_vph",
            "given capacity",
            "veh/h, all lanes",
            "capacity given in the source or the overrides",
            "where none was given",
        ),
        EFFECTIVE_CAPACITY,
        Column("merge_priority", "merge priority", "–", "weight among links into the same node"),
        Column("lanes_source", "source of lanes", "text", "`given`, or how it was found instead"),
        Column(
            "free_speed_source", "source of speed", "text", "`given`, or how it was found instead"
        ),
        Column(
            "source_id",
            "id in the source",
            "text",
            "the link's own id or row in the source",
            "where the source has none",
        ),
        Column("volume_veh", "volume", "veh", "vehicles that entered in the run"),
        Column(
            "speed_kmh", "speed", "km/h", "distance driven / time spent, of all vehicles", NOBODY
        ),
        Column("speed_ratio", "speed / free speed", "–", "1 is free, 0 standing", NOBODY),
        Column(
            "experienced_travel_time_s",
            "experienced travel time",
            "s",
            "mean time on the link of those who left it",
            NOBODY_LEFT,
        ),
        Column(
            "delay_s",
            "mean delay",
            "s a vehicle",
            "`experienced_travel_time_s` less length / free speed: mean of those who left",
            NOBODY_LEFT,
        ),
        Column(
            "delay_veh_s",
            "total delay",
            "veh·s",
            "time lost by all vehicles, also by those still there: time spent less distance "
            "driven / free speed; what a speed limit costs is in it",
        ),
        Column(
            "queue_veh",
            "longest queue",
            "veh",
            "queue: vehicles behind where they would be at free speed, or at the limit under "
            "which they entered; the largest at the end of a time bin",
        ),
        Column(
            "queue_m",
            "length of longest queue",
            "m",
            "from the tail of the queue to the end of the link; the largest at the end of a "
            "time bin",
        ),
        Column(
            "spillback_share",
            "share of time full",
            "–",
            "part of the run in which nobody could enter because there was no room on the link, "
            "0 to 1",
        ),
        Column(
            "volume_to_capacity",
            "volume / capacity",
            "–",
            "mean flow / `effective_capacity_vph`",
        ),
    ),
)

BIN = (
    Column(
        "begin",
        "from",
        "UTC",
        "begin of the bin, on the clock that shows `report.start` at second 0",
    ),
    Column(
        "end",
        "to",
        "UTC",
        "its end, one second before the next `begin`, so that a map shows one bin at a time; of a "
        "bin of one second or less its `begin`",
    ),
)

STATES = (
    Column("flow_vph", "flow", "veh/h", "distance driven / (length × bin)"),
    Column("density_vpkm", "density", "veh/km, all lanes", "time spent / (length × bin)"),
    Column("entries_veh", "entered", "veh", "vehicles that entered in the bin"),
    Column("exits_veh", "left", "veh", "vehicles that left in the bin"),
    Column("speed_kmh", "speed", "km/h", "distance driven / time spent", NOBODY),
    Column("speed_ratio", "speed / free speed", "–", "1 is free, 0 standing", NOBODY),
    Column(
        "experienced_travel_time_s",
        "experienced travel time",
        "s",
        "mean time on the link, since they entered, of those who left in the bin",
        NOBODY_LEFT,
    ),
    Column(
        "delay_s",
        "mean delay",
        "s a vehicle",
        "`experienced_travel_time_s` less length / free speed; it comes when they leave, not "
        "when the time is lost",
        NOBODY_LEFT,
    ),
    Column("delay_veh_s", "total delay", "veh·s", "time lost in the bin by all on the link"),
    Column("queue_veh", "queue", "veh", "the queue at the end of the bin"),
    Column("queue_m", "length of queue", "m", "from the tail of that queue to the end of the link"),
    Column(
        "spillback_share",
        "share of time full",
        "–",
        "part of the bin in which nobody could enter because there was no room on the link, 0 to 1",
    ),
    Column("volume_to_capacity", "flow / capacity", "–", "flow / effective capacity"),
    Column(
        "instantaneous_travel_time_s",
        "travel time at this speed",
        "s",
        "length / speed in the bin; at free speed where nobody was",
    ),
)

LINK_TIMES = Layer(
    "Links by time",
    "A table, one row a link and time bin (`report.bin_s`; the last bin may be shorter). Flow, "
    "density and speed are Edie's: over the whole link and bin, not at a cross-section.",
    (LINK[0], *BIN, *STATES),
)

LINK_STATES = Layer(
    "Links in time",
    "Lines: `link_times` joined to `links`, for the Temporal Controller. A view, so it takes no "
    "room.",
    (*LINK, EFFECTIVE_CAPACITY, *BIN, *STATES),
)

OD_LINES = Layer(
    "Desire lines",
    "Straight lines from where trips start to where they end, with all who wanted to go there. "
    "Ends are those of `report.html`: the network's zones, up to 400; else nodes, up to 150; else "
    "squares of the map, as small as leaves 60, A1 in the south-west. Each lies at the mean place "
    "of those who start or end there (`uxsim-geo export --table od` has the pairs of nodes). Trips "
    "within one end have a row without a line.",
    (
        Column("origin", "from", "text", "zone_id, node_id or name of the square"),
        Column("destination", "to", "text", "zone_id, node_id or name of the square"),
        Column(
            "cell_m", "size of squares", "m", "length of a square's side", "where ends are none"
        ),
        Column("beeline_m", "beeline", "m", "from end to end, straight", "without a CRS"),
        Column("demanded_veh", "demanded", "veh", "vehicles that wanted to go"),
        Column("departed_veh", "departed", "veh", "those whose wish fell into the run"),
        Column("completed_veh", "arrived", "veh", "those who arrived"),
        Column("unfinished_veh", "unfinished", "veh", "those who wait or drive at the end"),
        Column("aborted_veh", "aborted", "veh", "those who found no way"),
        Column(
            "travel_time_s",
            "travel time so far",
            "s a vehicle",
            "experienced, mean of the departed; of the unfinished up to the end",
            "nobody departed",
        ),
        Column(
            "delay_s",
            "delay so far",
            "s a vehicle",
            "that time less the one at free flow, mean of the departed",
            "nobody departed",
        ),
        Column("delay_veh_s", "total delay so far", "veh·s", "its sum over the departed"),
    ),
)

TRAJECTORIES = Layer(
    "Trajectories",
    "Lines with four coordinates: the ways of a sample of vehicles (`report.trajectories`), "
    "spread evenly over all that drove. x and y are the map's, z is the time in seconds after the "
    "start, m the same as Unix time (s since 1970 UTC). To within two metres at the ends of "
    "links and at every `step_s`, with even speed between.",
    (
        Column("vehicle", "trip", "–", "row of the trips, from 0, as in `--table trips`"),
        Column("origin", "from", "text", "node_id"),
        Column("destination", "to", "text", "node_id"),
        Column("class", "class", "text", "of drivers; `default` where there are none"),
        Column("vehicles_veh", "vehicles", "veh", "vehicles in the platoon that drives this way"),
        Column("status", "status", "text", "`completed`, `running` or `aborted`"),
        Column("begin", "from", "UTC", "when it entered the network"),
        Column("end", "to", "UTC", "when it arrived or was aborted; else the end of the run"),
        Column("distance_m", "distance", "m", "driven so far"),
        Column("travel_time_s", "travel time so far", "s", "since the wish to depart"),
        Column("delay_s", "delay so far", "s", "that time less the one at free flow"),
        Column(
            "speed_kmh", "mean speed", "km/h", "distance / time in the network", "it took no time"
        ),
    ),
)

IMPORT_NOTES = Layer(
    "Import notes",
    "Points: what was assumed or repaired on import, and what looks doubtful. A note stands at its "
    "node or at the middle of its link, also where a later step joined or dropped that; notes "
    "about many elements, and about demand, have no geometry. `import_notes.html` of the run "
    "shows the same on a page.",
    (
        Column("element", "element", "text", "what it is about: `link`, `node`, ..."),
        Column("element_id", "id", "text", "which of them", "where it is about many"),
        Column("topic", "topic", "text", "a short word"),
        Column(
            "severity",
            "severity",
            "text",
            "`info`, `warning`, or `doubt` of what looks wrong and was not changed",
        ),
        Column("note", "note", "text", "a sentence, with the figure in question and its unit"),
        Column("value", "value", "text", "the figure alone", "where there is none"),
    ),
)

RUN_INFO = Layer(
    "About the run",
    "A table: settings, version and figures of the run.",
    (
        Column("item", "item", "text", "name"),
        Column("value", "value", "text", "value"),
    ),
)

#: by the name in the file, in the order in which a reader meets them
LAYERS = {
    "nodes": NODES,
    "links": LINKS,
    "link_times": LINK_TIMES,
    "link_states": LINK_STATES,
    "od_lines": OD_LINES,
    "trajectories": TRAJECTORIES,
    "import_notes": IMPORT_NOTES,
    "run_info": RUN_INFO,
}

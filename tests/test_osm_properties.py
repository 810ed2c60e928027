"""Whatever stands in tags and wherever nodes lie: what the reader makes of it makes sense."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from osm_files import node, read, way

from uxsim_geo.network.osm_defaults import read_defaults
from uxsim_geo.network.osm_lanes import lanes_of
from uxsim_geo.network.osm_oneway import directions
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.osm_speeds import FASTEST, SLOWEST, free_speeds
from uxsim_geo.network.osm_tags import Remark

DEFAULTS = read_defaults(OsmOptions())

WORDS = st.sampled_from(
    [
        *("0", "1", "2", "3", "4", "5", "2.5", "12", "30", "99", "-1", "1e9", ";", "|", ":"),
        *("yes", "no", "mph", "km/h", "knots", "DE", "GB", "urban", "zone", "none", "walk"),
    ]
)
TEXTS = st.one_of(st.text(max_size=8), st.lists(WORDS, max_size=4).map("".join))
KEYS = st.sampled_from(
    [
        *("lanes", "lanes:forward", "lanes:backward", "lanes:both_ways", "turn:lanes:forward"),
        *("maxspeed", "maxspeed:forward", "maxspeed:backward", "maxspeed:type", "zone:maxspeed"),
        *("oneway", "junction", "motor_vehicle", "motor_vehicle:backward", "access"),
    ]
)
COUNTS = st.integers(0, 12).map(str)


@given(st.dictionaries(KEYS, TEXTS))
def test_any_tags_give_lanes_and_speeds_of_both_directions(tags: dict[str, str]) -> None:
    tags["highway"] = "residential"
    remarks: list[Remark] = []
    open_to = directions(tags, False, remarks)
    for lanes in lanes_of(tags, open_to, 1, remarks):
        assert 1 <= lanes.count <= 20
        assert lanes.source in ("given", "assumed")
    for speed in free_speeds(tags, "default", DEFAULTS, remarks):
        assert SLOWEST <= speed.value <= FASTEST
        assert speed.source in ("given", "assumed")


@given(
    st.dictionaries(
        st.sampled_from(["lanes", "lanes:forward", "lanes:backward", "lanes:both_ways"]), COUNTS
    )
)
def test_lanes_are_never_counted_twice(tags: dict[str, str]) -> None:
    """Both directions together have no more than the total, or a remark says so."""
    tags["highway"] = "residential"
    remarks: list[Remark] = []
    forward, backward = lanes_of(tags, directions(tags, False, remarks), 1, remarks)
    total = int(tags.get("lanes", "99"))
    topics = {remark.topic for remark in remarks}
    if "lanes" in tags and not topics & {"contradictory lanes", "shared lane"}:
        assert forward.count + backward.count + int(tags.get("lanes:both_ways", "0")) <= max(
            total, 2
        )


# streets over nodes on a grid, that meet, cross themselves and turn back as it happens

WAYS = st.lists(st.lists(st.integers(1, 9), min_size=2, max_size=7), min_size=1, max_size=5)
NODES = [node(number, number % 3, number // 3) for number in range(1, 10)]


@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(streets=WAYS)
def test_links_cover_every_piece_of_every_street_once_each_way(
    tmp_path: Path, streets: list[list[int]]
) -> None:
    pieces: Counter[tuple[int, int, int]] = Counter()
    for number, nodes in enumerate(streets, start=1):
        kept = [pair for pair in pairwise(nodes) if pair[0] != pair[1]]
        pieces.update((number, *pair) for pair in kept)
        pieces.update((number, *reversed(pair)) for pair in kept)
    if not pieces:
        return
    ways = [way(number, nodes) for number, nodes in enumerate(streets, start=1)]
    links = read(tmp_path, *NODES, *ways).links
    assert links["link_id"].is_unique
    found: Counter[tuple[int, int, int]] = Counter()
    for source, along in links[["source_id", "source_node_ids"]].values:
        found.update((int(source), *pair) for pair in pairwise(map(int, along.split())))
    assert found == pieces
    inner = {n for along in links["source_node_ids"] for n in along.split()[1:-1]}
    assert inner.isdisjoint({*links["from_node_id"], *links["to_node_id"]})

"""TNTP networks: what the files mean, worked out by hand on networks of a few links."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tntp_files import HEADER, net, row, write

from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, Network
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

UNITS = TntpOptions(length_unit="km", time_unit="min", capacity_unit="veh/h")


def read(folder: Path, text: str, options: TntpOptions = UNITS, **files: Path) -> Network:
    return read_tntp_network(write(folder, "net.tntp", text), options, **files)


#: what scripts rely on; a change here breaks theirs
NODE_NAMES = "node_id zone_id control through_traffic"
LINK_NAMES = (
    "link_id from_node_id to_node_id length lanes free_speed jam_density capacity merge_priority "
    "road_class name source_id lanes_source free_speed_source"
)


def topics(network: Network) -> dict[str, str]:
    return dict(zip(network.notes["topic"], network.notes["value"], strict=True))


def test_units_speed_lanes_and_capacity_by_hand(tmp_path: Path) -> None:
    rows = [row(1, 2, 5400, 2, 2), row(2, 1, 4800, 1, 1.2), row(2, 3, 4500, 0.5, 1)]
    network = read(tmp_path, net(rows, zones=3))
    links = network.links
    assert tuple(links.columns[:14]) == LINK_COLUMNS == tuple(LINK_NAMES.split())
    assert tuple(network.nodes.columns[:4]) == NODE_COLUMNS == tuple(NODE_NAMES.split())
    assert list(links["link_id"]) == ["1-2", "2-1", "2-3"]
    assert links["length"].tolist() == [2000.0, 1000.0, 500.0]
    assert links["free_speed"].to_numpy() == pytest.approx([1000 / 60, 1000 / 72, 500 / 60])
    assert links["lanes"].tolist() == [3, 3, 2]  # 2.67 rounds up, 2.5 to the even 2
    assert links["capacity"].to_numpy() == pytest.approx([1.5, 4 / 3, 1.25], rel=1e-15)
    assert set(links["free_speed_source"]) == {"given"}
    assert set(links["lanes_source"]) == {"assumed"}
    assert links["tntp_power"].tolist() == [4.0, 4.0, 4.0]
    check_network(network)


@pytest.mark.parametrize(
    ("unit", "seconds"), [("min", 60.0), ("s", 1.0), ("0.01 h", 36.0), ("3 s", 3.0)]
)
def test_time_units_may_be_multiples(tmp_path: Path, unit: str, seconds: float) -> None:
    options = replace(UNITS, time_unit=unit, length_unit="m")
    network = read(tmp_path, net([row(1, 2, 1800, 600, 1)]), options)
    expected = np.clip(600 / seconds, 3, 40)
    assert network.links["free_speed"].iloc[0] == pytest.approx(expected)


def test_speeds_outside_the_limits_are_clipped_and_told(tmp_path: Path) -> None:
    rows = [row(1, 2, time=0.1), row(2, 3, time=100), row(2, 1, time=0.4), row(3, 1)]
    network = read(tmp_path, net(rows))
    assert network.links["free_speed"].tolist() == [40.0, 3.0, 40.0, pytest.approx(1000 / 60)]
    assert list(network.links["free_speed_source"]) == [*["assumed"] * 3, "given"]
    told = network.notes.set_index("element_id").loc[["1-2", "2-3", "2-1"]]
    # 1 km in 6 s, in 100 min, and in 24 s, which is near the limit
    assert [float(value) for value in told["value"]] == pytest.approx([600, 0.6, 150])
    assert list(told["severity"]) == ["warning", "warning", "info"]
    assert list(told["topic"]) == [*["free speed implausible"] * 2, "free speed clipped"]
    assert all("(value, km/h) moved into 10.8 to 144 km/h" in note for note in told["note"])


def test_zero_length_becomes_what_a_typical_speed_covers(tmp_path: Path) -> None:
    rows = [row(1, 2, length=0, time=2), row(2, 3, length=0, time=0), row(3, 1, length=1.2)]
    network = read(tmp_path, net(rows))
    assert network.links["free_speed"].tolist() == [20.0, 20.0, 20.0]
    assert network.links["length"].tolist() == [2400.0, 20.0, 1200.0]
    check_network(network)


def test_columns_are_bound_by_name_and_others_kept(tmp_path: Path) -> None:
    header = "~ \tterm_node\tinit_node\tlanes\tfree_flow_time\tlength \tcapacity\tsurface\t;"
    rows = ["\t2\t1\t3\t1\t1\t1000\tgravel\t;", "\t1\t2\t2\t1\t1\t800\tasphalt\t;"]
    options = replace(UNITS, capacity_unit="veh/h/lane")
    text = net(rows, header=header)
    network = read(tmp_path, text, options)
    assert list(network.links["link_id"]) == ["1-2", "2-1"]
    assert network.links["lanes"].tolist() == [3, 2]
    assert network.links["capacity"].to_numpy() == pytest.approx([3000 / 3600, 1600 / 3600])
    assert list(network.links["tntp_surface"]) == ["gravel", "asphalt"]
    assert set(network.links["lanes_source"]) == {"given"}


def variants() -> dict[str, str]:
    plain = net([row(1, 2), row(2, 3, 3600, 2, 2), row(3, 1)])
    head, _, body = plain.partition(HEADER)
    values = [line.strip("\t;").split("\t") for line in body.strip().split("\n")]
    return {
        "windows line ends": plain.replace("\n", "\r\n"),
        "byte-order mark": "\ufeff" + plain,
        "tags followed by tabs": plain.replace("> 1\n", ">\t\t\t1\t\t\t\n"),
        "values after spaces and tabs": plain.replace("> ", ">  \t "),
        "text after the end of metadata": plain.replace("METADATA>", "METADATA>~\tInit node\t;\t."),
        "blank lines of tabs": plain.replace("METADATA>\n", "METADATA>\n\t\t\n \t\n\n\n"),
        "no leading tab": plain.replace("\n\t", "\n"),
        "padded fields": plain.replace("\n\t", "\n \t").replace("\t4\t", "  \t  4.000 \t "),
        "semicolon glued": plain.replace("\t1\t;\n", "\t1;\n"),
        "no semicolon": head + HEADER + body.replace(";", ""),
        "trailing blank": plain.replace("\t;\n", "\t; \n"),
        "set apart by blanks": head + HEADER + "\n" + "\n".join(map(" ".join, values)) + "\n",
        "scientific notation": plain.replace("3600", "3.60000e+003").replace("0.15", "1.5E-1"),
        "header lacks its last names": plain.replace("\ttoll\tlink_type\t;", "\ttoll \t\t;"),
        "comments between rows": plain.replace("\n\t2", "\n~ a comment; with\ttabs\n\t2"),
        "no first thru node": plain.replace("<FIRST THRU NODE> 1\n", ""),
        "unknown tag": '<SCENARIO> "Build"\n' + plain,
        "no newline at the end": plain.rstrip("\n"),
    }


@pytest.mark.parametrize("name", variants())
def test_every_way_of_writing_gives_the_same_network(tmp_path: Path, name: str) -> None:
    columns = ["link_id", "length", "free_speed", "lanes", "capacity", "tntp_b", "tntp_power"]
    expected = read(tmp_path, net([row(1, 2), row(2, 3, 3600, 2, 2), row(3, 1)])).links[columns]
    found = read(tmp_path, variants()[name]).links[columns]
    assert found.equals(expected)


def test_an_empty_or_infinite_time_does_no_harm_where_speed_is_taken(tmp_path: Path) -> None:
    rows = [
        "\t1\t2\t1800\t1\tinf\t0.15\t4\t50\t0\t1\t;",
        "\t2\t3\t1800\t1\t\t0.15\t4\t90\t0\t1\t;",
        "\t3\t1\t1800\t1\t1\t0.15\t4\t0\t0\t1\t;",
    ]
    options = replace(UNITS, time_unit=None, free_speed_from="speed", speed_unit="km/h")
    network = read(tmp_path, net(rows), options)
    assert network.links["free_speed"].to_numpy() == pytest.approx(
        [50 / 3.6, 25, np.nan], nan_ok=True
    )
    with pytest.raises(InputError, match=r"1 row has no free_speed.*\(link_id 3-1\)"):
        check_network(network)
    with pytest.raises(InputError) as raised:
        read(tmp_path, net(rows))
    assert [(fault.line, fault.value) for fault in raised.value.faults] == [(9, "inf"), (10, "")]


def test_of_duplicates_the_first_is_used(tmp_path: Path) -> None:
    network = read(tmp_path, net([row(1, 2, 1800), row(2, 1), row(1, 2, 5400)]))
    assert network.links["capacity"].tolist() == [0.5, 0.5]
    note = network.notes[network.notes["topic"] == "duplicate link"].iloc[0]
    assert (note["element_id"], note["value"]) == ("1-2", "11")


def test_infinite_capacities_make_no_lanes(tmp_path: Path) -> None:
    rows = [row(1, 2, 99999), row(2, 3, 5400), row(3, 1, 1800)]
    network = read(tmp_path, net(rows))
    assert network.links["lanes"].tolist() == [3, 3, 1]
    assert np.isnan(network.links["capacity"].iloc[0])


def test_capacity_of_one_everywhere_is_no_capacity(tmp_path: Path) -> None:
    text = net([row(1, 2, 1), row(2, 1, 1)])
    network = read(tmp_path, text, replace(UNITS, capacity_unit=None))
    with pytest.raises(InputError, match="capacity was not measured"):
        check_network(network)
    check_network(read(tmp_path, text, replace(UNITS, capacity="diagram", capacity_unit=None)))


def test_one_time_on_links_of_all_lengths_is_no_time(tmp_path: Path) -> None:
    ring = [row(n, n % 12 + 1, length=n, time=0.75) for n in range(1, 13)]
    network = read(tmp_path, net(ring))
    with pytest.raises(InputError, match=r"12 rows have no free_speed.*free_flow_time was not"):
        check_network(network)


def test_a_speed_pattern_that_repeats_by_row_is_no_speed(tmp_path: Path) -> None:
    limits = [50, 80, 100, 120, 30]
    ring = [
        f"\t{n}\t{n % 25 + 1}\t1800\t{n}\t{n}.5\t0\t1\t{limits[n % 5]}\t0\t1\t;"
        for n in range(1, 26)
    ]
    options = replace(UNITS, free_speed_from="speed", speed_unit="km/h", time_unit=None)
    with pytest.raises(InputError, match="speed was not measured"):
        check_network(read(tmp_path, net(ring), options))


def test_length_that_copies_time_is_told(tmp_path: Path) -> None:
    network = read(tmp_path, net([row(1, 2, length=6, time=6), row(2, 1, length=4, time=4)]))
    assert "length copied" in topics(network)


CENTROIDS = [
    row(1, 4, 99999, 0.5, 0),
    row(4, 1, 99999, 0.5, 0),
    row(1, 5, 99999, 0.5, 0),
    row(2, 5, 99999, 0.5, 0),
    row(5, 2, 99999, 0.5, 0),
    row(4, 5, 1800, 1, 1),
    row(5, 4, 1800, 1, 1),
    row(4, 3, 1800, 1, 1),
    row(3, 4, 1800, 1, 1),
]


@pytest.mark.parametrize("first", [1, 3])
def test_connectors_collapse_onto_the_nodes_they_lead_to(tmp_path: Path, first: int) -> None:
    network = read(tmp_path, net(CENTROIDS, zones=2, first=first))
    nodes = network.nodes.set_index("node_id")
    assert list(network.links["link_id"]) == ["4-5", "5-4", "4-3", "3-4"]
    assert list(network.links["source_id"]) == ["6", "7", "8", "9"]
    assert list(nodes.index) == ["3", "4", "5"]
    assert nodes["through_traffic"].all()
    assert nodes.loc["5", "origin_of"] == "1 2"
    assert nodes.loc["5", "destination_of"] == "2"
    assert nodes.loc["4", "zone_id"] == nodes.loc["4", "destination_of"] == "1"
    assert nodes["zone_id"].isna()["3"]
    check_network(network)


@pytest.mark.parametrize("first", [1, 3])
def test_connectors_kept_let_no_traffic_through(tmp_path: Path, first: int) -> None:
    options = replace(UNITS, connectors="keep")
    network = read(tmp_path, net(CENTROIDS, zones=2, first=first), options)
    nodes = network.nodes.set_index("node_id")
    assert list(nodes.index[~nodes["through_traffic"]]) == ["1", "2"]
    assert list(nodes["zone_id"].dropna()) == ["1", "2"]
    assert len(network.links) == 9
    check_network(network)


def test_centroids_none_lets_all_traffic_through(tmp_path: Path) -> None:
    network = read(tmp_path, net(CENTROIDS, zones=2, first=3), replace(UNITS, centroids="none"))
    assert network.nodes["through_traffic"].all()
    assert len(network.links) == 9


def test_the_first_thru_node_may_be_given(tmp_path: Path) -> None:
    network = read(tmp_path, net(CENTROIDS, zones=2), replace(UNITS, first_thru_node=2))
    assert list(network.nodes["node_id"]) == ["2", "3", "4", "5"]


NODE_FILES = {
    "tabs": "Node\tX\tY\t;\n1\t-96.5\t43.5\t;\n2\t-96.25\t43.75\t;\n",
    "no semicolon": "node\tX\tY\n1\t-96.5\t43.5\n2\t-96.25\t43.75\n",
    "empty columns": "Node \tX \tY \t;\n"
    "1 \t-96.5 \t \t43.5 \t \t; \n2 \t-96.25 \t \t43.75 \t \t; \n",
    "blanks": "NodeID       Xcoord       Ycoord\n1  -96.5  43.5\n2 -96.25 43.75\n",
    "no header": "1 -96.5 43.5\n2 -96.25 43.75\n",
}


@pytest.mark.parametrize("name", NODE_FILES)
def test_node_files_of_every_form(tmp_path: Path, name: str) -> None:
    nodes = write(tmp_path, "node.tntp", NODE_FILES[name])
    options = replace(UNITS, crs="EPSG:4326")
    network = read(tmp_path, net([row(1, 2)]), options, nodes=nodes)
    assert network.links.geometry.iloc[0].wkt == "LINESTRING (-96.5 43.5, -96.25 43.75)"
    assert network.nodes.crs == network.links.crs == "EPSG:4326"


def test_points_in_geojson_bring_their_own_system(tmp_path: Path) -> None:
    features = [
        {"properties": {"id": n}, "geometry": {"type": "Point", "coordinates": [n, 50.0]}}
        for n in (1, 2)
    ]
    text = json.dumps({"type": "FeatureCollection", "features": features})
    nodes = write(tmp_path, "nodes.geojson", text)
    network = read(tmp_path, net([row(1, 2)]), nodes=nodes)
    assert network.nodes.geometry.iloc[1].wkt == "POINT (2 50)"
    assert network.nodes.crs == "EPSG:4326"


def test_coordinates_need_a_system_or_an_explicit_none(tmp_path: Path) -> None:
    nodes = write(tmp_path, "node.tntp", NODE_FILES["tabs"])
    with pytest.raises(InputError, match="must be stated as crs"):
        read(tmp_path, net([row(1, 2)]), nodes=nodes)
    with pytest.raises(InputError, match="is not a reference system"):
        read(tmp_path, net([row(1, 2)]), replace(UNITS, crs="EPSG:1"), nodes=nodes)
    network = read(tmp_path, net([row(1, 2)]), replace(UNITS, crs="none"), nodes=nodes)
    assert network.nodes.crs is None
    assert "no CRS" in topics(network)


def test_nodes_without_links_and_parts_are_told(tmp_path: Path) -> None:
    extra = NODE_FILES["no header"] + "3 0 0\n4 0 1\n9 5 5\n"
    nodes = write(tmp_path, "node.tntp", extra)
    text = net([row(1, 2), row(2, 1), row(3, 4)])
    network = read(tmp_path, text, replace(UNITS, crs="none"), nodes=nodes)
    unused = network.notes[network.notes["topic"] == "unused node"]
    assert list(unused["element_id"]) == ["9"]
    assert topics(network)["weak components"] == "2"
    assert topics(network)["strong components"] == "3"


def test_without_coordinates_a_map_is_laid_out_the_same_every_time(tmp_path: Path) -> None:
    text = net([row(1, 2), row(2, 3, length=2), row(3, 1, length=3), row(4, 5)])
    first, second = (read(tmp_path, text) for _ in range(2))
    assert first.nodes.geometry.to_wkb().equals(second.nodes.geometry.to_wkb())
    assert first.nodes.crs is None
    assert not first.nodes.geometry.to_wkb().duplicated().any()
    assert "schematic map" in topics(first)


def test_flows_are_joined_by_their_ends(tmp_path: Path) -> None:
    text = "From \tTo \tVolume \tCost \n2 \t1 \t20.5 \t1 \n1 \t2 \t7 \t3\n"
    flow = write(tmp_path, "flow.tntp", text)
    network = read(tmp_path, net([row(1, 2), row(2, 1), row(2, 3)]), flow=flow)
    volume, cost = network.links["tntp_volume"], network.links["tntp_cost"]
    assert volume.to_numpy() == pytest.approx([7.0, 20.5, np.nan], nan_ok=True)
    assert cost.to_numpy() == pytest.approx([3.0, 1.0, np.nan], nan_ok=True)
    assert topics(network)["flow missing"] == "1"


def test_capacities_are_kept_where_lanes_carry_less(tmp_path: Path) -> None:
    """At 6 m/s a lane carries 6·0.2/(1+6·0.2) = 0.545 veh/s; 2400 veh/h are 0.667 and one lane."""
    network = read(tmp_path, net([row(1, 2, 2400, 0.36, 1), row(2, 1, 1900, 0.36, 1)]))
    assert network.links["lanes"].tolist() == [1, 1]
    assert network.links["capacity"].to_numpy() == pytest.approx([2400 / 3600, 1900 / 3600])
    assert topics(network)["capacity above diagram"] == "1"


def test_what_is_assumed_of_single_links_is_warned_of(tmp_path: Path) -> None:
    rows = [row(1, 2, time=0), row(2, 3, length=0), row(3, 1), row(3, 3), row(2, 1)]
    network = read_tntp_network(write(tmp_path, "net.tntp", net(rows)), UNITS)
    notes = network.notes[network.notes["severity"] == "warning"]
    told = notes.set_index("topic")[["element_id", "value"]].T.to_dict("list")
    assert told["no free-flow time"] == ["1-2", "40"]
    assert told["length assumed"] == ["2-3", "1000"]
    assert told["self-loop"][0] == "3-3"
    assert "inf" not in set(network.notes["value"])


def test_connectors_that_take_no_time_are_no_reason_to_warn(tmp_path: Path) -> None:
    rows = [row(1, 2, time=0), row(2, 1, time=0), row(2, 3), row(3, 2)]
    options = replace(UNITS, connectors="keep")
    network = read_tntp_network(write(tmp_path, "net.tntp", net(rows, first=2)), options)
    assert "no free-flow time" not in set(network.notes["topic"])


@pytest.mark.parametrize(
    ("crs", "places", "doubt"),
    [
        ("EPSG:26771", "-96.77 43.61", "look like degrees"),
        ("EPSG:26771", "690000 1900000", None),  # Chicago, feet
        ("EPSG:26771", "690000 -9000000", "outside the area of use of EPSG:26771"),
        ("EPSG:32633", "500000 9000", None),
        ("EPSG:4326", "-96.77 43.61", None),
        ("EPSG:2193", "1500000 5400000", None),  # New Zealand
    ],
)
def test_a_system_that_cannot_be_is_doubted(
    tmp_path: Path, crs: str, places: str, doubt: str | None
) -> None:
    nodes = write(tmp_path, "node.tntp", f"node X Y ;\n1 {places} ;\n2 {places} ;\n")
    path = write(tmp_path, "net.tntp", net([row(1, 2), row(2, 1)]))
    notes = read_tntp_network(path, replace(UNITS, crs=crs), nodes=nodes).notes
    told = notes.loc[notes["topic"] == "doubtful CRS", ["severity", "note"]].to_numpy().tolist()
    assert [severity for severity, _ in told] == ([] if doubt is None else ["warning"])
    assert doubt is None or doubt in told[0][1]


def test_zones_that_share_a_node_are_told(tmp_path: Path) -> None:
    """In :data:`CENTROIDS` zones 1 and 2 both have a connector to node 5."""
    path = write(tmp_path, "net.tntp", net(CENTROIDS, zones=2, first=3))
    network = read_tntp_network(path, UNITS)
    (value,) = network.notes.loc[network.notes["topic"] == "zones share nodes", "value"]
    assert value == "1"
    served = network.nodes.set_index("node_id").loc["5", ["zone_id", "origin_of"]]
    assert served.tolist() == ["1", "1 2"]


def test_a_few_nodes_beyond_the_border_are_no_reason_to_doubt(tmp_path: Path) -> None:
    text = "node X Y ;\n1 690000 1900000 ;\n2 690000 1900100 ;\n3 690000 -9000000 ;\n"
    path = write(tmp_path, "net.tntp", net([row(1, 2), row(2, 3), row(3, 1)]))
    nodes = write(tmp_path, "node.tntp", text)
    notes = read_tntp_network(path, replace(UNITS, crs="EPSG:26771"), nodes=nodes).notes
    assert "doubtful CRS" not in set(notes["topic"])

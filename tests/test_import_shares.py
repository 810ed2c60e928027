"""Shares of given and assumed values against a plain count, and the places of notes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from road_tables import drawn, road, street

from uxsim_geo.network.doubts import DOUBTS, note_doubts
from uxsim_geo.network.import_shares import (
    kilometres_by_basis,
    shares_by_class,
    shares_of_all,
    short_links,
)
from uxsim_geo.network.note_geometry import placed
from uxsim_geo.network.note_words import percent
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.ready import make_ready
from uxsim_geo.network.ready_options import ReadyOptions


def links_drawn_by_lot(seed: int) -> pd.DataFrame:
    rng = np.random.default_rng(seed)
    number = 200
    links = pd.DataFrame(
        {
            "link_id": [f"{row}" for row in range(number)],
            "length": rng.integers(1, 2000, number).astype(float),
            "road_class": rng.choice(["primary", "service", None], number),
            "lanes_source": rng.choice(["given", "assumed", "capacity"], number),
            "free_speed_source": rng.choice(["given", "assumed"], number),
            "free_speed_basis": rng.choice(["maxspeed", "class primary", None], number),
        }
    )
    return links.astype({"road_class": "str", "free_speed_basis": "str"})


def counted(rows: list[dict[str, object]]) -> tuple[int, float, float, float]:
    """Links, km and shares, one link after the other."""
    km = lanes = speed = 0.0
    for row in rows:
        length = float(str(row["length"])) / 1000.0
        km += length
        lanes += length if row["lanes_source"] == "given" else 0.0
        speed += length if row["free_speed_source"] == "given" else 0.0
    return len(rows), km, lanes / km, speed / km


@pytest.mark.parametrize("seed", range(3))
def test_shares_are_those_of_a_plain_count(seed: int) -> None:
    links = links_drawn_by_lot(seed)
    rows = links.to_dict("records")
    shares = shares_by_class(links)
    assert list(shares["km"]) == sorted(shares["km"], reverse=True)
    for row in shares.to_dict("records"):
        of_class = [
            one
            for one in rows
            if row["road_class"]
            == (one["road_class"] if isinstance(one["road_class"], str) else "(none)")
        ]
        found = (row["links"], row["km"], row["lanes_given"], row["free_speed_given"])
        assert found == pytest.approx(counted(of_class))
    assert len(shares) == 3
    whole = shares_of_all(links)
    assert tuple(whole.values()) == pytest.approx(counted(rows))
    bases = kilometres_by_basis(links)
    assert bases.sum() == pytest.approx(whole["km"])
    told = [row["length"] for row in rows if row["free_speed_basis"] == "maxspeed"]
    assert bases["maxspeed"] == pytest.approx(sum(told) / 1000.0)


def test_what_is_not_known_is_no_share() -> None:
    links = links_drawn_by_lot(0)
    bare = links[["link_id", "length"]]
    (row,) = shares_by_class(bare).to_dict("records")
    assert row["links"] == 200
    assert np.isnan(row["lanes_given"])
    assert np.isnan(shares_of_all(bare)["free_speed_given"])
    assert kilometres_by_basis(bare).empty
    assert shares_by_class(links.iloc[:0]).empty
    unknown = links.assign(length=np.nan)
    assert shares_by_class(unknown)["lanes_given"].isna().all()


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0.0 %"),
        (1.0, "100.0 %"),
        (0.12345, "12.3 %"),
        (0.99999, "> 99.9 %"),
        (1e-5, "< 0.1 %"),
        (float("nan"), "–"),
    ],
)
def test_percent_never_rounds_to_all_or_nothing(share: float, text: str) -> None:
    assert percent(share) == text


def test_short_links_are_those_driven_in_less_than_a_step() -> None:
    places = {"a": (0.0, 0.0), "b": (49.0, 0.0), "c": (99.0, 0.0), "d": (100.0, 0.0)}
    network = drawn(places, [road("a", "b"), road("b", "c"), road("c", "d")])
    short = short_links(network, 5.0)  # 10 m/s: 50 m are driven in a step
    assert short.values.tolist() == [["c-d", 0.1], ["a-b", 4.9]]


def test_notes_have_the_place_of_their_element_also_of_one_that_is_gone() -> None:
    places = {"a": (0.0, 0.0), "b": (100.0, 0.0), "c": (100.0, 80.0)}
    before = drawn(places, [street("a", "b"), road("b", "c", through=[(140.0, 0.0)])])
    degrees = replace(
        before, nodes=before.nodes.to_crs("EPSG:4326"), links=before.links.to_crs("EPSG:4326")
    )
    after = replace(before, nodes=before.nodes.iloc[:2], links=before.links.iloc[:2])
    notes = Notes()
    notes.add("whole", "note")
    notes.add_each("link", "note", ["a-b", "b-c", "x-y"])
    notes.add_each("node", "note", ["a", "c", "a-b"], element="node")
    notes.add_each("demand", "note", ["a"], element="demand")
    table = placed(notes.table(), after, degrees)
    found = [None if shape is None else (shape.x, shape.y) for shape in table.geometry]
    half = before.links["geometry"].iloc[2].interpolate(0.5, normalized=True)
    expected = [None, (50.0, 0.0), (half.x, half.y), None, (0.0, 0.0), (100.0, 80.0), None, None]
    assert [place is None for place in found] == [place is None for place in expected]
    for one, other in zip(found, expected, strict=True):
        assert one is None or one == pytest.approx(other, abs=1.0)  # degrees are curved
    assert table.crs == after.nodes.crs
    again = placed(pd.concat([table, notes.table()], ignore_index=True), after)
    assert again.geometry.notna().sum() == 4 + 2  # places that were known stay


def test_notes_of_a_network_without_geometry_are_a_plain_table() -> None:
    network = drawn({"a": (0.0, 0.0), "b": (9.0, 0.0)}, [road("a", "b")])
    plain = replace(network, nodes=pd.DataFrame(network.nodes.drop(columns="geometry")))
    notes = Notes()
    notes.add_each("link", "note", ["a-b"])
    assert "geometry" not in placed(notes.table(), plain)


@pytest.mark.parametrize(
    ("name", "country", "most"),
    [
        ("helsinki.osm.pbf", "FI", 5),
        ("bad-hersfeld.osm.xml.gz", "DE", 5),
        ("portland-central-filtered.osm.pbf", "US", 30),
        ("heidelberg.osm.pbf", "DE", 50),
    ],
)
def test_few_spots_of_a_city_are_doubtful(shared: Path, name: str, country: str, most: int) -> None:
    read = read_osm_network(shared / "data" / "osm" / name, OsmOptions(country=country))
    network = make_ready(read, ReadyOptions(sampled_ways=0))
    notes = Notes()
    note_doubts(network, notes)
    table = notes.table()
    found = table[table["severity"] == "doubt"]
    assert set(found["topic"]) <= set(DOUBTS)
    assert len(found) <= most
    located = placed(found, network, read)
    assert located.geometry.notna().all()
    (share,) = table.loc[table["topic"] == "connections", "value"]
    assert float(share) == 1.0  # what is left hangs together

"""Lists of trips: moments by clock and date, and departures of the engine's platoons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from od_files import mapped, values, write
from small_networks import grid, link, network
from test_demand_loading import access
from test_demand_places import LINKS, PLACES, E, N

from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.od_loading import load_od
from uxsim_geo.demand.platoons import make_platoons
from uxsim_geo.demand.points import Points
from uxsim_geo.demand.trip_list import TripListOptions, read_trip_list
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.settings import Settings

RING = network([link("ab", "a", "b"), link("bc", "b", "c"), link("ca", "c", "a")])

SECONDS = "origin,destination,depart_s\na,b,0\na,b,90.5\nc,a,1200\n"
WAYS = {
    "times of day": ("06:30", "a,b,06:30\na,b,06:31:30.5\nc,a,6:50:00\n"),
    "dates": (
        "2024-05-14T06:30",
        "a,b,2024-05-14 06:30:00\na,b,2024-05-14T06:31:30.5\nc,a,2024-05-14T06:50\n",
    ),
    "dates of several zones": (
        "2024-05-14T06:30+02:00",
        "a,b,2024-05-14T04:30Z\na,b,2024-05-14T06:31:30.500+02:00\nc,a,2024-05-14T05:50+0100\n",
    ),
    "over midnight": (
        "23:50",
        "a,b,23:50\na,b,23:51:30.5\nc,a,24:10\n",
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_moments_in_every_way_of_writing(tmp_path: Path, way: str) -> None:
    begin, rows = WAYS[way]
    path = write(tmp_path, "trips.csv", "origin,destination,depart\n" + rows)
    table = read_trip_list(path, TripListOptions(begin)).table
    plain = read_trip_list(write(tmp_path, "plain.csv", SECONDS)).table
    assert values(table) == values(plain)
    assert table["start_s"].tolist() == [0.0, 90.5, 1200.0]
    assert table["vehicles"].tolist() == [1.0, 1.0, 1.0]


def test_moments_keep_their_microseconds(tmp_path: Path) -> None:
    """As seconds since 1970 they would be rounded to 0.24 µs."""
    lines = [f"a,b,2024-05-14T06:30:00.{part:06d}" for part in (1, 2, 999_999)]
    path = tmp_path / "trips.csv"
    path.write_text("\n".join(["origin,destination,time", *lines]), encoding="utf-8")
    found = read_trip_list(path, TripListOptions("2024-05-14T06:30"))
    assert found.table["start_s"].tolist() == [1e-6, 2e-6, 0.999999]


def test_parquet_has_moments_of_its_own(tmp_path: Path) -> None:
    table = pd.DataFrame({"origin": ["a", "c"], "destination": ["b", "a"]})
    table["time"] = pd.to_datetime(
        ["2024-05-14 06:30:00", "2024-05-14 06:30:07.25"], format="ISO8601"
    )
    table.to_parquet(tmp_path / "trips.parquet")
    found = read_trip_list(tmp_path / "trips.parquet", TripListOptions("2024-05-14 06:30"))
    assert found.table["start_s"].tolist() == [0.0, 7.25]


def test_every_trip_departs_at_its_own_moment(tmp_path: Path) -> None:
    generator = np.random.default_rng(4)
    moments = np.sort(np.round(generator.random(200) * 3600, 3))
    rows = "".join(f"a,b,{moment}\n" for moment in generator.permutation(moments))
    path = write(tmp_path, "trips.csv", "origin,destination,depart_s\n" + rows)
    loaded = load_od(read_trip_list(path), RING)
    check_demand(loaded.demand, RING)
    platoons = make_platoons(loaded.demand, Settings(3600.0, 1))
    assert platoons.vehicles.tolist() == [1] * 200
    assert platoons.depart == pytest.approx(moments, abs=1e-9)
    # with larger platoons at the moments of some of them, in their order
    fives = make_platoons(loaded.demand, Settings(3600.0, 5))
    assert fives.vehicles.tolist() == [5] * 40
    assert np.isin(np.round(fives.depart, 3), moments).all()
    assert (np.searchsorted(moments, fives.depart + 1e-6) - 1) // 5 == pytest.approx(np.arange(40))


def test_vehicles_and_classes_and_equal_trips(tmp_path: Path) -> None:
    text = "origin,destination,departure_s,vehicles,class\na,b,60,3,\na,b,60,2,\na,b,60,1,bus\n"
    od = read_trip_list(write(tmp_path, "trips.csv", text))
    assert values(od.table, "start_s", "vehicles", "class") == [
        [60.0, 1.0, "bus"],
        [60.0, 5.0, "default"],
    ]
    assert od.notes.set_index("topic")["value"]["pairs summed"] == "1"


def test_trips_outside_the_time(tmp_path: Path) -> None:
    text = (
        "origin,destination,depart\na,b,06:29:59\na,b,06:30\nb,c,07:29:59\nb,c,07:30\na,b,06:00\n"
    )
    path = write(tmp_path, "trips.csv", text)
    with pytest.raises(InputError) as raised:
        read_trip_list(path, TripListOptions("06:30", end_s=3600.0))
    found = [(fault.line, fault.column, fault.value) for fault in raised.value.faults]
    assert found == [(2, "depart", "06:29:59"), (6, "depart", "06:00"), (5, "depart", "07:30")]
    od = read_trip_list(path, TripListOptions("06:30", "drop", 3600.0))
    assert od.table["start_s"].tolist() == [0.0, 3599.0]
    loaded = load_od(od, RING)
    assert values(loaded.dropped) == [
        ["outside the time", "a", "b", 2.0],
        ["outside the time", "b", "c", 1.0],
    ]
    report = loaded.report.set_index("place")
    assert report.loc["a", ["out_given", "out_loaded", "out_dropped"]].tolist() == [3.0, 1.0, 2.0]


def test_faults_of_moments(tmp_path: Path) -> None:
    text = "origin,destination,depart\na,b,noon\na,b,06:61\na,b,\n,b,07:00\na,b,2024-05-14T07:00\n"
    path = write(tmp_path, "trips.csv", text)
    with pytest.raises(InputError) as raised:
        read_trip_list(path, TripListOptions("06:30"))
    found = [(fault.line, fault.column, fault.value) for fault in raised.value.faults]
    assert found == [
        (2, "depart", "noon"),
        (3, "depart", "06:61"),
        (4, "depart", ""),
        (6, "depart", "2024-05-14T07:00"),
        (5, "origin", ""),
    ]
    with pytest.raises(InputError, match=r"begin: must be a time of day.*'dawn'"):
        read_trip_list(path, TripListOptions("dawn"))
    with pytest.raises(InputError, match="begin: the moment at which"):
        read_trip_list(path)
    with pytest.raises(InputError, match="lacks the column depart or depart_s"):
        read_trip_list(write(tmp_path, "none.csv", "origin,destination\na,b\n"))
    zoned = write(tmp_path, "zoned.csv", "origin,destination,depart\na,b,2024-05-14T07:00Z\n")
    with pytest.raises(InputError, match="with a time zone if that has one"):
        read_trip_list(zoned, TripListOptions("2024-05-14T06:30"))
    bad = write(tmp_path, "bad.csv", "origin,destination,depart\na,b,2024-02-30T07:00\n")
    with pytest.raises(InputError, match="must be a date and time"):
        read_trip_list(bad, TripListOptions("2024-02-01T06:30"))


def test_options_tell_all_their_faults() -> None:
    with pytest.raises(InputError) as raised:
        TripListOptions(outside="ignore", end_s=0.0, names={"start": "t"})  # type: ignore[arg-type]
    assert len(raised.value.faults) == 3


def test_points_like_those_of_trackers(tmp_path: Path) -> None:
    road = mapped(LINKS, PLACES)
    text = "o_x,o_y,d_x,d_y,depart_s,class\n"
    text += f"{E + 30},{N - 20},{E + 2900},{N},10,taxi\n{E + 30},{N - 20},{E + 1400},{N},20,taxi\n"
    text += f"{E},{N + 4000},{E + 1400},{N},30,taxi\n"
    path = write(tmp_path, "gps.csv", text)
    points = Points(road, "EPSG:25832", within_m=450.0)
    loaded = load_od(read_trip_list(path, points=points), road)
    assert values(loaded.demand.table, "origin", "destination", "start_s", "class") == [
        ["a", "b", 20.0, "taxi"],
        ["a", "d", 10.0, "taxi"],
    ]
    assert values(loaded.dropped, "reason", "origin", "vehicles") == [
        ["no access node", "500000 5504000", 1.0]
    ]


def test_trips_between_zones_of_several_nodes_are_all_simulated(tmp_path: Path) -> None:
    """As shares in the table, as whole vehicles in the run, at the moments of the list."""
    of = network(grid(4))
    shares = access(
        *(("west", f"{row},0", weight) for row, weight in enumerate((1.0, 2.0, 3.0, 2.0))),
        *(("east", f"{row},3", 1.0) for row in range(4)),
    )
    moments = np.repeat([100.0, 700.0], 40)
    rows = "".join(f"west,east,{moment}\n" for moment in moments)
    path = write(tmp_path, "trips.csv", "origin,destination,depart_s\n" + rows)
    loaded = load_od(read_trip_list(path), of, shares)
    assert len(loaded.demand.table) == 2 * 16
    result = simulate(of, loaded.demand, Settings(2000.0, 1))
    trips = result.trips
    assert trips["vehicles"].sum() == 80
    assert (trips["status"] == "completed").all()
    by_node = trips.groupby("origin", observed=True)["vehicles"].sum()
    for row, share in enumerate((10, 20, 30, 20)):
        assert abs(by_node[f"{row},0"] - share) <= 1
    depart = trips["depart_s"].round(6)
    assert set(depart) == {100.0, 700.0}
    assert abs((depart == 100.0).sum() - 40) <= 16  # pairs round on their own

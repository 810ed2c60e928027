"""The gravity model: its totals, its law of ratios, and times found another way."""

from __future__ import annotations

import heapq

import numpy as np
import pandas as pd
import pytest
from od_files import values
from small_networks import grid, link, network
from test_demand_loading import access

from uxsim_geo.demand.access import access_of_nodes
from uxsim_geo.demand.calibration import calibrated_impedance
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.free_flow import ZoneTimes, free_flow_times
from uxsim_geo.demand.gravity import GravityOptions, Impedance, gravity
from uxsim_geo.demand.od_loading import load_od
from uxsim_geo.demand.od_table import natural_order
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.timing import in_time
from uxsim_geo.demand.trip_ends import TripRates, trip_ends
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network

NAN = np.nan


def times(matrix: list[list[float]]) -> ZoneTimes:
    return ZoneTimes(pd.Index([str(i + 1) for i in range(len(matrix))]), np.array(matrix))


def ends(*rows: tuple[str, float, float]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["zone", "production", "attraction"])


TIMES = times(
    [[NAN, 300, 600, 900], [240, NAN, 420, 660], [600, 480, NAN, 300], [840, 600, 360, NAN]]
)
ENDS = ends(("1", 100, 50), ("2", 80, 90), ("3", 60, 120), ("4", 40, 20))


@pytest.mark.parametrize(
    "impedance",
    [Impedance(0.0, 0.2), Impedance(1.5, 0.0), Impedance(0.8, 0.1), Impedance(-0.5, 0.3)],
    ids=["exponential", "power", "combined", "rising first"],
)
def test_totals_hold_and_ratios_follow_the_law(impedance: Impedance) -> None:
    model = gravity(ENDS, TIMES, impedance)
    report = model.report.set_index("zone")
    assert report["out"].tolist() == pytest.approx([100, 80, 60, 40], rel=1e-5)
    assert report["in"].tolist() == pytest.approx([50, 90, 120, 20], rel=1e-5)
    flow = model.od.table.set_index(["origin", "destination"])["vehicles"]
    assert len(flow) == 12

    def f(origin: str, destination: str) -> float:
        t = TIMES.seconds[int(origin) - 1, int(destination) - 1] / 60
        return float(t**-impedance.exponent * np.exp(-impedance.decay_per_min * t))

    # T_13 T_24 / (T_14 T_23) = f_13 f_24 / (f_14 f_23): attraction and production fall out
    for a, b, c, d in (("1", "2", "3", "4"), ("3", "4", "1", "2"), ("1", "4", "2", "3")):
        found = flow[a, c] * flow[b, d] / (flow[a, d] * flow[b, c])
        assert found == pytest.approx(f(a, c) * f(b, d) / (f(a, d) * f(b, c)), rel=1e-9)
    mean = sum(
        flow[pair] * TIMES.seconds[int(pair[0]) - 1, int(pair[1]) - 1] for pair in flow.index
    )
    assert model.figures["mean_time_s"] == pytest.approx(mean / 280)
    assert model.figures["vehicles"] == pytest.approx(280)


def test_with_one_side_only_shares_are_those_of_the_formula() -> None:
    model = gravity(ENDS, TIMES, Impedance(1.0), GravityOptions("origin"))
    flow = model.od.table.set_index(["origin", "destination"])["vehicles"]
    pull = np.array([90 / 5, 120 / 10, 20 / 15])
    assert [flow["1", d] for d in "234"] == pytest.approx((100 * pull / pull.sum()).tolist())
    assert model.report["out"].tolist() == pytest.approx([100, 80, 60, 40])


def test_by_hand_two_zones_must_exchange_all() -> None:
    model = gravity(ends(("1", 30, 10), ("2", 10, 30)), times([[NAN, 60], [60, NAN]]), Impedance())
    assert values(model.od.table) == [["1", "2", 30.0], ["2", "1", 10.0]]


def test_trips_within_a_zone_take_half_the_way_to_the_nearest() -> None:
    both = ends(("1", 40, 40), ("2", 40, 40))
    apart = times([[NAN, 240], [240, NAN]])
    model = gravity(both, apart, Impedance(1.0), GravityOptions(intrazonal="half nearest"))
    # f is 1/2 within and 1/4 between, and all totals are alike
    found = {(a, b): v for a, b, v in values(model.od.table)}
    assert found["1", "1"] == pytest.approx(40 * 2 / 3)
    assert model.figures["intrazonal_share"] == pytest.approx(2 / 3)
    assert gravity(both, apart, Impedance(1.0)).figures["intrazonal_share"] == 0.0


def test_zones_that_reach_nothing_are_told() -> None:
    lonely = times([[NAN, 60, NAN], [60, NAN, NAN], [NAN, NAN, NAN]])
    model = gravity(ends(("1", 30, 20), ("2", 20, 30), ("3", 5, 7)), lonely, Impedance(0, 0.1))
    report = model.report.set_index("zone")
    assert report.loc["3", ["out", "in"]].tolist() == [0.0, 0.0]
    assert report.loc["3", "why"] == (
        "out: reaches no zone that draws vehicles; in: no zone that sends vehicles reaches it"
    )
    assert report["out"].tolist() == pytest.approx([30.0, 20.0, 0.0], rel=1e-5)
    assert report["in"].tolist() == pytest.approx([20.0, 30.0, 0.0], rel=1e-5)
    # attractions were 55/57 of those given, for all productions, and then 50/50 of zone 1 and 2
    assert report.loc["1", "why"] == "in: multiplied to 20, since others were lost"
    (lost,) = model.od.notes.query("severity == 'warning'")["value"]
    assert float(lost) == 5.0


def test_totals_that_no_table_has_are_told() -> None:
    # nobody may stay in zone 1, and the others draw less than it sends
    model = gravity(
        ends(("1", 80, 80), ("2", 10, 10), ("3", 10, 10)),
        times(np.full((3, 3), 60.0).tolist()),
        Impedance(),
    )
    assert model.figures["worst_deviation"] > 0.1
    assert model.od.notes["note"].str.startswith("NOT balanced").any()
    assert not gravity(ENDS, TIMES, Impedance()).od.notes["note"].str.startswith("NOT").any()


def test_times_are_shortest_paths_between_access_nodes() -> None:
    """Against a plain Dijkstra, with one-way streets, parallel links and a barred node."""
    generator = np.random.default_rng(3)
    links = [
        row | {"free_speed": float(generator.integers(5, 30))}
        for row in grid(4)
        if generator.random() < 0.9
    ]
    links += [
        link(f"{row['link_id']} slow", row["from_node_id"], row["to_node_id"], 900.0)
        for row in links[:9]
    ]
    of = network(links, no_through=["1,1", "2,2"])
    nodes = of.nodes["node_id"].tolist()
    rows = [
        (str(zone), str(node), float(generator.integers(1, 4)))
        for zone in range(5)
        for node in generator.choice(nodes, 3, replace=False)
    ]
    shares = access(*rows)
    found = free_flow_times(of, shares)
    assert found.zones.tolist() == list("01234")
    for i, j in np.ndindex(5, 5):
        if i == j:
            assert np.isnan(found.seconds[i, j])
            continue
        total = weight = 0.0
        for a in shares.origins[shares.origins["zone"] == str(i)].itertuples():
            way = plain_dijkstra(of, str(a.node))
            for b in shares.destinations[shares.destinations["zone"] == str(j)].itertuples():
                if a.node != b.node and b.node in way:
                    total += a.share * b.share * way[b.node]
                    weight += a.share * b.share
        assert found.seconds[i, j] == pytest.approx(total / weight, rel=1e-12)


def plain_dijkstra(of: Network, origin: str) -> dict[str, float]:
    barred = set(of.nodes.loc[~of.nodes["through_traffic"], "node_id"])
    out: dict[str, list[tuple[str, float]]] = {}
    for row in of.links.itertuples():
        out.setdefault(str(row.from_node_id), []).append(
            (str(row.to_node_id), row.length / row.free_speed)
        )
    best: dict[str, float] = {}
    heap = [(0.0, origin)]
    while heap:
        time, node = heapq.heappop(heap)
        if node in best:
            continue
        best[node] = time
        if node not in barred or node == origin:
            for other, more in out.get(node, ()):
                heapq.heappush(heap, (time + more, other))
    return best


def test_no_way_is_no_time() -> None:
    of = network([link("ab", "a", "b"), link("ba", "b", "a"), link("bz", "b", "z")])
    found = free_flow_times(of, access_of_nodes(of))
    assert found.zones.tolist() == ["a", "b", "z"]
    expected = [[NAN, 50, 100], [50, NAN, 50], [NAN, NAN, NAN]]
    assert np.array_equal(found.seconds, expected, equal_nan=True)


def test_ends_are_rates_times_what_zones_hold() -> None:
    zones = pd.DataFrame({"zone": ["1", "2"], "population": [1000, 500], "jobs": [100, 900]})
    rates = TripRates({"population": 0.1, "jobs": 0.01}, {"jobs": 0.4, "population": 0.02})
    found = trip_ends(zones, rates)
    assert found["production"].tolist() == pytest.approx([101.0, 59.0])
    assert found["attraction"].tolist() == pytest.approx([160 * 60 / 430, 160 * 370 / 430])


def test_faults_of_zones_and_rates() -> None:
    zones = pd.DataFrame(
        {"zone": ["1", "1", None, "4"], "population": [10, "many", -1, 5], "jobs": 0.0}
    )
    rates = TripRates({"population": 0.1}, {"jobs": 1.0})
    with pytest.raises(InputError) as raised:
        trip_ends(zones, rates)
    message = str(raised.value)
    for what in (
        "column zone: row 2: needs a name",
        "column zone: row 1: the zone stands",
        "column population: row 1: must be a finite number, 0 or more (found 'many')",
        "column population: row 2: must be",
    ):
        assert what in message
    with pytest.raises(InputError, match="no zone has any attraction"):
        trip_ends(zones.iloc[:1], rates)
    with pytest.raises(InputError, match="lacks the column shops"):
        trip_ends(zones, TripRates({"shops": 1.0}, {"jobs": 1.0}))
    with pytest.raises(InputError, match=r"names no column.*\n.*'-1\.0'"):
        TripRates({}, {"jobs": -1.0})
    with pytest.raises(InputError, match=r"no times from and to this zone \(found '9'\)"):
        gravity(ends(("9", 1, 1), ("1", 1, 1)), TIMES, Impedance())
    with pytest.raises(InputError) as raised:
        Impedance(NAN, -1.0, 0.0)
    assert len(raised.value.faults) == 3
    with pytest.raises(InputError) as raised:
        GravityOptions("triple", "some")  # type: ignore[arg-type]
    assert len(raised.value.faults) == 2


def test_a_city_without_data_can_be_simulated() -> None:
    of = network(grid(4))
    shares = access_of_nodes(of)
    zones = pd.DataFrame({"zone": of.nodes["node_id"], "population": 200.0, "jobs": range(16)})
    model = gravity(
        trip_ends(zones, TripRates({"population": 0.1}, {"jobs": 1.0})),
        free_flow_times(of, shares),
        Impedance(decay_per_min=0.1),
    )
    loaded = load_od(in_time(model.od, TripsOptions(3600.0)), of, shares)
    check_demand(loaded.demand, of)
    assert loaded.demand.table["vehicles"].sum() == pytest.approx(320.0, rel=1e-5)
    assert loaded.dropped.empty
    assert model.report["zone"].tolist() == natural_order(of.nodes["node_id"])


def test_the_decay_is_found_again_from_the_mean_time() -> None:
    for impedance in (Impedance(0.0, 0.2), Impedance(0.7, 0.05), Impedance(0.0, 0.5)):
        mean = gravity(ENDS, TIMES, impedance).figures["mean_time_s"]
        found = calibrated_impedance(ENDS, TIMES, mean, impedance=Impedance(impedance.exponent))
        assert found.exponent == impedance.exponent
        assert found.decay_per_min == pytest.approx(impedance.decay_per_min, rel=0.02)
        again = gravity(ENDS, TIMES, found).figures["mean_time_s"]
        assert again == pytest.approx(mean, rel=1e-4)
    with pytest.raises(InputError, match=r"no decay gives trips of this mean time.*'9000'"):
        calibrated_impedance(ENDS, TIMES, 9000)
    with pytest.raises(InputError, match="no decay gives"):
        calibrated_impedance(ENDS, TIMES, 60.0)


def test_an_impedance_beyond_all_numbers_is_refused() -> None:
    with pytest.raises(InputError, match="too large for numbers"):
        gravity(ENDS, TIMES, Impedance(-500.0))

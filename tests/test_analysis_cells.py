"""States by time and place: worked out by hand, and adding up to those of the links."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from newell_link import events_of, network_of, result_of, trips_of
from small_networks import across, grid
from small_networks import network as network_of_rows

from uxsim_geo.analysis import cells
from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings


@pytest.fixture(scope="module")
def crowded() -> tuple[Network, Result]:
    """A grid with queues on links of 300 m, and vehicles under way at the end."""
    of = network_of_rows(grid(4))
    return of, simulate(of, across(4, 15.0, 400.0), Settings(600.0, platoon_size=2))


def test_a_platoon_drives_through_the_cells_of_its_way() -> None:
    # 20 m/s from 40 s: at 250, 500, 750 and 1000 m after 12.5, 25, 37.5 and 50 s
    network = network_of([{}])
    result = result_of(
        events_of(network, [(0, 0, 40.0, 90.0)]), trips_of([{"vehicles": 2}]), Settings(120.0)
    )
    table = space_time_cells(result, network, bin_s=60.0, cell_m=250.0)
    assert table["begin_s"].tolist() == [0.0] * 4 + [60.0] * 4
    assert table["begin_m"].tolist() == [0.0, 250.0, 500.0, 750.0] * 2
    assert table["end_m"].tolist() == [250.0, 500.0, 750.0, 1000.0] * 2
    assert table["distance"].to_numpy() == pytest.approx([500, 300, 0, 0, 0, 200, 500, 500])
    assert table["time"].to_numpy() == pytest.approx([25, 15, 0, 0, 0, 10, 25, 25])
    assert table["flow"].to_numpy()[0] == pytest.approx(500 / (250 * 60))
    assert table["speed"].to_numpy()[[0, 1, 5]] == pytest.approx([20, 20, 20])
    assert table["speed"].isna().tolist() == [False, False, True, True, True, False, False, False]


def test_a_queue_stands_at_jam_density_in_the_cells_at_the_end() -> None:
    # 20 platoons of 5 stand 25 m apart, the first vehicles of each at 1000, 975 … 525 m; who
    # stands at the border of two cells has come to the second
    network = network_of([{}])
    rows = [(k, 0, 7.0 * k, np.nan) for k in range(20)]
    trips = trips_of([{"status": "running", "enter_s": 7.0 * k} for k in range(20)])
    result = result_of(events_of(network, rows), trips, Settings(400.0))
    table = space_time_cells(result, network, bin_s=[300.0, 400.0], cell_m=100.0)
    assert table["density"].to_numpy()[5:] == pytest.approx([0.15, 0.2, 0.2, 0.2, 0.25])
    assert table["density"].to_numpy()[:5].sum() == pytest.approx(0.0, abs=1e-9)
    assert table["flow"].to_numpy() == pytest.approx(0.0, abs=1e-9)
    assert len(table) == 10


@pytest.mark.parametrize("cell_m", [1000.0, 300.0, 70.0, 9.0])
@pytest.mark.parametrize("bin_s", [600.0, 47.0])
def test_cells_add_up_to_their_links(
    crowded: tuple[Network, Result], cell_m: float, bin_s: float
) -> None:
    of, result = crowded
    table = space_time_cells(result, of, bin_s=bin_s, cell_m=cell_m)
    states = link_times(result, of, bin_s=bin_s)
    keys = ["link_id", "begin_s"]
    sums = table.groupby(keys, observed=False)[["distance", "time"]].sum().reset_index()
    assert sums["begin_s"].tolist() == states["begin_s"].tolist()
    for name in ("distance", "time"):
        assert sums[name].to_numpy() == pytest.approx(states[name].to_numpy(), abs=1e-6), name


def test_no_cell_is_denser_than_a_jam_or_faster_than_its_road(
    crowded: tuple[Network, Result],
) -> None:
    of, result = crowded
    table = space_time_cells(result, of, bin_s=20.0, cell_m=30.0)
    assert table["density"].max() > 0.15
    # a platoon of n counts at its first vehicle: a cell holds one too many at most
    assert (table["density"] <= 0.2 + 2 / 30).all()
    assert (table["speed"].dropna() <= 20.0 + 1e-9).all()
    moving = table["time"] > 0
    product = (table["density"] * table["speed"])[moving]
    assert table["flow"][moving].to_numpy() == pytest.approx(product.to_numpy())


def test_blocks_do_not_show(
    crowded: tuple[Network, Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    of, result = crowded
    whole = space_time_cells(result, of, bin_s=60.0, cell_m=50.0)
    monkeypatch.setattr(cells, "BLOCK", 500)
    in_blocks = space_time_cells(result, of, bin_s=60.0, cell_m=50.0)
    assert in_blocks.drop(columns=["distance", "time", "flow", "density", "speed"]).equals(
        whole.drop(columns=["distance", "time", "flow", "density", "speed"])
    )
    assert in_blocks["time"].to_numpy() == pytest.approx(whole["time"].to_numpy())


def test_links_and_vehicles_are_chosen(crowded: tuple[Network, Result]) -> None:
    of, result = crowded
    whole = space_time_cells(result, of, bin_s=60.0, cell_m=100.0)
    two = of.links["link_id"].iloc[[5, 2]].tolist()
    table = space_time_cells(result, of, bin_s=60.0, cell_m=100.0, links=two)
    chosen = whole[whole["link_id"].isin(two)].reset_index(drop=True)
    assert table["time"].to_numpy() == pytest.approx(chosen["time"].to_numpy())
    odd = np.arange(1, len(result.trips), 2)
    parts = [
        space_time_cells(result, of, bin_s=60.0, cell_m=100.0, vehicles=some)["time"]
        for some in (odd, odd - 1)
    ]
    assert (parts[0] + parts[1]).to_numpy()[: len(whole)] == pytest.approx(
        whole["time"].to_numpy(), abs=1e-6
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bin_s": 0.0, "cell_m": 10.0}, "bin_s"),
        ({"bin_s": 60.0, "cell_m": -1.0}, "cell_m"),
        ({"bin_s": 60.0, "cell_m": float("nan")}, "cell_m"),
        ({"bin_s": 0.001, "cell_m": 0.1}, "rows: take longer cells"),
        ({"bin_s": 60.0, "cell_m": 10.0, "links": []}, "links: is empty"),
        ({"bin_s": 60.0, "cell_m": 10.0, "links": ["nowhere"]}, "nowhere"),
    ],
)
def test_wrong_questions_are_refused(
    crowded: tuple[Network, Result], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        space_time_cells(crowded[1], crowded[0], **options)

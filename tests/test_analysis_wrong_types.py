"""What is no number, no name or too much is told by its argument, never by an error of Python."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from small_networks import across, grid
from small_networks import network as network_of_rows

from uxsim_geo.analysis import link_states, table_size, trajectories
from uxsim_geo.analysis.bins import bin_edges
from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.cumulative import cumulative_curves
from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.selection import users_of_links
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

OF = network_of_rows(grid(2))
LINK = OF.links["link_id"].iloc[0]


@pytest.fixture(scope="module")
def result() -> Result:
    return simulate(OF, across(2, 15.0, 100.0), Settings(300.0))


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda of: link_times(of, OF, bin_s="abc"), "column bin_s: must be a number"),
        (lambda of: link_times(of, OF, bin_s=60, links=5), "column links: must be a name"),
        (lambda of: space_time_cells(of, OF, bin_s=60, cell_m="x"), "column cell_m: must be a num"),
        (lambda of: trajectories.trajectories(of, OF, times=["x"]), "column times: must be a num"),
        (lambda of: trajectories.trajectories(of, OF, step_s="5"), "column step_s: must be a fin"),
        (lambda of: users_of_links(of, LINK, between=5), "column between: must be an earlier"),
        (lambda of: users_of_links(of, LINK, between="ab"), "column between: must be a number"),
        (lambda of: users_of_links(of, LINK, between=(1, 2, 3)), "column between: must be an ear"),
        (lambda of: cumulative_curves(of, OF, [LINK, LINK]), "column link: must be one link_id"),
        (lambda of: trip_summary(of, OF, vehicles=np.arange(99_999)), "of them are no trips"),
    ],
)
def test_one_fault_that_names_its_argument(
    result: Result, ask: Callable[[Result], object], message: str
) -> None:
    with pytest.raises(InputError, match=message) as raised:
        ask(result)
    assert len(raised.value.faults) == 1


def test_an_edge_that_is_no_number_is_one_fault() -> None:
    with pytest.raises(InputError, match="between 0 and the end") as raised:
        bin_edges(300.0, [0, float("nan"), 10])
    assert len(raised.value.faults) == 1


def test_tables_beyond_the_memory_are_refused_before_it_is_taken(
    result: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = len(trajectories.trajectories(result, OF, step_s=1.0))
    monkeypatch.setattr(trajectories, "MOST_SAMPLES", rows)
    assert len(trajectories.trajectories(result, OF, step_s=1.0)) == rows
    monkeypatch.setattr(trajectories, "MOST_SAMPLES", rows - 1)
    with pytest.raises(InputError, match=f"makes {rows:,} rows: take fewer moments"):
        trajectories.trajectories(result, OF, step_s=1.0)
    links = len(OF.links)
    monkeypatch.setattr(link_states, "MOST_STATES", 5 * links)
    assert len(link_times(result, OF, bin_s=60.0)) == 5 * links
    with pytest.raises(InputError, match=f"makes {6 * links} rows: take longer bins"):
        link_times(result, OF, bin_s=50.0)


@pytest.mark.parametrize("duration", [1200.0, 7.0, 86_400.0, 1e-3])
@pytest.mark.parametrize("most", [1, 3, 7, 20_000, 1_000_000])
def test_the_shortest_step_is_enough_and_hardly_more(duration: float, most: int) -> None:
    step = table_size.shortest_step(duration, most)
    assert duration / step <= most * (1 + 1e-9)
    assert step <= 1.01 * duration / most

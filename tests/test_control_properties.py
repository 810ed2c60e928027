"""What holds for every run, under measures of every kind and two classes of drivers, all drawn."""

from __future__ import annotations

import pytest
from drawn_networks import Tables
from test_engine_pieces import controlled_case
from test_properties import (
    arrivals_are_departures_a_travel_time_later,
    links_are_first_in_first_out,
    no_link_holds_more_than_its_jam_density,
    nobody_is_faster_than_free_flow,
    passings,
    times_are_positive_and_in_order,
    vehicles_are_conserved_in_every_step,
)

from uxsim_geo.engine.simulation import simulate

#: control may take what the diagram allows, and never gives more
UNDER_CONTROL = (
    times_are_positive_and_in_order,
    nobody_is_faster_than_free_flow,
    links_are_first_in_first_out,
    vehicles_are_conserved_in_every_step,
    no_link_holds_more_than_its_jam_density,
    arrivals_are_departures_a_travel_time_later,
)


@pytest.mark.parametrize("seed", range(8))
def test_under_control_all_of_this_holds(seed: int) -> None:
    (net, wanted, told), control, classes = controlled_case(seed)
    result = simulate(net, wanted, told, control=control, classes=classes)
    shares = ["origin", "destination", "start_s", "end_s", "vehicles"]
    rows = list(wanted.table[shares].itertuples(index=False, name=None))
    # whole vehicles
    driven = float(result.trips["vehicles"].sum())
    assert driven == pytest.approx(sum(row[4] for row in rows), abs=1)
    tables: Tables = (net.links.to_dict("records"), [("", "", 0.0, 0.0, driven)])  # type: ignore[assignment]
    for holds in UNDER_CONTROL:
        holds(tables, result)
    met = sum(passing.enter.size for passing in passings(tables, result))
    assert met == len(result.events) > 500

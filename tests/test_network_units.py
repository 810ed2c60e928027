"""Units as people write them."""

from __future__ import annotations

import pytest

from uxsim_geo.network.units import Quantity, Unit, parse_unit


@pytest.mark.parametrize(
    ("text", "quantity", "factor"),
    [
        ("m", "length", 1.0),
        ("0.5 km", "length", 500.0),
        ("mi", "length", 1609.344),
        (" ft ", "length", 0.3048),
        ("0.01 h", "time", 36.0),
        ("3 s", "time", 3.0),
        ("mph", "speed", 0.44704),
        ("mi/h", "speed", 0.44704),
        ("ft/min", "speed", 0.00508),
        ("km/h", "speed", 1 / 3.6),
        ("veh/h", "capacity", 1 / 3600),
        ("10 veh/day", "capacity", 1 / 8640),
    ],
)
def test_units_and_multiples(text: str, quantity: Quantity, factor: float) -> None:
    unit = parse_unit(text, quantity)
    assert unit.factor == pytest.approx(factor, rel=1e-15)
    assert not unit.per_lane


def test_capacity_may_be_that_of_a_lane() -> None:
    assert parse_unit("veh/h/lane", "capacity") == Unit(1 / 3600, per_lane=True)


@pytest.mark.parametrize(
    ("text", "quantity"),
    [("", "time"), ("sec", "time"), ("-1 h", "time"), ("nan h", "time"), ("x h", "time"),
     ("0 m", "length"), ("km/lane", "length"), ("m/s/lane", "speed"), ("1.5", "length")],
)  # fmt: skip
def test_what_is_no_unit_names_those_that_are(text: str, quantity: Quantity) -> None:
    with pytest.raises(ValueError, match=f"is not a unit of {quantity}: write one of"):
        parse_unit(text, quantity)

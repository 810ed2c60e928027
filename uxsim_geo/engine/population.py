"""Who drives: classes of drivers, parted into those who see, pay and follow the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uxsim_geo.control.drivers import DEFAULT, DriverClass
from uxsim_geo.demand.platoons import Ints, Platoons
from uxsim_geo.draws import COMPLIANCE, INFORMED, Keys, combine, text_keys, unit
from uxsim_geo.engine import records
from uxsim_geo.errors import Faults
from uxsim_geo.settings import Settings

_UPDATES_IF_GRADUAL = 10  # in place of one
_HOUR = 3600.0  # s
_KM = 1000.0  # m


@dataclass(frozen=True)
class Drivers:
    """Drivers of one class who do or do not see the traffic, and follow advice or not.

    ``cost_per_currency`` in s, ``cost_per_metre`` in s/m.
    """

    class_number: int
    informed: bool
    compliant: bool
    toll_factor: float
    cost_per_currency: float
    cost_per_metre: float


def complete_classes(classes: Sequence[DriverClass], faults: Faults) -> list[DriverClass]:
    """Check the classes, and put the default before them where they leave it out.

    Faults name classes by their number, as line, from 1.
    """
    names = [one.name for one in classes]
    for number, one in enumerate(classes, start=1):
        own = Faults()
        one.add_faults(own)
        faults.add_of_entry(number, own)
        if one.name in names[: number - 1]:
            faults.add("the class is given twice", line=number, column="name", value=one.name)
    missing = [] if DEFAULT in names else [DriverClass()]
    return [*missing, *classes]


def part_into_drivers(classes: Sequence[DriverClass]) -> list[Drivers]:
    """Part every class by what its members see and follow, where there are such members."""
    return [
        Drivers(
            class_number=number,
            informed=informed,
            compliant=compliant,
            toll_factor=one.toll_factor,
            cost_per_currency=_HOUR / one.value_of_time,
            cost_per_metre=one.distance_cost / _KM * _HOUR / one.value_of_time,
        )
        for number, one in enumerate(classes)
        for informed in _halves(one.informed_share)
        for compliant in _halves(one.compliance)
    ]


def _halves(share: float) -> tuple[bool, ...]:
    return (True,) if share >= 1 else (False,) if share <= 0 else (True, False)


@np.errstate(over="ignore")  # hashes overflow by design
def drivers_of_platoons(
    drivers: Sequence[Drivers], classes: Sequence[DriverClass], platoons: Platoons
) -> Ints:
    """Draw to which drivers every platoon belongs; shape (platoons,)."""
    position = {one.name: number for number, one in enumerate(classes)}
    number_of_code = np.array([position[name] for name in platoons.class_names], np.int64)
    own_class = number_of_code[platoons.driver_class]
    informed = _belongs([one.informed_share for one in classes], own_class, platoons.key, INFORMED)
    follows = _belongs([one.compliance for one in classes], own_class, platoons.key, COMPLIANCE)
    table = np.zeros((len(classes), 2, 2), np.int64)
    for number, one in enumerate(drivers):
        table[one.class_number, int(one.informed), int(one.compliant)] = number
    drawn: Ints = table[own_class, informed.astype(int), follows.astype(int)]
    return drawn


def _belongs(
    shares: list[float], own_class: Ints, keys: Keys, purpose: np.uint64
) -> npt.NDArray[np.bool_]:
    chance = unit(combine(keys, purpose))
    drawn: npt.NDArray[np.bool_] = chance < np.array(shares)[own_class]
    return drawn


@np.errstate(over="ignore")
def driver_records(
    drivers: Sequence[Drivers], classes: Sequence[DriverClass], settings: Settings
) -> npt.NDArray[np.void]:
    """Make the records of the engine; their rows of observed times follow one another."""
    table = np.zeros(len(drivers), records.DRIVER)
    seed = np.uint64(settings.seed)
    parts = _UPDATES_IF_GRADUAL if settings.route_update_gradual else 1
    row = 0
    for record, one in zip(table, drivers, strict=True):
        own = classes[one.class_number]
        interval = own.information_interval or settings.route_update_interval
        record["key"] = seed
        if own.name != DEFAULT:
            record["key"] = combine(seed, text_keys([own.name])[0])
        # at most one update a step; its small parts may fall into the same step
        record["interval"] = max(interval, settings.step) / parts
        record["observe_step"] = records.NEVER
        if one.informed:
            delay = min(own.information_delay, settings.duration)  # older than the run is none
            record["delay"] = delay
            record["observe_step"] = 0
            record["first_row"] = row
            kept = delay + settings.step  # s: looks not yet used, or of this step
            record["rows"] = int(kept / record["interval"]) + 2
            row += int(record["rows"])
    return table


def weight_of_update(settings: Settings) -> float:
    """Return λ, or that of the small steps which together weigh the same."""
    if not settings.route_update_gradual:
        return settings.route_update_weight
    return float(1 - (1 - settings.route_update_weight) ** (1 / _UPDATES_IF_GRADUAL))

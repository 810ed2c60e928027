"""Dynamic traffic simulation on network tables: read, simulate, derive, write.

The parts most used are here by name; each is imported when it is asked for, since some of them
take a while.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from uxsim_geo.control.drivers import DriverClass
    from uxsim_geo.control.site import Measure
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.errors import InputError
    from uxsim_geo.export.page.inline import explore
    from uxsim_geo.machine import Machine
    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Progress, Result
    from uxsim_geo.settings import Settings
    from uxsim_geo.version import __version__
    from uxsim_geo.world.world import World

__all__ = [
    "Demand",
    "InputError",
    "Machine",
    "Network",
    "Result",
    "Settings",
    "World",
    "__version__",
    "explore",
    "simulate",
]

_HOMES = {
    "Demand": "demand.demand",
    "InputError": "errors",
    "Machine": "machine",
    "Network": "network.network",
    "Result": "result",
    "Settings": "settings",
    "World": "world.world",
    "__version__": "version",
    "explore": "export.page.inline",
}


def simulate(  # noqa: PLR0913 -- the arguments of the engine
    network: Network,
    demand: Demand,
    settings: Settings,
    *,
    control: Sequence[Measure] = (),
    classes: Sequence[DriverClass] = (),
    progress: Callable[[Progress], None] | None = None,
    events_file: str | Path | None = None,
    sleep: bool = True,
    machine: Machine | None = None,
) -> Result:
    """Simulate a demand on a network until ``settings.duration``, under some measures of control.

    ``control`` are measures of ``uxsim_geo.control``; ``classes`` the classes of drivers that the
    demand names. ``progress`` is called about a hundred times with the state of the run.
    ``events_file`` is a Parquet file for the events: they go there while the run goes on, and the
    result reads them from there (None: they are kept in memory). It appears at the end.
    ``sleep`` lets blocked platoons rest until something can change for them; False tries them
    again in every step, which is slower and gives the same result, to the bit. ``machine`` says
    how much of this machine the run may use, on which no result depends.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong with the tables, or with the
    control, and where the run would need more memory than there is.
    """
    # the engine waits for the first call, so that importing every name from here stays light
    from uxsim_geo.engine import simulation

    return simulation.simulate(
        network,
        demand,
        settings,
        control=control,
        classes=classes,
        progress=progress,
        events_file=events_file,
        sleep=sleep,
        machine=machine,
    )


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__

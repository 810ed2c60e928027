"""Dynamic traffic simulation on network tables: read, simulate, derive, write.

The parts most used are here by name; each is imported when it is asked for, since some of them
take a while.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.engine.simulation import simulate
    from uxsim_geo.errors import InputError
    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result
    from uxsim_geo.settings import Settings
    from uxsim_geo.version import __version__
    from uxsim_geo.world.world import World

__all__ = [
    "Demand",
    "InputError",
    "Network",
    "Result",
    "Settings",
    "World",
    "__version__",
    "simulate",
]

_HOMES = {
    "Demand": "demand.demand",
    "InputError": "errors",
    "Network": "network.network",
    "Result": "result",
    "Settings": "settings",
    "World": "world.world",
    "__version__": "version",
    "simulate": "engine.simulation",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__

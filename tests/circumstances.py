"""What a process may find itself in: a clock that jumps, no network, files that cannot grow.

Each function is called in a process before its command (``prepare`` of deaths.Nurse.run).
"""

from __future__ import annotations

import datetime as clocks
import itertools
import resource
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from typing import Any, Self

#: s after 1970; each is asked for once, over and over: back, forth, and far away
_JUMPS = (1.7e9, 1.7e9 - 86_400, 0.0, 4.0e9, 1.6e9, 1.7e9 + 3.3)

#: how Python tells of what leads to others, or lets them in
_NETWORK = ("socket.connect", "socket.bind", "socket.getaddrinfo", "socket.gethostbyname")
_NETWORK = (*_NETWORK, "socket.sendto", "socket.sendmsg", "urllib.Request")


def jumping_clock() -> None:
    """Let the time of day jump whenever it is asked for."""
    _set_clock(itertools.cycle(_JUMPS))


def standing_clock() -> None:
    """Let it be the same time of day for ever."""
    _set_clock(itertools.repeat(1.7e9))


def _set_clock(moments: Iterator[float]) -> None:
    class Clock(clocks.datetime):
        @classmethod
        def now(cls, tz: clocks.tzinfo | None = None) -> Self:
            return cls.fromtimestamp(next(moments), tz)

    import_module("uxsim_geo.network.osm_download")  # the one that is not there from the start
    for module in [*sys.modules.values()]:
        if module.__name__.partition(".")[0] in ("pipeline", "uxsim_geo"):
            for name, value in vars(module).copy().items():
                if value is clocks.datetime:
                    setattr(module, name, Clock)
    time.time = lambda: next(moments)
    time.time_ns = lambda: int(next(moments) * 1e9)


def no_network() -> None:
    """End the command by an error as soon as it turns to the network."""

    def look(event: str, arguments: tuple[Any, ...]) -> None:
        if event in _NETWORK:
            raise RuntimeError(f"the network was asked for: {event} {arguments}")

    sys.addaudithook(look)


def small_files() -> None:
    """Let no file grow beyond 9,000 bytes: the system refuses, as where a disk is full."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, 9_000))

"""How much of this machine the environment lets a run use. It is no part of what a run is."""

from __future__ import annotations

import os
from collections.abc import Mapping

from uxsim_geo.errors import Faults
from uxsim_geo.machine import Machine

THREADS = "UXSIM_GEO_THREADS"
MEMORY = "UXSIM_GEO_MEMORY_GB"


def allowed_machine(environment: Mapping[str, str] | None = None) -> Machine:
    """Return what a run may use.

    Raises :class:`uxsim_geo.errors.InputError` where a variable is no such number.
    """
    told = os.environ if environment is None else environment
    faults = Faults("environment")
    threads, memory = (told.get(name, "").strip() for name in (THREADS, MEMORY))
    if threads and not (threads.isdecimal() and int(threads) > 0):
        faults.add("must be a whole number from 1, or empty", column=THREADS, value=threads)
    if memory and not _is_positive(memory):
        faults.add("must be a number of GB above 0, or empty", column=MEMORY, value=memory)
    faults.raise_if_any()
    return Machine(int(threads) if threads else None, float(memory) if memory else None)


def _is_positive(text: str) -> bool:
    try:
        return float(text) > 0
    except ValueError:
        return False


def one_thread_each() -> None:
    """Let runs of this process have one thread, for others run beside it, unless told otherwise."""
    os.environ.setdefault(THREADS, "1")

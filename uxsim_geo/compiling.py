"""How numba is used: what compiled code is called by, and what of it is kept."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.dispatcher import Dispatcher

from uxsim_geo.kept_code import KeptCode

Decorator = Callable[[Callable[..., Any]], Any]

#: sources on which compiled code everywhere depends
_SHARED = ("compiling.py", "draws.py")


def inner(**options: Any) -> Decorator:
    """Compile what only compiled code calls.

    Wrappers for Python, which it does not need, would double the time that compiling takes.
    """
    no_wrappers: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    decorate: Decorator = njit(**no_wrappers, **options)
    return decorate


def entry(sources: str, announced: str = "", **options: Any) -> Decorator:
    """Compile what Python calls, and keep the compiled code on disk for the next process.

    sources
        a digest of all that the code is compiled from: where it changes, the code is made anew
    announced
        what is compiled, in words for the user, who is told once where that takes its time

    Where no folder can be written to, it is compiled anew in every process.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        compiled = njit(**options)(function)
        if isinstance(compiled, Dispatcher):  # not where NUMBA_DISABLE_JIT leaves it as it is
            depends_on = (sources, *(f"{name}={options[name]}" for name in sorted(options)))
            kept = KeptCode(function, depends_on, announced)
            compiled._cache = kept  # type: ignore[attr-defined]
        return compiled

    return decorate


def digest_of_sources(*paths: Path) -> str:
    """SHA-256 over the sources that code is compiled from, and what all compiled code calls."""
    digest = hashlib.sha256()
    for path in (*paths, *(Path(__file__).with_name(name) for name in _SHARED)):
        digest.update(path.read_bytes())
    return digest.hexdigest()

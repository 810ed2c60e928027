"""How numba is used: what compiled code is called by, and where it is kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

Decorator = Callable[[Callable[..., Any]], Any]


def inner(**options: Any) -> Decorator:
    """Compile what only compiled code calls.

    Wrappers for Python, which it does not need, would double the time that compiling takes.
    """
    no_wrappers: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    decorate: Decorator = njit(**no_wrappers, **options)
    return decorate


def entry(**options: Any) -> Decorator:
    """Compile what Python calls, and keep the compiled code on disk for the next process.

    Where no folder can be written to, neither beside the source nor the user's own, it is
    compiled anew in every process.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            return njit(cache=True, **options)(function)
        except RuntimeError as error:
            if "cannot cache function" not in str(error):
                raise
            return njit(**options)(function)

    return decorate

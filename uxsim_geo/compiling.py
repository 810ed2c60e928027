"""How numba is used: what compiled code is called by, and what of it is kept."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import config
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

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


_IN_ALL_CACHES = 3  # of llvm.prefetch


def _code_of_fetch(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, values[0])
    word, pointer = ir.IntType(64), ir.IntType(8).as_pointer()
    size = context.get_abi_sizeof(context.get_data_type(signature.args[0].dtype))
    place = builder.mul(values[1], word(size))
    address = builder.add(builder.ptrtoint(array.data, word), builder.add(place, values[2]))
    flag = ir.IntType(32)
    told = ir.FunctionType(ir.VoidType(), [pointer, flag, flag, flag])
    fetch = builder.module.declare_intrinsic("llvm.prefetch", [pointer], told)
    pointed = builder.inttoptr(address, pointer)
    builder.call(fetch, [pointed, flag(0), flag(_IN_ALL_CACHES), flag(1)])
    return context.get_dummy_value()


@intrinsic
def _call_in(_: Any, array: Any, place: Any, offset: Any) -> Any:
    """Have the line of memory fetched with the byte at this offset of an item of an array."""
    del place, offset
    return types.none(array, types.int64, types.int64), _code_of_fetch


def _stay(*_: Any) -> None:
    """Do nothing, where nothing is compiled."""


call_in: Callable[..., None] = _stay if getattr(config, "DISABLE_JIT", 0) else _call_in

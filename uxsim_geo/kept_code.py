"""Compiled code on disk: made once, found again by every process.

Numba's own cache lies beside the source, which not every installation allows, keeps an index that
two processes may write at once, and stops at a damaged file. Here every piece of code is a file of
its own, whose name is a hash of all that the code depends on, so that programs and processes of any
versions use one folder.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle  # nosec B403 # see load_overload
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps

from uxsim_geo.files import replace_when_complete
from uxsim_geo.user_cache import user_cache

_FLAGS = ("OPT", "BOUNDSCHECK", "DEBUGINFO_DEFAULT")  # of numba, that change the code
_KEPT_FILES = 100  # those used last; a version of the library has about ten
_DIGEST_BYTES = hashlib.sha256().digest_size


def code_folder() -> Path:
    """Return the folder of compiled code: within numba's, where NUMBA_CACHE_DIR names one."""
    numbas = os.environ.get("NUMBA_CACHE_DIR")
    return Path(numbas).resolve() / "uxsim-geo" if numbas else user_cache() / "compiled"


class KeptCode(NullCache):
    """The compiled code of one function, in the way that numba asks a cache for it.

    depends_on
        what the code depends on besides types, processor and versions: its sources, and options
        of the compiler
    announced
        what is compiled, in words for the user who has to wait; none: nothing is said
    """

    def __init__(
        self, function: Callable[..., Any], depends_on: tuple[str, ...], announced: str
    ) -> None:
        self._name = function.__name__
        versions = (numba.__version__, sys.implementation.cache_tag)
        flags = (vars(config)[name] for name in _FLAGS)
        where = (function.__module__, function.__qualname__)
        self._depends_on = tuple(map(str, (*where, *versions, *flags, *depends_on)))
        self._announced = announced

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(code_folder())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for some types of arguments; None: it must be compiled.

        What is damaged, or was put there by another user, counts as if it were not there.
        """
        path = self._path(sig, target_context.codegen())
        content = _own_content(path)
        if content is not None:
            with suppress(Exception):  # whatever is wrong with it, compiling does as well
                # object code, which may do anything: whose it is has been seen
                parts = pickle.loads(content)  # noqa: S301  # nosec B301
                rtsys.initialize(target_context)  # the rest of numba is for compiling alone
                return CompileResult._rebuild(target_context, *parts)  # type: ignore[no-untyped-call]
        if self._announced:
            _announce(self._announced, path.parent)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, if that can be done."""
        if data.library.has_dynamic_globals:  # addresses that hold in this process alone
            return
        path = self._path(sig, data.codegen)
        content = dumps(data._reduce())  # type: ignore[no-untyped-call]
        with suppress(OSError):  # the next process compiles as this one did
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with replace_when_complete(path) as temporary:
                temporary.write_bytes(hashlib.sha256(content).digest() + content)
            _remove_unused(path.parent)

    def _path(self, sig: Any, codegen: Any) -> Path:
        parts = (*self._depends_on, str(sig), *map(str, codegen.magic_tuple()))
        key = hashlib.sha256("\n".join(parts).encode()).hexdigest()
        return code_folder() / f"{self._name}-{key[:32]}.code"


def _own_content(path: Path) -> bytes | None:
    """Read a file of this user's, or the system's, if it is there and whole, and note its use."""
    with suppress(OSError), path.open("rb") as file:
        if hasattr(os, "geteuid") and os.fstat(file.fileno()).st_uid not in (0, os.geteuid()):
            return None
        found = file.read()
        digest, content = found[:_DIGEST_BYTES], found[_DIGEST_BYTES:]
        if hashlib.sha256(content).digest() == digest:
            with suppress(OSError):
                os.utime(path)
            return content
    return None


def _remove_unused(folder: Path) -> None:
    """Remove all but the files that were used last; one more or less does not matter."""
    used = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    for path in sorted(used, key=used.__getitem__, reverse=True)[_KEPT_FILES:]:
        path.unlink(missing_ok=True)


@cache
def _announce(what: str, folder: Path) -> None:
    """Say, once a process, that the user has to wait.

    It is a warning since those are shown where nobody asks for logs.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        often = "once for this version"
    except OSError as error:
        often = f"in every process, since it cannot be kept in {folder} ({error.strerror})"
    logging.getLogger(__name__).warning("compiling %s, %s: about 15 s", what, often)

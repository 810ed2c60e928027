"""Files that appear under their name only when they are complete, and what tells them apart."""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

#: in the names of files and folders that are not complete
UNFINISHED = ".uxsim-geo.part"

#: so long, and in such steps, a lock is waited for that nobody holds for more than a moment, s
_PATIENCE_S, _STEP_S = 1.0, 0.001


@contextmanager
def replace_when_complete(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; at the end it takes that name, on failure it goes.

    The temporary name keeps the suffix, since writers choose their format by it. The folder must
    exist. A file already there stays as it was until the moment it is replaced.
    """
    temporary = unfinished(path)
    with at_work_in(path.parent):
        temporary.unlink(missing_ok=True)
        try:
            yield temporary
            os.replace(temporary, path)  # noqa: PTH105  atomic on every system, unlike a move
        finally:
            temporary.unlink(missing_ok=True)


def unfinished(path: Path) -> Path:
    """Return what a file or folder of this process is called until it is complete."""
    return path.with_name(f".{path.stem}{UNFINISHED}{os.getpid()}{path.suffix}")


def is_unfinished(path: Path) -> bool:
    """Tell whether a file or folder has no name of its own yet."""
    return path.name.startswith(".") and UNFINISHED in path.name


@contextmanager
def at_work_in(folder: Path, is_left: Callable[[Path], bool] = is_unfinished) -> Iterator[None]:
    """Remove what killed processes have left unfinished in a folder, before and after the block.

    All that work there share a lock of the folder, which the system takes from a process that
    ends, however it does. Who has it alone knows that what ``is_left`` tells is nobody's. Where
    the system has no such locks, nothing is removed.
    """
    descriptor = _opened(folder)
    if descriptor is None:
        yield
        return
    try:
        _sweep_if_alone(descriptor, folder, is_left)
        _share(descriptor)
        yield
    finally:
        # of several at work, the last to go is alone
        _sweep_if_alone(descriptor, folder, is_left)
        os.close(descriptor)


def _opened(folder: Path) -> int | None:
    """Open a folder to lock it; None where that cannot be."""
    try:
        import fcntl  # noqa: F401
    except ImportError:  # not a Unix
        return None
    try:
        return os.open(folder, os.O_RDONLY)
    except PermissionError:
        return None


def _sweep_if_alone(descriptor: int, folder: Path, is_left: Callable[[Path], bool]) -> None:
    """Remove what is left over, unless another one is at work."""
    import fcntl

    with suppress(OSError):  # somebody is at work, or this file system has no locks
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        for path in filter(is_left, list(folder.iterdir())):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def _share(descriptor: int) -> None:
    """Lock a folder together with others: who sweeps it has it alone for a moment.

    Who has it alone for longer is another program, which keeps all from sweeping.
    """
    import fcntl

    for _ in range(round(_PATIENCE_S / _STEP_S)):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(_STEP_S)
        except OSError:  # this file system has no locks
            return
        else:
            return


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's content, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

"""Processes that die at a moment which can be named: before a change of a folder, or within one.

A nurse imports the program once and forks a process for every command that it is given, which
takes some tenths of a second where a process of its own would take seconds. Such a process dies as
by ``kill -9``, without a chance to tidy up, when it is about to make its n-th change of a folder
(open a file to write, move, remove, link, make a folder); or the system ends it in the middle of
writing, when a file would grow beyond so many bytes, whatever library writes it.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import IO, Any

from conftest import REPOSITORY

#: what changes a folder, by the events that Python tells of, and where their paths stand
_CHANGES = {"os.rename": 2, "os.link": 2, "os.remove": 1, "os.mkdir": 1, "os.rmdir": 1}
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT


@dataclass(frozen=True)
class Moment:
    """When a process is to die.

    change
        before which change of the folder, counted from 1; 0: never
    size
        when a file would grow beyond so many bytes; 0: never
    """

    change: int = 0
    size: int = 0


NEVER = Moment()


@dataclass(frozen=True)
class End:
    """How a process ended: its status (negative: the signal), how many changes it had begun."""

    status: int
    changes: int
    said: str

    @property
    def died(self) -> bool:
        return self.status in (-signal.SIGKILL, -signal.SIGXFSZ)


@dataclass(frozen=True)
class Nurse:
    """A process that runs commands in processes of their own."""

    process: subprocess.Popen[str]
    folder: Path

    def run(self, arguments: Sequence[str], moment: Moment = NEVER, **others: Any) -> End:
        """Run a command of the program to its end, or its death.

        ``others``: ``prepare`` names a function here or elsewhere (``module:name``), which the
        process calls first; ``environment`` is added to its own.
        """
        said, counted = self.folder / "said", self.folder / "counted"
        counted.write_bytes(b"")
        order = {
            "arguments": list(arguments),
            "change": moment.change,
            "size": moment.size,
            "watched": str(self.folder / "work"),
            "said": str(said),
            "counted": str(counted),
            **others,
        }
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()
        status = int(self.process.stdout.readline())
        return End(status, counted.stat().st_size, said.read_text(encoding="utf-8"))


@contextmanager
def nursing(folder: Path) -> Iterator[Nurse]:
    """A nurse whose commands work in ``<folder>/work``, until the end of the block."""
    paths = os.pathsep.join([str(REPOSITORY), str(REPOSITORY / "tests")])
    process = subprocess.Popen(
        [sys.executable, "-c", "import deaths; deaths.serve()"],
        cwd=REPOSITORY,
        env={**os.environ, "PYTHONPATH": paths},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield Nurse(process, folder)
    finally:
        process.communicate()  # the end of its orders ends it


def serve() -> None:
    """Be a nurse: an order a line, a status a line."""
    _import_all()
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for line in sys.stdin:
        order = json.loads(line)
        child = os.fork()
        if child == 0:
            os._exit(_obey(order))
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), file=answers, flush=True)


def _import_all() -> None:
    """Load what takes long, the engine in machine code too; nothing here may begin a thread."""
    for module in ("pyogrio", "pipeline.report", "pipeline.study", "uxsim_geo.export.geopackage"):
        import_module(module)
    import_module("pipeline.study_jobs").warm_up()


def _obey(order: dict[str, Any]) -> int:
    """Run a command in the way that it was ordered."""
    from pipeline.cli import main

    os.environ.update(order.get("environment", {}))
    said = Path(order["said"]).open("w", encoding="utf-8")  # noqa: SIM115  until the end
    os.dup2(said.fileno(), 1)
    os.dup2(said.fileno(), 2)
    sys.stdout = sys.stderr = said
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if order.get("prepare"):
        module, _, name = order["prepare"].partition(":")
        getattr(import_module(module), name)()
    counted = Path(order["counted"]).open("ab", buffering=0)  # noqa: SIM115  until the end
    die_before(order["change"], order["watched"], counted)
    if order["size"]:
        die_beyond(order["size"])
    try:
        return main(order["arguments"])
    finally:
        said.flush()


def die_beyond(size: int) -> None:
    """Let the system end this process when a file of it grows beyond so many bytes."""
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)  # Python ignores it, and raises errors
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def die_before(number: int, folder: str, counted: IO[bytes]) -> None:
    """Kill this process before it makes its n-th change below a folder; count those begun."""
    begun = 0

    def look(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal begun
        if _is_change(event, arguments, folder):
            begun += 1
            if begun == number:
                os.kill(os.getpid(), signal.SIGKILL)
            os.write(counted.fileno(), b".")

    sys.addaudithook(look)


def _is_change(event: str, arguments: tuple[Any, ...], folder: str) -> bool:
    if event == "open":
        path, _, flags = arguments
        return bool(flags & _WRITING) and _is_below(path, folder)
    if event == "sqlite3.connect":
        return _is_below(arguments[0], folder)
    paths = arguments[: _CHANGES.get(event, 0)]
    return any(_is_below(path, folder) for path in paths)


def _is_below(path: object, folder: str) -> bool:
    if isinstance(path, bytes):
        path = os.fsdecode(path)
    if not isinstance(path, (str, os.PathLike)):
        return False
    # what is relative is relative to an open folder, as trees are removed
    return not Path(path).is_absolute() or os.fspath(path).startswith(folder)

"""Runs in turns, each in a process of its own, within limits of time and memory."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from measuring import MB

LOOK = 0.1  # s between two looks at a run


class Engine(NamedTuple):
    """How an engine is run: interpreter, the program beside this one, and its options."""

    name: str
    python: str
    program: str
    options: dict[str, Any]


@dataclass(frozen=True)
class Limits:
    """Of one run: s and MB; and s for all of an engine's runs of a case together."""

    seconds: float
    memory: float
    together: float


class NoFiguresError(Exception):
    """A run that gave no figures; says why."""


def run_in_turns(
    folder: Path,
    engines: Sequence[Engine],
    rounds: int,
    limits: Limits,
    tell: Callable[[str], None],
) -> list[dict[str, Any]]:
    """Run a case by engine A, B, C, A, B, C ...; gives a record for each run.

    A record has engine, round and figures, or reason, where there are none; an engine that gave
    none, or has used up its time, is not run again.
    """
    records: list[dict[str, Any]] = []
    used = {engine.name: 0.0 for engine in engines}
    for number in range(rounds):
        for engine in engines:
            if used[engine.name] >= limits.together:
                continue
            record: dict[str, Any] = {"engine": engine.name, "round": number}
            started = time.perf_counter()
            try:
                record["figures"] = run_once(folder, engine, number, limits)
            except NoFiguresError as why:
                record["reason"] = str(why)
                used[engine.name] = float("inf")
            used[engine.name] += time.perf_counter() - started
            records.append(record)
            tell(_line(record))
    return records


def _line(record: dict[str, Any]) -> str:
    head = f"  {record['round'] + 1} {record['engine']:<18}"
    if "reason" in record:
        return head + record["reason"]
    return head + "  ".join(f"{name} {value:.4g}" for name, value in record["figures"].items())


def run_once(folder: Path, engine: Engine, seed: int, limits: Limits) -> dict[str, float]:
    """Run a case once, in a process of its own; gives its figures.

    Raises :class:`NoFiguresError` with the reason where there are none.
    """
    program = Path(__file__).parent / engine.program
    options = json.dumps(engine.options | {"seed": seed})
    command = [engine.python, str(program), str(folder), options]
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as complaint:
        process = subprocess.Popen(command, stdout=said, stderr=complaint, start_new_session=True)
        try:
            _watch(process, limits)
        finally:
            _end(process)
        said.seek(0)
        complaint.seek(0)
        lines = said.read().splitlines()
        if process.returncode or not lines:
            raise NoFiguresError((complaint.read().splitlines() or ["no figures"])[-1])
    figures: dict[str, float] = json.loads(lines[-1])
    if "entries" in figures:
        figures["entry_ns"] = figures["engine_s"] / max(figures["entries"], 1) * 1e9
    return figures


def _watch(process: subprocess.Popen[bytes], limits: Limits) -> None:
    """Wait for the end of a run; raises where it goes beyond a limit."""
    ends = time.perf_counter() + limits.seconds
    while process.poll() is None:
        if time.perf_counter() > ends:
            raise NoFiguresError(f"stopped: more than {limits.seconds:g} s")
        if _memory(process.pid) > limits.memory:
            raise NoFiguresError(f"stopped: more than {limits.memory / 1000:g} GB")
        time.sleep(LOOK)


def _memory(process: int) -> float:
    """Memory of a process, MB; 0 where the system does not say."""
    if sys.platform != "linux":
        return 0.0
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    except OSError:  # it has just ended
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / MB


def _end(process: subprocess.Popen[bytes]) -> None:
    """End what is left of a run, and what it has started: they are a session of their own."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()

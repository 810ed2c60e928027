"""Runs of a study by processes on this machine; one that is lost is replaced, its runs redone."""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from types import TracebackType
from typing import Self

from pipeline.allowance import one_thread_each
from pipeline.study_jobs import Job, Report, lost, run_job, warm_up

#: runs of the same content, one after the other: the first fills the store for the others
Group = Sequence[Job]

#: what is done with a job
Work = Callable[[Job], Report]

#: so often a run is given to a process among others; once more it is run alone
ATTEMPTS = 3

#: how long a process may take to end by itself, s
PATIENCE_S = 10.0


class Here:
    """Runs one after the other in this process."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        """Nothing to put away."""

    def run(self, groups: Iterable[Group]) -> Iterator[Report]:
        """Do all runs; yield a report of each when it is done."""
        for group in groups:
            for job in group:
                yield run_job(job)


@dataclass
class _Work:
    """Runs that one process does in turn; ``attempts`` count for the first of them."""

    jobs: deque[Job]
    attempts: int = 0


@dataclass
class _Worker:
    """A process, the pipe to it, and what it is doing; ``warming`` while it loads the engine."""

    process: multiprocessing.process.BaseProcess
    connection: Connection
    work: _Work | None = None
    warming: bool = False


@dataclass
class Processes:
    """Runs spread over processes, which start (and load the engine) as soon as this is entered.

    ``work``, a function of a module, is what they do with a job.
    """

    number: int
    work: Work = run_job
    workers: list[_Worker] = field(default_factory=list)

    def __enter__(self) -> Self:
        self.workers = [_start(self.work) for _ in range(self.number)]
        # the first compiles what is not compiled yet, the others read it when they begin
        self._warm(self.workers[0])
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End the processes: at once after an error; files that are half written have no name."""
        for worker in self.workers:
            worker.connection.close()
            if kind is not None or worker.work is not None or worker.warming:
                worker.process.terminate()
        for worker in self.workers:
            worker.process.join(PATIENCE_S)
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()

    def run(self, groups: Iterable[Group]) -> Iterator[Report]:
        """Do all runs; yield a report of each when it is done."""
        waiting = deque(_Work(deque(group)) for group in groups if group)
        alone: deque[_Work] = deque()
        while waiting or alone or self._busy():
            self._hand_out(waiting, alone)
            by_connection = {w.connection: w for w in self.workers if w.work or w.warming}
            for ready in wait(list(by_connection)):
                worker = by_connection[ready]  # type: ignore[index]
                try:
                    message = worker.connection.recv()
                except (EOFError, OSError):
                    yield from self._replace(worker, waiting, alone)
                    continue
                if worker.warming:
                    worker.warming = False
                    continue
                yield message
                _next_run(worker)

    def _busy(self) -> bool:
        return any(worker.work for worker in self.workers)

    def _hand_out(self, waiting: deque[_Work], alone: deque[_Work]) -> None:
        """Give work to those without, when the engine is compiled."""
        if any(worker.warming for worker in self.workers):
            return
        idle = [worker for worker in self.workers if worker.work is None]
        while idle and waiting:
            _begin(idle.pop(), waiting.popleft())
        if alone and len(idle) == len(self.workers):
            _begin(idle.pop(), alone.popleft())

    def _replace(
        self, worker: _Worker, waiting: deque[_Work], alone: deque[_Work]
    ) -> Iterator[Report]:
        """Put a new process in the place of one that is lost, and its work back in the queue."""
        worker.process.join()
        new = _start(self.work)
        self.workers[self.workers.index(worker)] = new
        work = worker.work
        if work is None:
            return
        work.attempts += 1
        if work.attempts > ATTEMPTS:
            yield lost(work.jobs.popleft(), _why(worker.process.exitcode))
            work.attempts = 0
        if work.jobs:
            (alone if work.attempts == ATTEMPTS else waiting).appendleft(work)

    def _warm(self, worker: _Worker) -> None:
        worker.warming = True
        with suppress(OSError):  # it is lost: seen when its answer is waited for
            worker.connection.send(None)


def _start(work: Work) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(there, work), daemon=True)
    process.start()
    there.close()  # so that the end of the process ends the pipe
    return _Worker(process, here)


def _serve(connection: Connection, work: Work) -> None:
    """Do what comes through the pipe, to its end; the process that started this one is told."""
    # Ctrl-C reaches all processes of a terminal: the study ends the others
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    one_thread_each()
    with suppress(EOFError, OSError):
        while True:
            job: Job | None = connection.recv()
            if job is None:
                warm_up()
                connection.send(None)
            else:
                connection.send(work(job))


def _begin(worker: _Worker, work: _Work) -> None:
    worker.work = work
    with suppress(OSError):  # it is lost: seen when its answer is waited for
        worker.connection.send(work.jobs[0])


def _next_run(worker: _Worker) -> None:
    """Take note that a run is done, and go on with the next of the same work."""
    work = worker.work
    assert work is not None
    work.jobs.popleft()
    work.attempts = 0
    worker.work = None
    if work.jobs:
        _begin(worker, work)


def _why(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return f"signal {-exit_code}; out of memory?"
    return f"exit status {exit_code}"

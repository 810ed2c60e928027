"""Runs of a study by Dask: on a cluster of this machine, or by a scheduler somewhere."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from pipeline.allowance import one_thread_each
from pipeline.study_jobs import Job, Report, lost, run_job, warm_up
from pipeline.study_processes import Group
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    from distributed import Client, Future

#: how long to wait for a scheduler and its first worker, s
PATIENCE_S = 60

#: so often Dask redoes what a lost worker was doing
REDONE = 2


@dataclass
class Dask:
    """Runs as tasks of a Dask cluster.

    address
        of a scheduler; None: a cluster on this machine
    workers
        processes of that cluster
    """

    address: str | None
    workers: int
    client: Client | None = None

    def __enter__(self) -> Self:
        self.client = _client(self.address, self.workers)
        try:
            self._warm_up()
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, *error: object) -> None:
        """Leave the scheduler; what it has not begun is not begun any more."""
        self._close()

    def run(self, groups: Iterable[Group]) -> Iterator[Report]:
        """Do all runs; yield a report of each when it is done."""
        waiting = [group for group in groups if group]
        alone: list[Group] = []
        yield from self._done(waiting, alone)
        for group in alone:
            left: list[Group] = []
            yield from self._done([group], left)
            for jobs in left:
                yield from (lost(job, "its worker was lost") for job in jobs)

    def _done(self, groups: Sequence[Group], killed: list[Group]) -> Iterator[Report]:
        """Yield reports of groups; those whose workers were lost too often go to ``killed``."""
        from distributed import as_completed
        from distributed.scheduler import KilledWorker

        assert self.client is not None
        futures: dict[Future, Group] = {
            self.client.submit(_run_group, tuple(group), pure=False, retries=0): group
            for group in groups
        }
        try:
            for future in as_completed(futures):
                if future.status == "finished":
                    yield from future.result()
                elif isinstance(error := future.exception(), KilledWorker):
                    killed.append(futures[future])
                else:
                    yield from (lost(job, f"Dask: {error}") for job in futures[future])
        finally:
            self.client.cancel([future for future in futures if not future.done()])

    def _warm_up(self) -> None:
        """Load the engine on one worker of every machine: each keeps what is compiled there."""
        assert self.client is not None
        by_host = {worker["host"]: address for address, worker in self._infos().items()}
        warmed = [
            self.client.submit(warm_up, workers=[address], pure=False)
            for address in by_host.values()
        ]
        self.client.gather(warmed)

    def _infos(self) -> dict[str, Any]:
        assert self.client is not None
        found: dict[str, Any] = self.client.scheduler_info(n_workers=-1)["workers"]
        return found

    def _close(self) -> None:
        client, self.client = self.client, None
        if client is not None:
            client.close()
            if client.cluster is not None:
                client.cluster.close()


def _run_group(jobs: Sequence[Job]) -> list[Report]:
    one_thread_each()
    return [run_job(job) for job in jobs]


def _client(address: str | None, workers: int) -> Client:
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        what = "Dask is not installed: pip install 'uxsim-geo[dask]', or take processes"
        raise InputError([Fault(what, "scheduler")]) from None
    dask.config.set({"distributed.scheduler.allowed-failures": REDONE})
    try:
        if address is None:
            cluster = LocalCluster(
                n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
            )
            client = Client(cluster)
        else:
            client = Client(address, timeout=PATIENCE_S)
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except (OSError, TimeoutError, ValueError, TypeError) as error:  # TypeError: no certificate
        what = f"no Dask cluster with workers there: {error}"
        raise InputError([Fault(what, "scheduler", value=address)]) from None
    return client

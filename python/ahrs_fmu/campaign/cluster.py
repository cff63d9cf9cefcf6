"""Workers: processes or threads of this machine, or a running Dask cluster."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from ahrs_fmu.campaign import requirements, worker
from ahrs_fmu.errors import SimulationError

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""The matrices are small: more threads than one only wait for each other."""

_LOCAL = "127.0.0.1:0"
CONNECTING = 15.0
"""How long a scheduler has to answer, s."""

Task = TypeVar("Task")
Answer = TypeVar("Answer")


@dataclass(frozen=True, slots=True)
class Done(Generic[Task, Answer]):
    """A task that has ended: with an answer, or because its worker died."""

    task: Task
    answer: Answer | None


class Cluster:
    """Workers that run tasks; see `connected`."""

    def __init__(self, distributed: Any, client: Any) -> None:
        self._distributed, self._client = distributed, client

    @property
    def workers(self) -> int:
        """Number of tasks that run at the same time, at least 1."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def run(
        self, function: Callable[[Task], Answer], next_task: Callable[[], Task | None], ahead: int
    ) -> Iterator[Done[Task, Answer]]:
        """Run tasks, and give each when it has ended.

        Parameters
        ----------
        function : callable
            Runs a task on a worker.
        next_task : callable
            Gives the next task when a worker will want one; None when there are no more.
        ahead : int
            How many tasks are handed out at a time.

        Raises
        ------
        Exception
            What `function` raised.
        """
        killed = self._distributed.scheduler.KilledWorker
        tasks: dict[str, Task] = {}
        futures = self._distributed.as_completed(loop=self._client.loop, raise_errors=False)

        def hand_out() -> None:
            while len(tasks) < ahead and (task := next_task()) is not None:
                future = self._client.submit(function, task, pure=False)
                tasks[future.key] = task
                futures.add(future)

        hand_out()
        for future in futures:
            task = tasks.pop(future.key)
            error = future.exception()
            if error is not None and not isinstance(error, killed):
                raise error
            yield Done(task, None if error is not None else future.result())
            hand_out()

    def close(self) -> None:
        """Free what the tasks left open on the workers."""
        self._client.run(worker.close, on_error="ignore")


@contextmanager
def connected(workers: int, *, threads: bool = False, scheduler: str | None = None) -> Iterator[Cluster]:
    """Start workers on this machine, or use those of a running cluster.

    Parameters
    ----------
    workers : int
        How many to start.
    threads : bool
        Threads of this process instead of processes.
    scheduler : str, optional
        Address of a running Dask scheduler, such as ``tcp://host:8786``, whose workers are used instead.

    Raises
    ------
    MissingExtraError
        If Dask is not installed.
    SimulationError
        If there is no scheduler at that address.
    """
    distributed = requirements.require("distributed")
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout=CONNECTING, set_as_default=False)
        except (OSError, ValueError) as error:
            raise SimulationError(f"no Dask scheduler answers at {scheduler}: {error}") from None
        with client:
            yield from _used(distributed, client)
        return
    with (
        distributed.LocalCluster(
            n_workers=1 if threads else workers,
            threads_per_worker=workers if threads else 1,
            processes=not threads,
            memory_limit=None,
            # Nobody else is to see it, nor to be in its way.
            dashboard_address=_LOCAL,
            worker_dashboard_address=_LOCAL,
            silence_logs=logging.CRITICAL,
            # A task whose process died comes back at once: the caller will not try it again as it is.
            scheduler_kwargs={"allowed_failures": 0},
            **({} if threads else {"env": ONE_THREAD, "preload": [worker.__name__]}),
        ) as local,
        distributed.Client(local, set_as_default=False) as client,
    ):
        yield from _used(distributed, client)


def _used(distributed: Any, client: Any) -> Iterator[Cluster]:
    cluster = Cluster(distributed, client)
    try:
        yield cluster
    finally:
        cluster.close()

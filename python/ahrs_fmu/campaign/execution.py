"""Running a campaign: what is known already is kept, the rest goes to the workers in chunks.

A chunk is as large as it takes for its run time to be long against what handing it out costs, and short
against the whole, so that little is lost when a campaign is killed. A chunk whose worker died is run again
case by case, and a case that brings down its worker alone is recorded as failed.
"""

from __future__ import annotations

import math
import os
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ahrs_fmu.campaign import worker
from ahrs_fmu.campaign.cluster import Cluster, connected
from ahrs_fmu.campaign.plan import Campaign, PlannedCase
from ahrs_fmu.campaign.results import CaseResult, Results
from ahrs_fmu.campaign.store import Store
from ahrs_fmu.campaign.worker import Chunk
from ahrs_fmu.cosim import running
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.scenario import ScenarioFile
from ahrs_fmu.errors import AhrsError, ScenarioError

_AHEAD = 2
"""Chunks per worker that are handed out, so that none waits for the next."""
_LEAST_CHUNK, _LARGEST_CHUNK = 1.0, 60.0
"""Run time of a chunk, s."""
_CHUNK_OF_ALL = 0.02
"""Run time of a chunk as a part of the time since the start."""
_TRIED = 20
"""Cases of a scenario that are put together beforehand, of which one has to fit."""

DIED = "the process that ran this case died"
"""What is told of a case that brings down its worker."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is.

    Attributes
    ----------
    known : int
        Cases whose results were there at the start.
    done : int
        Cases run since.
    total : int
    passed : int
        Of all cases whose results are there.
    """

    known: int
    done: int
    total: int
    passed: int


def run(
    campaign: Campaign,
    output: str | Path,
    *,
    workers: int | None = None,
    threads: bool = False,
    scheduler: str | None = None,
    fresh: bool = False,
    progress: Callable[[Progress], None] = lambda _: None,
) -> Results:
    """Run the cases of a campaign whose results are not there yet.

    Parameters
    ----------
    campaign : Campaign
        See `ahrs_fmu.campaign.read`.
    output : path
        Folder of the results; each chunk adds a file to it, and when all are there the table
        ``results.parquet``.
    workers : int, optional
        How many; by default one for every processor.
    threads : bool
        Threads of this process instead of processes: they start faster and share a processor in Python code.
    scheduler : str, optional
        Address of a running Dask scheduler whose workers are used instead. They need this package, and see
        files that scenarios name under the same path.
    fresh : bool
        Remove the results that are there first.
    progress : callable, optional
        Called at the start and after every chunk.

    Returns
    -------
    Results
        A case in which a component failed is among them.

    Raises
    ------
    ScenarioError
        If no case of a scenario can be put together, or another process writes to `output`.
    SimulationError
        If there is no scheduler at that address.
    MissingExtraError
        If a package of the extra ``campaign`` is not installed.
    """
    store = Store(Path(output))
    with store.locked():
        if fresh:
            store.clear()
        found = store.known(case.key for case in campaign.cases)
        missing = [case for case in campaign.cases if case.key not in found]
        at = Progress(len(found), 0, len(campaign.cases), sum(result.passed for result in found.values()))
        progress(at)
        if missing:
            _check(campaign, missing)
            with connected(workers or os.cpu_count() or 1, threads=threads, scheduler=scheduler) as cluster:
                _Run(campaign, store, found, progress, at).all_of(missing, cluster)
        results = Results(campaign, [found[case.key] for case in campaign.cases])
        store.write_table(results)
    return results


class _Run:
    """The cases of one run, from the queue to the store."""

    def __init__(
        self,
        campaign: Campaign,
        store: Store,
        found: dict[str, CaseResult],
        progress: Callable[[Progress], None],
        at: Progress,
    ) -> None:
        self._campaign, self._store, self._found, self._progress, self._at = (
            campaign,
            store,
            found,
            progress,
            at,
        )
        self._began = time.perf_counter()
        self._busy = 0.0

    def all_of(self, cases: Sequence[PlannedCase], cluster: Cluster) -> None:
        """Run cases; those whose worker died at the end, one at a time, which tells who did it."""
        suspects: list[PlannedCase] = []
        waiting = deque(cases)
        ahead = _AHEAD * cluster.workers

        def chunk() -> Chunk | None:
            # The last chunks are small, so that all workers end at the same time.
            size = min(self._size(), math.ceil(len(waiting) / ahead))
            return self._chunk(_taken(waiting, size))

        for done in cluster.run(worker.run_chunk, chunk, ahead):
            if done.answer is None:
                suspects += done.task.cases
            else:
                self._keep(done.task, done.answer)
        waiting.extend(suspects)
        for done in cluster.run(worker.run_chunk, lambda: self._chunk(_taken(waiting, 1)), 1):
            died = [worker.failed(case, DIED, 0.0) for case in done.task.cases]
            self._keep(done.task, died if done.answer is None else done.answer)

    def _size(self) -> int:
        """How many cases make a chunk, by what those that are done took."""
        if not self._at.done:
            return 1
        elapsed = time.perf_counter() - self._began
        target = min(max(_LEAST_CHUNK, _CHUNK_OF_ALL * elapsed), _LARGEST_CHUNK)
        return max(1, round(target * self._at.done / max(self._busy, 1e-9)))

    def _chunk(self, cases: Sequence[PlannedCase]) -> Chunk | None:
        files = {case.file: self._campaign.scenarios[case.file] for case in cases}
        return Chunk(files, cases) if cases else None

    def _keep(self, chunk: Chunk, results: Sequence[CaseResult]) -> None:
        self._store.append(chunk.cases, results)
        self._found.update({result.key: result for result in results})
        self._busy += sum(result.runtime for result in results)
        passed = sum(result.passed for result in results)
        at = self._at
        self._at = Progress(at.known, at.done + len(results), at.total, at.passed + passed)
        self._progress(self._at)


def _taken(waiting: deque[PlannedCase], size: int) -> list[PlannedCase]:
    return [waiting.popleft() for _ in range(min(size, len(waiting)))]


def _check(campaign: Campaign, cases: Sequence[PlannedCase]) -> None:
    """Refuse a campaign in which a scenario cannot be put together, before a thousand cases say so."""
    with worker.borrowed() as instances:
        for index, file in enumerate(campaign.scenarios):
            first = ""
            for case in islice((case for case in cases if case.file == index), _TRIED):
                error = _misfit(case, file, instances)
                if not error:
                    break
                first = first or error
            else:
                if first:
                    raise ScenarioError(first)
    worker.close()


def _misfit(case: PlannedCase, file: ScenarioFile, instances: Instances) -> str:
    """Say what keeps a case from being put together; nothing if it can be."""
    made = file.case(case.changes, case.seed)
    try:
        system = running.assemble(made, instances, file.path.parent)
    except AhrsError as error:
        return str(error)
    try:
        for signal in running.signals_of(made.scenario):
            system.port(signal)
    except AhrsError as error:
        return f"{file.path.name}: {error}"
    return ""

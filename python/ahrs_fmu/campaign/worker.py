"""What a worker does: it runs chunks of cases, and keeps the components for the next chunk."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from ahrs_fmu.campaign.clauses import limit_used, statement
from ahrs_fmu.campaign.plan import PlannedCase
from ahrs_fmu.campaign.results import CaseResult, Measured
from ahrs_fmu.cosim import running
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.running import Outcome
from ahrs_fmu.cosim.scenario import ScenarioFile


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some cases and the scenario files that they are of, by index in the campaign."""

    files: Mapping[int, ScenarioFile]
    cases: Sequence[PlannedCase]


_IDLE: list[Instances] = []
"""Components of this process: as many sets as it has run chunks at the same time."""


def dask_setup(worker: object) -> None:  # noqa: ARG001
    """Leave Ctrl-C to the process that started this one; Dask calls it when the process starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_chunk(chunk: Chunk) -> list[CaseResult]:
    """Run cases one after the other; one that fails is a result like the others."""
    with borrowed() as instances:
        return [run_case(case, chunk.files[case.file], instances) for case in chunk.cases]


@contextmanager
def borrowed() -> Iterator[Instances]:
    """Give components of this process that nobody else uses meanwhile."""
    # Taking from a list and appending to it are one step each for all threads.
    try:
        instances = _IDLE.pop()
    except IndexError:
        instances = Instances()
    try:
        yield instances
    finally:
        _IDLE.append(instances)


def close() -> None:
    """Free what chunks left open in this process."""
    while _IDLE:
        _IDLE.pop().close()


def run_case(planned: PlannedCase, file: ScenarioFile, instances: Instances) -> CaseResult:
    """Run one case."""
    began = time.perf_counter()
    try:
        outcome = running.run(file.case(planned.changes, planned.seed), instances, file.path.parent)
    # Whatever goes wrong in a case is what came out of it, and no reason to lose the others.
    except Exception as error:
        failure = " ".join(str(error).split()) or type(error).__name__
        return failed(planned, failure, time.perf_counter() - began)
    if outcome.failure:
        return failed(planned, outcome.failure, time.perf_counter() - began)
    return _judged(planned, outcome, time.perf_counter() - began)


def failed(planned: PlannedCase, failure: str, runtime: float) -> CaseResult:
    """Make the result of a case that stopped."""
    return CaseResult(planned.key, False, failure, (), float("inf"), {}, runtime)


def _judged(planned: PlannedCase, outcome: Outcome, runtime: float) -> CaseResult:
    clauses = list(zip(outcome.case.scenario.expect, outcome.verdicts, strict=True))
    return CaseResult(
        planned.key,
        outcome.passed,
        "",
        tuple(statement(expectation) for expectation, verdict in clauses if not verdict.passed),
        max((limit_used(*clause) for clause in clauses), default=0.0),
        {verdict.clause: Measured(verdict.measured, verdict.unit) for _, verdict in clauses},
        runtime,
    )

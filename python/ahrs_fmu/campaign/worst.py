"""The worst cases of a campaign, run once more to see what happened."""

from __future__ import annotations

import io
import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from ahrs_fmu.campaign import worker
from ahrs_fmu.campaign.plan import PlannedCase
from ahrs_fmu.campaign.results import CaseResult, Results
from ahrs_fmu.cosim import running
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.plots import run_figure
from ahrs_fmu.cosim.scenario import ScenarioFile
from ahrs_fmu.errors import AhrsError

_DPI = 130


@dataclass(frozen=True, slots=True)
class WorstCase:
    """One of the worst cases.

    Attributes
    ----------
    rank : int
        1 for the worst.
    case : PlannedCase
    result : CaseResult
    command : str
        What repeats the case; empty where its scenario has no file of its own.
    picture : bytes
        PNG of the run; empty if there is nothing to draw.
    """

    rank: int
    case: PlannedCase
    result: CaseResult
    command: str
    picture: bytes


def run_again(results: Results, count: int) -> list[WorstCase]:
    """Run the worst cases and draw them, as different from each other as there are.

    Parameters
    ----------
    results : Results
    count : int
        How many.
    """
    try:
        with worker.borrowed() as instances:
            return [
                _worst_case(rank, case, result, results.campaign.scenarios[case.file], instances)
                for rank, (case, result) in enumerate(results.worst(count), start=1)
            ]
    finally:
        worker.close()


def _worst_case(
    rank: int, case: PlannedCase, result: CaseResult, file: ScenarioFile, instances: Instances
) -> WorstCase:
    return WorstCase(rank, case, result, _command(case, file), _picture(case, file, instances))


def _picture(case: PlannedCase, file: ScenarioFile, instances: Instances) -> bytes:
    try:
        outcome = running.run(file.case(case.changes, case.seed), instances, file.path.parent)
    except AhrsError:
        # What stopped it is told beside.
        return b""
    if len(outcome.recording) < 2:
        return b""
    stream = io.BytesIO()
    run_figure(outcome, case.label).savefig(stream, format="png", dpi=_DPI)
    return stream.getvalue()


def _command(case: PlannedCase, file: ScenarioFile) -> str:
    if not file.path.is_file():
        return ""
    changes = [f"{name}={_toml(value)}" for name, value in case.changes.items()]
    words = ["ahrs-fmu", "cosim", str(file.path), "--seed", str(case.seed), "--plot"]
    return shlex.join([*words, *(word for change in changes for word in ("--set", change))])


def _toml(value: object) -> str:
    """A value as TOML writes it, words without quotes."""
    if isinstance(value, str):
        return value
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(k)} = {_inner(v)}" for k, v in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(_inner, value)) + "]"
    return json.dumps(value, default=str)


def _inner(value: object) -> str:
    return json.dumps(value) if isinstance(value, str) else _toml(value)

"""What a measured response of an FMU and the noise of an hour's recording cost.

    python tests/bench/frequency.py

Processor time, children included, of the fastest of a few calls. The exit code is 1 when a limit is missed.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import partial
from io import StringIO
from pathlib import Path

import numpy as np

from ahrs_fmu import Record
from ahrs_fmu.analysis.sensor_noise import noise_of_imu, noise_of_record
from ahrs_fmu.analysis.simulate import sensors_at_rest
from ahrs_fmu.cli import main as ahrs_fmu
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.sensors import load

RATE = 200.0
"""Of the recording, Hz."""


@dataclass(frozen=True)
class Job:
    """Something that a person waits for."""

    name: str
    call: Callable[[], object]
    limit: float
    """Seconds."""
    repeats: int = 3


def seconds(call: Callable[[], object]) -> float:
    """Processor time of a call."""
    before = os.times()[:4]
    call()
    return sum(os.times()[:4]) - sum(before)


def bode(fmu: Path, *options: str) -> None:
    """Measure both paths of an FMU at thirty frequencies, as the command does."""
    with redirect_stdout(StringIO()):
        if ahrs_fmu(["bode", "--fmu", str(fmu), "--measure", *options]):
            raise RuntimeError(f"bode --fmu {fmu} failed")


def hour() -> Record:
    """A common sensor at rest for an hour."""
    sensor = noise_of_imu(load("mpu9250"), 1.0 / RATE)
    readings = sensors_at_rest(sensor, 1.0 / RATE, 3600.0, 1)
    return Record(time=np.arange(len(readings["gyro"])) / RATE, **readings)


def jobs(folder: Path) -> list[Job]:
    """What is timed."""
    compiled = build_fmu("gcf", fmi="3", output=folder)
    python = build_fmu("gcf", fmi="3", backend="python", output=folder / "python")
    at_once = ("--method", "multisine", "--amplitude", "1")
    return [
        Job("bode --measure, 30 frequencies, FMU", partial(bode, compiled), 20.0),
        Job("the same with --method multisine", partial(bode, compiled, *at_once), 10.0),
        Job("the same, FMU of the Python back-end", partial(bode, python, *at_once), 60.0, repeats=1),
        Job(f"noise of an hour at {RATE:.0f} Hz, nine signals", partial(noise_of_record, hour()), 10.0),
    ]


def main() -> int:
    """Print one line per job."""
    missed = False
    with tempfile.TemporaryDirectory() as scratch:
        for job in jobs(Path(scratch)):
            taken = min(seconds(job.call) for _ in range(job.repeats))
            missed |= taken > job.limit
            word = " MISSED" if taken > job.limit else ""
            print(f"{job.name}: {taken:.2f} s (at most {job.limit:.0f}){word}", flush=True)
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())

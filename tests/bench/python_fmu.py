"""What an FMU of the Python back-end adds to the numpy class's own time, beside a bare round trip.

    python tests/bench/python_fmu.py [--steps N]

The three are measured in turn, step by step, so that all see the same machine. All times are medians in
microseconds; on a busy machine give the process priority (``chrt -f 10 python ...``). The exit code is 1
when a limit is missed.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu"))

from host import OK, Library

from ahrs_fmu import descriptors
from ahrs_fmu.estimators.model import NumpyModel
from ahrs_fmu.export.package import build_fmu

ADDED = 150e-6
"""s: the most that a step of the FMU may take beyond the class's own time."""
SAMPLE = {"gyro": [0.1, 0.2, 0.3], "accel": [0.1, 0.0, -9.8], "mag": [2e-5, 0.0, 4e-5]}


def echo() -> socket.socket:
    """A process that sends back what it gets."""
    here, there = socket.socketpair()
    if os.fork() == 0:
        here.close()
        while data := there.recv(4096):
            there.send(data)
        os._exit(0)
    there.close()
    return here


def measure(model: str, fmi: str, steps: int, folder: Path) -> tuple[float, float, float]:
    """Medians of doStep, of the numpy class's update and outputs, and of a bare round trip, in seconds."""
    other = echo()
    library = Library(build_fmu(model, fmi=fmi, backend="python", output=folder), folder / f"unpacked{fmi}")
    instance = library.instance().run(**SAMPLE)
    own = NumpyModel(descriptors.load(model))
    for name, value in SAMPLE.items():
        own.set(name, value)
    own.update(0.0)
    times = np.empty((steps, 3))
    clock = time.perf_counter
    for k in range(steps):
        begin = clock()
        status = instance.step(k * 0.01, 0.01)
        times[k, 0] = clock() - begin
        assert status == OK
        begin = clock()
        own.update(0.01)
        own.outputs()
        times[k, 1] = clock() - begin
        begin = clock()
        other.send(bytes(120))
        other.recv(4096)
        times[k, 2] = clock() - begin
    np.testing.assert_array_equal(instance.get("q"), own.get("q"))
    instance.free()
    other.close()
    step, numpy_class, trip = np.median(times, axis=0)
    return float(step), float(numpy_class), float(trip)


def main() -> int:
    """Print one line per FMI version."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=2000)
    steps = parser.parse_args().steps
    missed = False
    with tempfile.TemporaryDirectory() as scratch:
        for fmi in ("2", "3"):
            step, own, trip = measure("gcf", fmi, steps, Path(scratch))
            too_much = step - own > ADDED
            added = f"added {1e6 * (step - own):.0f} us (at most {1e6 * ADDED:.0f})"
            print(
                f"Python back-end, FMI {fmi}: doStep {1e6 * step:.0f} us, numpy class {1e6 * own:.0f} us, "
                f"{added}{' MISSED' if too_much else ''}; bare round trip {1e6 * trip:.0f} us"
            )
            missed |= too_much
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())

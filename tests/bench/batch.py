"""A Monte Carlo study in one call of the numpy back-end, against one run after the other.

    python tests/bench/batch.py [--runs N] [--samples N]

All runs of a batch share the Python of each sample, which is most of what a single run costs. The exit code
is 1 when the gain is below its limit.
"""

from __future__ import annotations

import argparse
import resource
import sys
from time import thread_time

import numpy as np

from ahrs_fmu import Estimator, Record, models, scenarios

GAIN = 20.0
"""How many times faster than a loop over the runs a batch has to be."""
SINGLES = 3
"""Runs of the loop that are taken; the fastest counts."""
MODELS = ("gcf", "mekf")


def monte_carlo(runs: int, samples: int) -> list[Record]:
    """Recordings of a vehicle at rest, each with noise and a gyroscope bias of its own."""
    definition = scenarios.describe("gc/static")
    truth = scenarios.truth(definition)
    draw = np.random.default_rng(1)
    white = (np.radians(0.05), 0.01, 1e-7)
    found = []
    for _ in range(runs):
        noise = [std * draw.standard_normal((samples, 3)) for std in white]
        found.append(
            Record(
                time=np.arange(samples) * definition.sample_time,
                gyro=noise[0] + np.radians(0.1) * draw.standard_normal(3),
                accel=truth.accel[0] + noise[1],
                mag=truth.mag[0] + noise[2],
            )
        )
    return found


def peak() -> float:
    """Largest memory that the process has had, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def measure(model: str, records: list[Record]) -> float:
    """Time the batch and some single runs; return how many times faster the batch is."""
    estimator: Estimator = models.BY_NAME[model](
        backend="numpy", sample_time=float(records[0].time[1]), gravity=9.8
    )
    begin = thread_time()
    together = estimator.run_all(records)
    batch = thread_time() - begin
    times = []
    for k in range(SINGLES):
        begin = thread_time()
        alone = estimator.run(records[k])
        times.append(thread_time() - begin)
        np.testing.assert_allclose(together[k].q, alone.q, rtol=0.0, atol=1e-9)
    loop = min(times) * len(records)
    gain = loop / batch
    print(
        f"{model}: {len(records)} runs of {len(records[0])} samples in {batch:.1f} s, "
        f"the process up to {peak():.0f} MB; one by one {loop:.0f} s: {gain:.0f} times faster "
        f"(at least {GAIN:.0f}){'' if gain >= GAIN else ' MISSED'}",
        flush=True,
    )
    return gain


def main() -> int:
    """Print one line per model."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--samples", type=int, default=6000)
    options = parser.parse_args()
    records = monte_carlo(options.runs, options.samples)
    held = sum(array.nbytes for r in records for array in (r.gyro, r.accel, r.mag))
    print(f"the recordings: {held / 1e6:.0f} MB")
    return int(min(measure(model, records) for model in MODELS) < GAIN)


if __name__ == "__main__":
    sys.exit(main())

"""The bits of every estimator's results: a change of results needs a change of these hashes.

The samples are exact binary fractions from integer arithmetic, so that they have the same bits everywhere.
"""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from ahrs_fmu import Frame, Record, models

HASHES = {
    ("gcf", "double"): "a6c6ddce9032fcd6",
    ("gcf", "single"): "664884fff44cec87",
    ("kcf", "double"): "e4f037b0325a5031",
    ("kcf", "single"): "511385a3008767cb",
}


def samples(n: int = 20_000) -> Record:
    """Slowly wandering sensors with noise, in multiples of 2^-12 (and 2^-30 T)."""
    state = np.uint64(88172645463325252)
    draws = np.empty(n * 9, dtype=np.int64)
    for i in range(draws.size):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
        draws[i] = int(state >> np.uint64(52)) - 2048
    noise = draws.reshape(n, 9)
    wander = np.cumsum(noise, axis=0) // 256
    return Record(
        time=np.arange(n) / 128.0,
        gyro=(wander[:, :3] % 4096 - 2048 + noise[:, :3] // 64) / 4096.0,
        accel=(wander[:, 3:6] % 8192 - 4096 + noise[:, 3:6]) / 4096.0 + np.array([0.0, 0.0, -9.75]),
        mag=(noise[:, 6:] + np.array([21000, 0, 40000])) / 2.0**30,
        frame=Frame.NED,
    )


@pytest.fixture(scope="module")
def record() -> Record:
    return samples()


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("model", sorted(models.BY_NAME))
def test_results_have_the_bits_they_had(model: str, precision: str, record: Record) -> None:
    result = models.BY_NAME[model](sample_time=1 / 128, precision=precision).run(record)
    assert np.all(np.isfinite(result.q))
    trace = np.column_stack((result.q, result.euler, result.gyro_bias)).astype("<f8")
    assert hashlib.sha256(trace.tobytes()).hexdigest()[:16] == HASHES[model, precision]

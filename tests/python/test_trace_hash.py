"""The bits of every estimator's results: a change of results needs a change of these hashes.

The samples are exact binary fractions from integer arithmetic, so that they have the same bits everywhere.
"""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from ahrs_fmu import Frame, Record, models

HASHES = {
    ("adaptive_ckf", "double"): "5f763d47641dfe71",
    ("adaptive_ckf", "single"): "e3663c232fc88dda",
    ("cg_ekf", "double"): "a95d5a9776de0e33",
    ("cg_ekf", "single"): "9cda0da480d46be1",
    ("complementary", "double"): "dd0c49a6286e4ef9",
    ("complementary", "single"): "c7c6cba8a46187c8",
    ("gcf", "double"): "a6c6ddce9032fcd6",
    ("gcf", "single"): "664884fff44cec87",
    ("improved_ekf", "double"): "b1dafcb19379ec3b",
    ("improved_ekf", "single"): "e87b4d9b7e2c58fa",
    ("kcf", "double"): "7a9ec20a7f19d840",
    ("kcf", "single"): "9eab1a6ef680ae10",
    ("mahony", "double"): "ca93075526fa6eda",
    ("mahony", "single"): "4137ee76c7da0691",
    ("mahony_ekf", "double"): "e686accdd22ff5f5",
    ("mahony_ekf", "single"): "b4ece57a5f53d088",
    ("mekf", "double"): "15c19ee14d2c0384",
    ("mekf", "single"): "78245368e8a902ef",
    ("strapdown", "double"): "a7bbcbad30879270",
    ("strapdown", "single"): "9dde35e1c54d5e21",
    ("ukf", "double"): "3bb729cf30c9ea5d",
    ("ukf", "single"): "f923222f2d2257a6",
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

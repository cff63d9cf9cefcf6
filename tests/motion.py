"""Simple truths for tests: samples of ideal sensors along a known attitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu import quaternion
from ahrs_fmu.records import Record

GRAVITY = 9.80665
FIELD = 50e-6 * np.array([0.8, 0.0, 0.6])
"""North-east-down, T; dip 36.87 deg."""


def recording(
    q_true: NDArray[np.float64], sample_time: float, gyro_bias: ArrayLike = 0.0, acceleration: ArrayLike = 0.0
) -> Record:
    """Samples of ideal sensors (NED) along the attitudes (N, 4), with a bias (3,) or (N, 3) on the gyro.

    `acceleration` (3,) or (N, 3) is that of the vehicle in navigation axes, m/s2.
    """
    n = len(q_true)
    inverse = quaternion.conjugate(q_true)
    turn = quaternion.log(quaternion.multiply(inverse[:-1], q_true[1:])) / sample_time
    gravity = np.broadcast_to(np.asarray(acceleration, dtype=float) - [0.0, 0.0, GRAVITY], (n, 3))
    return Record(
        time=np.arange(n) * sample_time,
        gyro=np.vstack((np.zeros(3), turn)) + np.broadcast_to(gyro_bias, (n, 3)),
        accel=quaternion.rotate(inverse, gravity),
        mag=quaternion.rotate(inverse, np.broadcast_to(FIELD, (n, 3))),
        q_true=q_true,
    )


def at_rest(
    seconds: float, sample_time: float, euler: ArrayLike = (0.0, 0.0, 0.0), **options: ArrayLike
) -> Record:
    """A vehicle that keeps the attitude `euler` (roll, pitch, yaw in rad)."""
    n = round(seconds / sample_time) + 1
    return recording(np.tile(quaternion.from_euler(euler), (n, 1)), sample_time, **options)


def tumbling(seconds: float, sample_time: float, rate: float = 1.0, seed: int = 5) -> Record:
    """A smooth, arbitrary rotation through all attitudes with about `rate` rad/s."""
    n = round(seconds / sample_time) + 1
    time = np.arange(n) * sample_time
    draw = np.random.default_rng(seed)
    omega = sum(
        np.outer(np.sin(2 * np.pi * f * time + draw.uniform(0, 6.28)), draw.normal(size=3))
        for f in (0.05, 0.11, 0.23)
    )
    q = np.empty((n, 4))
    q[0] = quaternion.IDENTITY
    steps = quaternion.exp(rate * omega * sample_time)
    for k in range(1, n):
        q[k] = quaternion.normalise(quaternion.multiply(q[k - 1], steps[k]))
    return recording(q, sample_time)


def angle_between(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle (N,) of the rotation between attitudes, rad."""
    return np.linalg.norm(quaternion.log(quaternion.multiply(quaternion.conjugate(p), q)), axis=-1)

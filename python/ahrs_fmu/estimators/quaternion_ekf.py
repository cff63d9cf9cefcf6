"""Extended Kalman filter with quaternion as state and measurement (docs/algorithms.md section 2)."""

from __future__ import annotations

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.geometry import near, norm
from ahrs_fmu.estimators.increments import increment, right_matrix
from ahrs_fmu.estimators.matrices import apply, floored, outer, solve_right, symmetric, transposed
from ahrs_fmu.estimators.noise import motion_variance, sample_variance, turn_variance
from ahrs_fmu.estimators.state import Array, Mask, Parameters, Sample, select


def initial_covariance(p: Parameters, shape: tuple[int, ...]) -> Array:
    """Covariance (..., 4, 4) of the first attitude; an element varies half as much as the angle."""
    return np.broadcast_to((0.5 * p.initial_attitude_std) ** 2 * np.eye(4), (*shape, 4, 4))


def predict(p: Parameters, covariance: Array, q: Array, rate: Array, z: Sample) -> tuple[Array, Array]:
    """Give covariance and attitude after the rate; the attitude is not of unit length."""
    r = increment(rate * z.dt, order=1)
    f = right_matrix(r)
    # The noise is across a unit quaternion, none along it.
    across = np.eye(4) - outer(q, q)
    noise = 0.25 * turn_variance(z, p.gyro_noise)[..., None, None] * across
    return symmetric(f @ covariance @ transposed(f)) + noise, quaternion.multiply(q, r)


def measurement_variance(p: Parameters, z: Sample) -> Array:
    """Variance (...) of an element of the measured quaternion: more as the force is less like gravity."""
    excess = np.abs(norm(z.force) - p.gravity)
    moved = motion_variance(p, z, p.motion_noise) / p.gravity**2
    variance: Array = sample_variance(p, p.attitude_noise) * (1.0 + p.accel_distrust * excess) + moved
    return 0.25 * variance


def correct(
    p: Parameters, covariance: Array, q: Array, measured: Array, variance: Array, where: Mask
) -> tuple[Array, Array, Mask]:
    """Give covariance and attitude after a correction, and where the covariance had to be reset.

    With the measurement noise r I the gain is K = P (P + r I)^-1 and the covariance afterwards r K.
    """
    r = variance[..., None, None]
    gain = solve_right(covariance, covariance + r * np.eye(4))
    after, lost = floored(symmetric(r * gain), initial_covariance(p, variance.shape))
    corrected = q + apply(gain, near(measured, q) - q)
    return select(where, after, covariance), select(where, corrected, q), where & lost

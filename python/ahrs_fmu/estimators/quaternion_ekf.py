"""Extended Kalman filter whose state and measurement are the quaternion (docs/algorithms.md section 4)."""

from __future__ import annotations

import numpy as np

from ahrs_fmu.estimators.common import Array, Mask, Parameters, Sample, near, norm, select
from ahrs_fmu.estimators.matrices import (
    apply,
    corrected,
    diagonal,
    outer,
    rate_matrix,
    solve_right,
    symmetric,
    transposed,
)


def predict(p: Parameters, covariance: Array, q: Array, rate: Array, dt: float) -> tuple[Array, Array]:
    """Give covariance and attitude after dt, of first order in the rate; the attitude is not of unit length."""
    f = np.eye(4) + 0.5 * dt * rate_matrix(rate)
    # G G' with G = -(T/2) XI(q), the part of the unit matrix across q.
    across = np.eye(4) - outer(q, q)
    covariance = f @ covariance @ transposed(f) + p.rate_variance * (0.5 * dt) ** 2 * across
    return symmetric(covariance), apply(f, q)


def correct(
    covariance: Array, q: Array, measured: Array, variance: Array, where: Mask
) -> tuple[Array, Array]:
    """Give covariance and attitude after an attitude measured with equal variance on all components."""
    r = diagonal(np.repeat(variance[..., None], 4, axis=-1))
    gain = solve_right(covariance, covariance + r)
    innovation = near(measured, q) - q
    better = corrected(covariance, gain, np.eye(4), r)
    return select(where, better, covariance), select(where, q + apply(gain, innovation), q)


def measurement_variance(p: Parameters, z: Sample) -> Array:
    """Variance (...) that grows with the distance of the specific force from gravity."""
    excess = np.abs(norm(z.accel) - p.gravity)
    variance: Array = p.attitude_variance * (1.0 + p.motion_weight * np.where(z.accel_usable, excess, 0.0))
    return variance

"""Cubature Kalman filter on the quaternion with estimated noise (docs/algorithms.md section 5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.common import Array, Mask, Parameters, Sample, attitude_of, select
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.matrices import (
    LEAST_VARIANCE,
    apply,
    cholesky,
    diagonal,
    outer,
    quaternion_std,
    solve_right,
    symmetric,
    transposed,
)
from ahrs_fmu.estimators.strapdown import increment_matrix

_STATES = 4
_YAW = 3
STEEP = np.radians(85.0)
"""rad: beyond this pitch the yaw says nothing."""
UNUSED = 1e12
"""Factor on the noise of a component that is not usable."""


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    covariance : ndarray (..., 4, 4)
        Of the quaternion.
    q_noise : ndarray (..., 4, 4)
        Estimated process noise.
    r_noise : ndarray (..., 4, 4)
        Estimated noise of specific force ((m/s2)^2) and yaw (rad^2).
    steps : ndarray (...)
        Corrections so far.
    std : ndarray (..., 3)
        Standard deviation about the body axes, rad.
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    covariance: Array
    q_noise: Array
    r_noise: Array
    steps: Array
    std: Array
    reset: Mask


class AdaptiveCKF(Filter[State]):
    """Carry the quaternion by eight cubature points; learn the noise levels from the innovations."""

    def initial(self, q: Array) -> State:
        """Start with the initial covariance and noise levels."""
        p = self.p
        eye = np.broadcast_to(np.eye(_STATES), (*self.shape, _STATES, _STATES))
        covariance = p.initial_variance * eye
        reset = np.zeros(self.shape, dtype=np.bool_)
        steps = np.zeros(self.shape)
        r_noise = np.broadcast_to(measurement_noise(p), eye.shape)
        return State(
            covariance, p.process_variance * eye, r_noise, steps, quaternion_std(covariance, q), reset
        )

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct, then adapt the noise levels."""
        p = self.p
        f = increment_matrix(z.rate * z.dt)
        points = apply(f[..., None, :, :], cubature_points(state.covariance) + q[..., None, :])
        q = points.mean(axis=-2)
        spread = points - q[..., None, :]
        covariance = symmetric(transposed(spread) @ spread / points.shape[-2] + state.q_noise)
        if z.gain_dt > 0.0:
            state, covariance, q = self._correct(state, covariance, q, f, z)
        return state._replace(covariance=covariance, std=quaternion_std(covariance, q)), quaternion.normalise(
            q
        )

    def _correct(
        self, state: State, covariance: Array, q: Array, f: Array, z: Sample
    ) -> tuple[State, Array, Array]:
        p = self.p
        deviations = cubature_points(covariance)
        yaw = yaw_of(q)
        expected = expectation(p, deviations + q[..., None, :])
        expected[..., _YAW] = yaw[..., None] + wrapped(expected[..., _YAW] - yaw[..., None])
        mean = expected.mean(axis=-2)
        spread = expected - mean[..., None, :]
        count = deviations.shape[-2]
        innovation_covariance = transposed(spread) @ spread / count + state.r_noise
        gain = solve_right(transposed(deviations) @ spread / count, innovation_covariance)
        measured = np.concatenate((z.accel, yaw_of(attitude_of(z.accel, z.mag))[..., None]), axis=-1)
        innovation = measured - mean
        innovation[..., _YAW] = wrapped(innovation[..., _YAW])
        correction = apply(gain, innovation)
        q = q + correction
        after = symmetric(covariance - gain @ innovation_covariance @ transposed(gain))
        state = state._replace(steps=state.steps + 1.0)
        state = adapted(p, state, q, after, f, gain, innovation)
        return state, after, q


def adapted(
    p: Parameters, state: State, q: Array, covariance: Array, f: Array, gain: Array, innovation: Array
) -> State:
    """Noise levels after a correction."""
    if p.adaptation == "none":
        return state
    weight = ((1.0 - p.fading) / (1.0 - p.fading ** (state.steps + p.warm_up)))[..., None, None]
    h = jacobian(p, q)
    residual = innovation - apply(h, apply(gain, innovation))
    r_new = outer(residual, residual) + h @ covariance @ transposed(h)
    r_noise = bounded(symmetric((1.0 - weight) * state.r_noise + weight * r_new), p.r_min, p.r_max)
    return state._replace(r_noise=r_noise)


def bounded(m: Array, low: float, high: float) -> Array:
    """Symmetric matrices with their eigenvalues brought between two limits."""
    values, vectors = np.linalg.eigh(m)
    return symmetric((vectors * np.clip(values, low, high)[..., None, :]) @ transposed(vectors))


def cubature_points(covariance: Array) -> Array:
    """Deviations (..., 8, 4) from the mean: two standard deviations along each column of the factor."""
    columns = transposed(np.sqrt(_STATES) * cholesky(covariance))
    return np.concatenate((columns, -columns), axis=-2)


def measurement_noise(p: Parameters) -> Array:
    """Initial covariance (4, 4) of specific force and yaw."""
    return diagonal(np.array([p.accel_std, p.accel_std, p.accel_std, p.yaw_std]) ** 2)


def expectation(p: Parameters, q: Array) -> Array:
    """Specific force and yaw (..., 4) of quaternions that need not be of unit length."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    down = (2 * (x * z - w * y), 2 * (w * x + y * z), w * w - x * x - y * y + z * z)
    return np.stack((*(-p.gravity * d for d in down), yaw_of(q)), axis=-1)


def yaw_of(q: Array) -> Array:
    """Yaw angle (...), rad."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return np.arctan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z)


def wrapped(angle: Array) -> Array:
    """Angles brought into (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2.0 * np.pi)


def jacobian(p: Parameters, q: Array) -> Array:
    """Derivative (..., 4, 4) of `expectation`."""
    q0, q1, q2, q3 = (q[..., i] for i in range(4))
    north, east = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3, 2 * (q1 * q2 + q0 * q3)
    d_east = np.stack((q3, q2, q1, q0), axis=-1)
    d_north = np.stack((q0, q1, -q2, -q3), axis=-1)
    square = (north * north + east * east)[..., None]
    d_yaw = 2.0 * (north[..., None] * d_east - east[..., None] * d_north) / square
    rows = ((-q2, q3, -q0, q1), (q1, q0, q3, q2), (q0, -q1, -q2, q3))
    force = [-2.0 * p.gravity * np.stack(row, axis=-1) for row in rows]
    return np.stack((*force, d_yaw), axis=-2)

"""Conjugate gradient for the measured attitude, EKF for the estimate (docs/algorithms.md section 4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.geometry import dot, near, norm, unit
from ahrs_fmu.estimators.increments import increment
from ahrs_fmu.estimators.matrices import apply, transposed
from ahrs_fmu.estimators.noise import motion_variance, sample_variance, turn_variance
from ahrs_fmu.estimators.state import Array, Mask, Sample, select

NEWTON_STEPS = 6
RESTART = 4
CONVERGED = 1e-10
CURVATURE_LEAST = 1e-12
"""Less belongs to a direction so short that its first guess will do."""


class State(NamedTuple):
    """State of the filter.

    The prediction is a rotation of four dimensions times a number and both noises are multiples of the unit
    matrix: so the covariance is one as well, and the filter needs only that number.

    Attributes
    ----------
    variance : ndarray (...)
        Of every element of the quaternion.
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    variance: Array
    reset: Mask


class CGEKF(Filter[State]):
    """Predict with the rate; the attitude nearest to both measured directions is the measurement."""

    def initial(self, q: Array) -> State:  # noqa: ARG002
        """Start with the variance of the first attitude."""
        return State(np.full(self.shape, self._initial_variance()), np.zeros(self.shape, dtype=np.bool_))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        p = self.p
        turn = increment(z.rate * z.dt, order=2)
        q = quaternion.normalise(quaternion.multiply(q, turn))
        variance = dot(turn, turn) * state.variance + 0.25 * turn_variance(z, p.gyro_noise)
        reset = ~np.isfinite(variance)
        variance = np.where(reset, self._initial_variance(), variance)
        if z.gain_dt > 0.0:
            moved = motion_variance(p, z, p.motion_noise) / p.gravity**2
            r = 0.25 * (sample_variance(p, p.attitude_noise) + moved)
            gain = variance / (variance + r)
            measured = near(conjugate_gradient(p.iterations, q, z), q)
            where = z.accel_usable | z.mag_usable
            q = select(where, q + gain[..., None] * (measured - q), q)
            variance = np.where(where, gain * r, variance)
        return State(variance, reset), q

    def attitude_std(self, state: State, q: Array) -> Array:
        """Give the standard deviation about the body axes."""
        return np.broadcast_to(2.0 * np.sqrt(state.variance)[..., None], (*q.shape[:-1], 3))

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset

    def _initial_variance(self) -> float:
        return 0.25 * float(self.p.initial_attitude_std) ** 2


def conjugate_gradient(iterations: int, q: Array, z: Sample) -> Array:
    """Attitude (..., 4) near q that brings both expected directions closest to the measured ones.

    Fletcher-Reeves on the unit sphere. Along a line the error is quadratic, so that the step is the root of
    a cubic, found by Newton's method. A direction that is not usable does not count.
    """
    force = np.where(z.accel_usable[..., None], unit(z.accel), 0.0)
    with_field = (z.mag_usable & (norm(z.field) > 0.0))[..., None]
    field = np.where(with_field, unit(z.mag), 0.0)
    measured = np.concatenate((force, field), axis=-1)
    reference = np.where(with_field, unit(z.field), 0.0)
    weight = z.accel_usable.astype(np.float64)
    direction, previous = np.zeros_like(q), np.ones(q.shape[:-1])
    active = np.ones(q.shape[:-1], dtype=np.bool_)
    for k in range(iterations):
        error = quadratic(weight, reference, q, q) - measured
        jacobian = jacobian_of(weight, reference, q)
        gradient = apply(transposed(jacobian), error)
        gradient = gradient - dot(gradient, q)[..., None] * q
        squared = dot(gradient, gradient)
        active = active & (squared > CONVERGED**2)
        if not active.any():
            break
        beta = np.zeros_like(squared) if k % RESTART == 0 else squared / previous
        along = direction - dot(direction, q)[..., None] * q
        direction = beta[..., None] * along - gradient
        direction = select(dot(direction, gradient) < 0.0, direction, -gradient)
        linear = apply(jacobian, direction)
        bent = quadratic(weight, reference, direction, direction)
        length = line_minimum(error, linear, bent)
        q = select(active, quaternion.normalise(q + length[..., None] * direction), q)
        previous = squared
    return q


def line_minimum(e0: Array, e1: Array, e2: Array) -> Array:
    """Step L (...) at which |e0 + L e1 + L^2 e2| is least, near that of the linear part."""
    c0, c1 = dot(e0, e1), dot(e1, e1) + 2.0 * dot(e0, e2)
    c2, c3 = 3.0 * dot(e1, e2), 2.0 * dot(e2, e2)
    straight = dot(e1, e1)
    length: Array = np.where(straight > 0.0, -c0 / straight, 0.0)
    convex = straight > 0.0
    for _ in range(NEWTON_STEPS):
        slope = c0 + length * (c1 + length * (c2 + length * c3))
        curvature = c1 + length * (2.0 * c2 + length * 3.0 * c3)
        convex = convex & (curvature > CURVATURE_LEAST)
        length = np.where(convex, length - slope / curvature, length)
    return length


def quadratic(weight: Array, reference: Array, a: Array, b: Array) -> Array:
    """Expected directions (..., 6) of specific force and field, bilinear in two quaternions.

    With a = b = q they are -C' e3 (times `weight`) and C' (h, 0, d) with `reference` = (h, d).
    """
    half: Array = 0.5 * apply(jacobian_of(weight, reference, a), b)
    return half


def jacobian_of(weight: Array, reference: Array, q: Array) -> Array:
    """Derivative (..., 6, 4) of the expected directions with respect to the quaternion."""
    q0, q1, q2, q3 = (q[..., i] for i in range(4))
    h, d = reference[..., 0], reference[..., 1]
    s = weight
    rows = (
        (s * q2, -s * q3, s * q0, -s * q1),
        (-s * q1, -s * q0, -s * q3, -s * q2),
        (-s * q0, s * q1, s * q2, -s * q3),
        (h * q0 - d * q2, h * q1 + d * q3, -h * q2 - d * q0, -h * q3 + d * q1),
        (-h * q3 + d * q1, h * q2 + d * q0, h * q1 + d * q3, -h * q0 + d * q2),
        (h * q2 + d * q0, h * q3 - d * q1, h * q0 - d * q2, h * q1 + d * q3),
    )
    jacobian: Array = 2.0 * np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return jacobian

"""Conjugate gradient for the measured attitude, EKF for the estimate (docs/algorithms.md section 5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.common import Array, Mask, Parameters, Sample, dot, near, select, unit
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.matrices import (
    apply,
    guarded,
    quaternion_std,
    rate_matrix,
    solve_right,
    symmetric,
    transposed,
)

NEWTON_STEPS = 6
RESTART = 4
CONVERGED = 1e-10
Q_REFERENCE_TIME = 0.004
"""s: process_variance is that of one step of this length."""


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    covariance : ndarray (..., 4, 4)
        Of the quaternion.
    std : ndarray (..., 3)
        Standard deviation about the body axes, rad.
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    covariance: Array
    std: Array
    reset: Mask


class CGEKF(Filter[State]):
    """Predict with the rate; the attitude nearest to both measured directions is the measurement."""

    def initial(self, q: Array) -> State:
        """Start with the initial covariance."""
        covariance = np.broadcast_to(self.p.initial_variance * np.eye(4), (*self.shape, 4, 4))
        return State(covariance, quaternion_std(covariance, q), np.zeros(self.shape, dtype=np.bool_))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        p = self.p
        turn = z.rate * z.dt
        a = (1.0 - 0.125 * dot(turn, turn))[..., None, None] * np.eye(4) + 0.5 * rate_matrix(turn)
        q = apply(a, q)
        covariance = a @ state.covariance @ transposed(a)
        covariance = covariance + p.process_variance * (z.dt / Q_REFERENCE_TIME) * np.eye(4)
        if z.gain_dt > 0.0:
            measured = near(conjugate_gradient(p, quaternion.normalise(q), z), q)
            gain = solve_right(covariance, covariance + p.attitude_variance * np.eye(4))
            where = z.accel_usable | z.mag_usable
            q = select(where, q + apply(gain, measured - q), q)
            covariance = select(where, (np.eye(4) - gain) @ covariance, covariance)
        q = quaternion.normalise(q)
        covariance, reset = guarded(symmetric(covariance), p.initial_variance * np.eye(4))
        return State(covariance, quaternion_std(covariance, q), reset), q

    def attitude_std(self, state: State) -> Array:
        """Give the standard deviation about the body axes."""
        return state.std

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset


def conjugate_gradient(p: Parameters, q: Array, z: Sample) -> Array:
    """Attitude (..., 4) near q that brings both expected directions closest to the measured ones.

    Fletcher-Reeves on the unit sphere. Along a line the error is quadratic, so that the step is the root of
    a cubic, found by Newton's method. A direction that is not usable does not count.
    """
    force = np.where(z.accel_usable[..., None], unit(z.accel), 0.0)
    field = np.where(z.mag_usable[..., None], unit(z.mag), 0.0)
    measured = np.concatenate((force, field), axis=-1)
    reference = np.where(z.mag_usable[..., None], unit(z.field), 0.0)
    weight = z.accel_usable.astype(np.float64)
    direction, previous = np.zeros_like(q), np.ones(q.shape[:-1])
    for k in range(p.iterations):
        error = quadratic(weight, reference, q, q) - measured
        jacobian = jacobian_of(weight, reference, q)
        gradient = apply(transposed(jacobian), error)
        gradient = gradient - dot(gradient, q)[..., None] * q
        squared = dot(gradient, gradient)
        active = np.sqrt(squared) > CONVERGED
        beta = np.zeros_like(squared) if k % RESTART == 0 else squared / previous
        along = direction - dot(direction, q)[..., None] * q
        direction = -gradient + beta[..., None] * along
        direction = select(dot(direction, gradient) >= 0.0, -gradient, direction)
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
    length: Array = -c0 / dot(e1, e1)
    for _ in range(NEWTON_STEPS):
        slope = c0 + length * (c1 + length * (c2 + length * c3))
        length = length - slope / (c1 + length * (2.0 * c2 + 3.0 * length * c3))
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

"""Multiplicative EKF with attitude error and gyroscope bias (docs/algorithms.md section 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.common import Array, Mask, Parameters, Sample, down_of, north_of
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.matrices import (
    apply,
    corrected,
    diagonal,
    guarded,
    skew,
    solve_right,
    symmetric,
    transposed,
)


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    bias : ndarray (..., 3)
        Gyroscope bias, rad/s.
    covariance : ndarray (..., 6, 6)
        Of the rotation vector q^-1 q_true in body axes (rad) and the bias error (rad/s).
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    bias: Array
    covariance: Array
    reset: Mask


class MEKF(Filter[State]):
    """Predict with the rate less its bias, correct by the measured vectors themselves."""

    def initial(self, q: Array) -> State:  # noqa: ARG002
        """Start without bias and with the initial covariance."""
        covariance = np.broadcast_to(initial_covariance(self.p), (*self.shape, 6, 6))
        return State(np.zeros((*self.shape, 3)), covariance, np.zeros(self.shape, dtype=np.bool_))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        turn = (z.rate - state.bias) * z.dt
        q = quaternion.multiply(q, quaternion.exp(turn))
        f = transition(turn, z.dt)
        covariance = f @ state.covariance @ transposed(f) + process_noise(self.p, z.dt)
        bias = state.bias
        if z.gain_dt > 0.0:
            h, expected = measurement(self.p, q, z)
            r = measurement_noise(self.p, z)
            gain = solve_right(covariance @ transposed(h), h @ covariance @ transposed(h) + r)
            dx = apply(gain, np.concatenate((z.accel, z.mag), axis=-1) - expected)
            q = quaternion.multiply(q, quaternion.exp(dx[..., :3]))
            bias = bias + dx[..., 3:]
            covariance = corrected(covariance, gain, h, r)
        covariance, reset = guarded(symmetric(covariance), initial_covariance(self.p))
        return State(bias, covariance, reset), q

    def gyro_bias(self, state: State) -> Array:
        """Give the estimated bias."""
        return state.bias

    def attitude_std(self, state: State) -> Array:
        """Give the standard deviation of the rotation vector."""
        return attitude_std(state.covariance)

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset


def initial_covariance(p: Parameters) -> Array:
    """Covariance (6, 6) before the first sample."""
    std = np.repeat([p.initial_attitude_std, p.initial_bias_std], 3)
    return diagonal(std**2)


def transition(turn: Array, dt: float) -> Array:
    """Transition matrix (..., 6, 6) of the errors while the body turns by `turn`."""
    f = np.zeros((*turn.shape[:-1], 6, 6))
    f[..., :3, :3] = quaternion.to_matrix(quaternion.exp(-turn))
    f[..., :3, 3:] = -dt * np.eye(3)
    f[..., 3:, 3:] = np.eye(3)
    return f


def process_noise(p: Parameters, dt: float) -> Array:
    """Covariance (6, 6) that gyroscope noise and bias walk add within dt."""
    rate, step = p.gyro_noise_density**2 * dt, p.gyro_bias_walk**2 * dt
    blocks = np.array([[rate + step * dt**2 / 3.0, -0.5 * step * dt], [-0.5 * step * dt, step]])
    return np.kron(blocks, np.eye(3))


def measurement(p: Parameters, q: Array, z: Sample) -> tuple[Array, Array]:
    """Jacobian (..., 6, 6) and expectation (..., 6) of specific force and field; zero where not usable."""
    force = np.where(z.accel_usable[..., None], -p.gravity * down_of(q), 0.0)
    field = z.field[..., :1] * north_of(q) + z.field[..., 1:] * down_of(q)
    field = np.where(z.mag_usable[..., None], field, 0.0)
    h = np.zeros((*q.shape[:-1], 6, 6))
    h[..., :3, :3], h[..., 3:, :3] = skew(force), skew(field)
    measured_force = np.where(z.accel_usable[..., None], force, z.accel)
    measured_field = np.where(z.mag_usable[..., None], field, z.mag)
    return h, np.concatenate((measured_force, measured_field), axis=-1)


def measurement_noise(p: Parameters, z: Sample) -> Array:
    """Covariance (..., 6, 6) of specific force and field."""
    variances = np.repeat([p.accel_std**2, p.mag_std**2], 3)
    return np.broadcast_to(diagonal(variances), (*z.rate.shape[:-1], 6, 6))


def attitude_std(covariance: Array) -> Array:
    """Standard deviation (..., 3) of the first three states."""
    return np.sqrt(np.maximum(np.diagonal(covariance, axis1=-2, axis2=-1)[..., :3], 0.0))

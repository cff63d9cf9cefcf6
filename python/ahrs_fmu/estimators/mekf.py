"""Multiplicative EKF with attitude error and gyroscope bias (docs/algorithms.md section 1)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import Filter, merged
from ahrs_fmu.estimators.geometry import down_of, north_of
from ahrs_fmu.estimators.matrices import (
    all_finite,
    apply,
    corrected,
    diagonal,
    skew,
    solve_right,
    transposed,
)
from ahrs_fmu.estimators.noise import motion_variance, sample_variance, turn_variance
from ahrs_fmu.estimators.state import Array, Mask, Parameters, Sample, select


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    bias : ndarray (..., 3)
        Gyroscope bias, rad/s.
    covariance : ndarray (..., 6, 6)
        Of the rotation from the estimated to the true attitude about the body axes (rad) and of the bias
        error (rad/s).
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    bias: Array
    covariance: Array
    reset: Mask


class BiasFilter(Filter[State]):
    """What the filters with attitude error and bias share."""

    def initial(self, q: Array) -> State:  # noqa: ARG002
        """Start without bias and with the initial covariance."""
        covariance = np.broadcast_to(initial_covariance(self.p), (*self.shape, 6, 6))
        return State(np.zeros((*self.shape, 3)), covariance, np.zeros(self.shape, dtype=np.bool_))

    def gyro_bias(self, state: State) -> Array:
        """Give the estimated bias."""
        return state.bias

    def attitude_std(self, state: State, q: Array) -> Array:  # noqa: ARG002
        """Give the standard deviation of the rotation."""
        variance = np.diagonal(state.covariance, axis1=-2, axis2=-1)[..., :3]
        return np.sqrt(np.maximum(variance, 0.0))

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset

    def limited(self, bias: Array) -> Array:
        """Bring the bias within its limit."""
        return np.clip(bias, -self.p.bias_limit, self.p.bias_limit)


class MEKF(BiasFilter):
    """Predict with the rate less its bias, correct by the measured vectors themselves."""

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        turn = (z.rate - state.bias) * z.dt
        q = quaternion.multiply(q, quaternion.exp(turn))
        f = transition(turn, z.dt)
        covariance = f @ state.covariance @ transposed(f) + process_noise(self.p, z)
        covariance = limited_attitude(covariance)
        state = state._replace(covariance=covariance, reset=np.zeros(self.shape, dtype=np.bool_))
        if z.gain_dt == 0.0:
            return state, q
        h, innovation = measurement(self.p, q, z)
        r = measurement_noise(self.p, z)
        gain = solve_right(covariance @ transposed(h), h @ covariance @ transposed(h) + r)
        dx = apply(gain, innovation)
        better = State(self.limited(state.bias + dx[..., 3:]), corrected(covariance, gain, h, r), state.reset)
        lost = ~meaningful(better.covariance)
        again = self.initial(q)._replace(bias=state.bias, reset=np.ones(self.shape, dtype=np.bool_))
        q = select(lost, q, quaternion.multiply(q, quaternion.exp(dx[..., :3])))
        return merged(lost, again, better), q


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


def process_noise(p: Parameters, z: Sample) -> Array:
    """Covariance (..., 6, 6) that gyroscope noise and bias walk add in one step."""
    return integrated_noise(turn_variance(z, p.gyro_noise), p.gyro_bias_noise**2, z.dt)


def integrated_noise(turning: Array, walk: float, dt: float) -> Array:
    """Covariance (..., 6, 6) of a rotation of variance `turning` and a bias that walks for dt seconds."""
    rotation = turning + walk * dt**3 / 3.0
    noise = np.zeros((*rotation.shape, 6, 6))
    noise[..., :3, :3] = rotation[..., None, None] * np.eye(3)
    noise[..., :3, 3:] = noise[..., 3:, :3] = -0.5 * walk * dt**2 * np.eye(3)
    noise[..., 3:, 3:] = walk * dt * np.eye(3)
    return noise


def limited_attitude(covariance: Array) -> Array:
    """Covariance whose rotation is at most half a turn: a heading that nothing measures stays at that.

    Rotation and cross covariance are scaled alike, which keeps the whole positive definite.
    """
    total = np.trace(covariance[..., :3, :3], axis1=-2, axis2=-1)
    scale = np.minimum(1.0, np.pi**2 / total)[..., None, None]
    limited = covariance.copy()
    limited[..., :3, :] *= scale
    limited[..., 3:, :3] *= scale
    return limited


def measurement(p: Parameters, q: Array, z: Sample) -> tuple[Array, Array]:
    """Jacobian (..., 6, 6) and innovation (..., 6) of specific force and field; zero where not usable."""
    accel, mag = z.accel_usable[..., None], z.mag_usable[..., None]
    force = np.where(accel, -p.gravity * down_of(q), 0.0)
    field = np.where(mag, z.field[..., :1] * north_of(q) + z.field[..., 1:] * down_of(q), 0.0)
    h = np.zeros((*q.shape[:-1], 6, 6))
    h[..., :3, :3], h[..., 3:, :3] = skew(force), skew(field)
    innovation = (np.where(accel, z.accel - force, 0.0), np.where(mag, z.mag - field, 0.0))
    return h, np.concatenate(innovation, axis=-1)


def measurement_noise(p: Parameters, z: Sample) -> Array:
    """Covariance (6, 6) of specific force and field."""
    accel = sample_variance(p, p.accel_noise) + motion_variance(p, z, p.motion_noise)
    return diagonal(np.repeat([accel, sample_variance(p, p.mag_noise)], 3))


def meaningful(covariance: Array) -> Mask:
    """Where matrices can be a covariance."""
    positive = (np.diagonal(covariance, axis1=-2, axis2=-1) > 0.0).all(axis=-1)
    return np.asarray(all_finite(covariance) & positive)

"""Cubature Kalman filter on the quaternion with Sage-Husa noise estimation (docs/algorithms.md section 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import Filter, merged
from ahrs_fmu.estimators.geometry import attitude_of, down_of
from ahrs_fmu.estimators.increments import increment, right_matrix
from ahrs_fmu.estimators.matrices import (
    all_finite,
    apply,
    bounded,
    cholesky,
    floored,
    outer,
    quaternion_std,
    solve_right,
    symmetric,
    transposed,
)
from ahrs_fmu.estimators.noise import sample_variance, turn_variance
from ahrs_fmu.estimators.state import Array, Mask, Parameters, Sample, select
from ahrs_fmu.estimators.vectors import shows_attitude
from ahrs_fmu.quaternion import join

_STATES = 4
_HEADING = 3
SPREAD_MAX = 0.25
"""Sum of the variances of the elements, that of a rotation by one radian: as good as unknown."""
_STEEP = np.sin(np.radians(85.0))
"""Sine of the pitch beyond which the heading is not measured."""


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    covariance : ndarray (..., 4, 4)
        Of the quaternion.
    process : ndarray (..., 4, 4)
        Of the process noise per sample.
    measurement : ndarray (..., 4, 4)
        Of the measurement noise: specific force ((m/s2)^2) and heading (rad^2).
    fading : ndarray (...)
        Power of the forgetting factor: how much of the given noise is left.
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    covariance: Array
    process: Array
    measurement: Array
    fading: Array
    reset: Mask


class _Correction(NamedTuple):
    """Innovation and gain; without a heading its row holds zeros."""

    innovation: Array
    spread: Array
    gain: Array
    change: Array
    heading: Mask


class AdaptiveCKF(Filter[State]):
    """Carry the quaternion by cubature points; learn the noise from the innovations."""

    def initial(self, q: Array) -> State:
        """Start with the given covariance and noise."""
        p, T = self.p, self.p.sample_time
        eye = np.broadcast_to(np.eye(_STATES), (*self.shape, _STATES, _STATES))
        turn = np.full(self.shape, p.gyro_noise**2 * T)
        moved = p.motion_noise**2 * T if p.motion_compensation else 0.0
        accel = sample_variance(p, p.accel_noise) + moved
        heading = sample_variance(p, p.heading_noise)
        return State(
            covariance=(0.5 * p.initial_attitude_std) ** 2 * eye,
            process=process_noise(p, q, turn, T),
            measurement=np.array([accel, accel, accel, heading]) * eye,
            fading=np.full(self.shape, p.forgetting ** (p.warm_up + 1)),
            reset=np.zeros(self.shape, dtype=np.bool_),
        )

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict, correct, and adapt the noise."""
        p = self.p
        again = self.initial(q)._replace(reset=np.ones(self.shape, dtype=np.bool_))
        process = state.process
        if p.adaptation in ("none", "r_only"):
            process = process_noise(p, q, turn_variance(z, p.gyro_noise), z.dt)
        turn = increment(z.rate * z.dt, order=4)
        f = right_matrix(turn)
        predicted = quaternion.multiply(q, turn)
        turned = symmetric(f @ state.covariance @ transposed(f))
        state = state._replace(
            covariance=limited_spread(turned + process),
            process=process,
            reset=np.zeros(self.shape, dtype=np.bool_),
        )
        if z.gain_dt == 0.0:
            return state, predicted
        c, failed = measure(p, state, predicted, z)
        covariance = symmetric(state.covariance - c.gain @ c.spread @ transposed(c.gain))
        covariance, lost = floored(covariance, again.covariance)
        corrected = predicted + c.change
        better = adapted(p, state._replace(covariance=covariance), corrected, c, f, turned)
        failed = failed | lost
        after = merged(z.accel_usable, merged(failed, again, better), state)
        return after, select(z.accel_usable & ~failed, corrected, predicted)

    def attitude_std(self, state: State, q: Array) -> Array:
        """Give the standard deviation about the body axes."""
        return quaternion_std(state.covariance, q)

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset


def process_noise(p: Parameters, q: Array, turn: Array, dt: float) -> Array:
    """Process noise (..., 4, 4) per sample as given; `turn` (...) is the gyroscope's share, rad2."""
    noise: Array = p.quaternion_noise**2 * dt * np.eye(_STATES)
    if p.process_noise == "gyro":
        noise = noise + 0.25 * turn[..., None, None] * (np.eye(_STATES) - outer(q, q))
    return np.broadcast_to(noise, (*q.shape, _STATES))


def limited_spread(covariance: Array) -> Array:
    """Covariance that keeps the points of a quaternion that nothing measures near unit length."""
    total = np.trace(covariance, axis1=-2, axis2=-1)
    limited: Array = covariance * np.minimum(1.0, SPREAD_MAX / total)[..., None, None]
    return limited


def measure(p: Parameters, state: State, q: Array, z: Sample) -> tuple[_Correction, Mask]:
    """Innovation and gain at the predicted attitude q; and where a covariance is not positive definite."""
    root = cholesky(state.covariance)
    columns = np.sqrt(_STATES) * transposed(root)
    deviations = np.concatenate((columns, -columns), axis=-2)
    reference = heading_of(q)
    seen = expected(p, q[..., None, :] + deviations, reference[..., None])
    mean = seen.mean(axis=-2)
    spread = seen - mean[..., None, :]
    count = deviations.shape[-2]
    s = transposed(spread) @ spread / count + state.measurement
    crossed = transposed(deviations) @ spread / count
    heading = shows_attitude(z) & (np.abs(down_of(q)[..., 0]) < _STEEP)
    used = np.ones_like(mean)
    used[..., _HEADING] = heading
    # A row that does not count is made independent of the others and of the state.
    s = s * outer(used, used) + (1.0 - used)[..., None] * np.eye(_STATES)
    gain = solve_right(crossed * used[..., None, :], s)
    measured = np.concatenate((z.accel, heading_of(attitude_of(z.accel, z.mag))[..., None]), axis=-1)
    innovation = measured - mean
    innovation[..., _HEADING] = wrapped(innovation[..., _HEADING])
    innovation = np.where(used > 0.0, innovation, 0.0)
    failed = ~(all_finite(root) & all_finite(cholesky(s)))
    return _Correction(innovation, s, gain, apply(gain, innovation), heading), failed


def adapted(p: Parameters, state: State, q: Array, c: _Correction, f: Array, turned: Array) -> State:
    """Noise after the correction to q; f turns the quaternion, `turned` is F P F' of the sample before."""
    fading = state.fading * p.forgetting
    state = state._replace(fading=fading)
    if p.adaptation == "none":
        return state
    d = ((1.0 - p.forgetting) / (1.0 - fading))[..., None, None]
    h = jacobian(p, q)
    left = c.innovation - apply(h, c.change)
    found = (1.0 - d) * state.measurement + d * (outer(left, left) + h @ state.covariance @ transposed(h))
    without = found.copy()
    without[..., _HEADING, :] = state.measurement[..., _HEADING, :]
    without[..., :, _HEADING] = state.measurement[..., :, _HEADING]
    found = symmetric(select(c.heading, found, without))
    # The published forms have no limits.
    if p.adaptation in ("r_only", "qr_safe"):
        found = bounded(found, p.measurement_variance_min, p.measurement_variance_max)
    state = state._replace(measurement=found)
    if p.adaptation == "r_only":
        return state
    growth = outer(c.change, c.change)
    if p.adaptation == "textbook":
        growth = growth + state.covariance - turned
    elif p.adaptation == "printed":
        growth = growth + state.covariance - f @ state.covariance @ transposed(f)
    process = symmetric((1.0 - d) * state.process + d * growth)
    if p.adaptation == "qr_safe":
        process = bounded(process, p.process_variance_min, p.process_variance_max)
    return state._replace(process=process)


def expected(p: Parameters, q: Array, near: Array) -> Array:
    """Specific force and heading (..., 4) of attitudes of any length; the heading near a reference."""
    force = -p.gravity * down_of(q)
    heading = near + wrapped(heading_of(q) - near)
    return np.concatenate((force, heading[..., None]), axis=-1)


def heading_of(q: Array) -> Array:
    """Yaw angle (...) of attitudes of any length, rad."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return np.asarray(np.arctan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z))


def wrapped(angle: Array) -> Array:
    """Angles brought into (-pi, pi]."""
    return np.asarray(np.pi - np.mod(np.pi - angle, 2.0 * np.pi))


def jacobian(p: Parameters, q: Array) -> Array:
    """Derivative (..., 4, 4) of `expected` by the elements of q."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    force = join(-y, z, -w, x, x, w, z, y, w, -x, -y, z).reshape(*q.shape[:-1], 3, 4)
    north, east = w * w + x * x - y * y - z * z, 2 * (x * y + w * z)
    d_north, d_east = join(w, x, -y, -z), join(z, y, x, w)
    square = north * north + east * east
    heading = 2.0 * (north[..., None] * d_east - east[..., None] * d_north) / square[..., None]
    return np.concatenate((-2.0 * p.gravity * force, heading[..., None, :]), axis=-2)

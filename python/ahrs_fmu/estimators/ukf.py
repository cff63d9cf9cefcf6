"""Unscented Kalman filter with attitude error and gyroscope bias (docs/algorithms.md section 1)."""

from __future__ import annotations

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import merged
from ahrs_fmu.estimators.geometry import down_of, north_of
from ahrs_fmu.estimators.matrices import (
    all_finite,
    apply,
    cholesky,
    outer,
    solve_right,
    symmetric,
    transposed,
)
from ahrs_fmu.estimators.mekf import BiasFilter, State, measurement_noise, process_noise
from ahrs_fmu.estimators.state import Array, Parameters, Sample, select

ROTATION_VARIANCE_MAX = 1.0
"""rad2: the points of a rotation spread further than this would meet behind the back."""

_STATES = 6


class UKF(BiasFilter):
    """The states and the noise of the MEKF, carried by 13 sigma points instead of Jacobians."""

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        spread, mean_weights, weights = sigma_weights(self.p)
        q, bias, covariance = self._predict(state, q, z)
        fresh = np.zeros(self.shape, dtype=np.bool_)
        again = self.initial(q)._replace(bias=state.bias, reset=~fresh)
        predicted = State(bias, covariance, fresh)
        lost = ~all_finite(cholesky(covariance))
        if z.gain_dt == 0.0:
            return merged(lost, again, predicted), q
        points = sigma_points(spread, covariance)
        attitudes = quaternion.multiply(q[..., None, :], quaternion.exp(points[..., :3]))
        expected = self._expected(attitudes, z)
        mean = mean_of(mean_weights, expected)
        deviation = expected - mean[..., None, :]
        innovation_covariance = moment(weights, deviation, deviation) + measurement_noise(self.p, z)
        gain = solve_right(moment(weights, points, deviation), innovation_covariance)
        dx = apply(gain, np.concatenate((z.accel, z.mag), axis=-1) - mean)
        covariance = symmetric(covariance - gain @ innovation_covariance @ transposed(gain))
        lost = lost | ~all_finite(cholesky(covariance))
        corrected = State(self.limited(bias + dx[..., 3:]), covariance, fresh)
        better = quaternion.multiply(q, quaternion.exp(dx[..., :3]))
        return merged(lost, again, corrected), select(lost, q, better)

    def _predict(self, state: State, q: Array, z: Sample) -> tuple[Array, Array, Array]:
        spread, mean_weights, weights = sigma_weights(self.p)
        points = sigma_points(spread, state.covariance)
        attitudes = quaternion.multiply(q[..., None, :], quaternion.exp(points[..., :3]))
        biases = state.bias[..., None, :] + points[..., 3:]
        turned = quaternion.multiply(attitudes, quaternion.exp((z.rate[..., None, :] - biases) * z.dt))
        centre = turned[..., 0, :]
        turns = quaternion.log(quaternion.multiply(quaternion.conjugate(centre)[..., None, :], turned))
        spread_points = np.concatenate((turns, points[..., 3:]), axis=-1)
        mean = mean_of(mean_weights, spread_points)
        deviation = spread_points - mean[..., None, :]
        covariance = symmetric(moment(weights, deviation, deviation) + process_noise(self.p, z))
        covariance = limited_rotation(covariance)
        predicted = quaternion.multiply(centre, quaternion.exp(mean[..., :3]))
        return predicted, state.bias + mean[..., 3:], covariance

    def _expected(self, attitudes: Array, z: Sample) -> Array:
        """Specific force and field (..., 13, 6) at the sigma points; the reading itself where not usable."""
        force = -self.p.gravity * down_of(attitudes)
        horizontal, downward = z.field[..., None, :1], z.field[..., None, 1:]
        field = horizontal * north_of(attitudes) + downward * down_of(attitudes)
        force = np.where(z.accel_usable[..., None, None], force, z.accel[..., None, :])
        field = np.where(z.mag_usable[..., None, None], field, z.mag[..., None, :])
        return np.concatenate((force, field), axis=-1)


def limited_rotation(covariance: Array) -> Array:
    """Covariance whose rotation error is kept where a rotation has a meaning; it stays positive definite."""
    total = np.trace(covariance[..., :3, :3], axis1=-2, axis2=-1)
    scale = np.ones((*total.shape, _STATES))
    scale[..., :3] = np.sqrt(np.minimum(1.0, ROTATION_VARIANCE_MAX / total))[..., None]
    return covariance * outer(scale, scale)


def sigma_weights(p: Parameters) -> tuple[float, Array, Array]:
    """Spread of the sigma points and their weights (13,) in a mean and in a covariance."""
    scale = p.alpha**2 * (_STATES + p.kappa)
    centre = (scale - _STATES) / scale
    others = np.full(2 * _STATES, 0.5 / scale)
    mean = np.concatenate(([centre], others))
    covariance = np.concatenate(([centre + 1.0 - p.alpha**2 + p.beta], others))
    return float(np.sqrt(scale)), mean, covariance


def sigma_points(spread: float | Array, covariance: Array) -> Array:
    """Deviations (..., 13, 6) of the sigma points from the mean; the spread may be an array (..., 1, 1)."""
    columns = spread * transposed(cholesky(covariance))
    return np.concatenate((np.zeros_like(columns[..., :1, :]), columns, -columns), axis=-2)


def mean_of(weights: Array, points: Array) -> Array:
    """Weighted mean (..., n) of points (..., m, n), with weights (m,) or (..., m)."""
    mean: Array = np.einsum("...m,...mn->...n", weights, points)
    return mean


def moment(weights: Array, a: Array, b: Array) -> Array:
    """Weighted sum (..., n, k) of the outer products of deviations (..., m, n) and (..., m, k)."""
    product: Array = transposed(weights[..., :, None] * a) @ b
    return product

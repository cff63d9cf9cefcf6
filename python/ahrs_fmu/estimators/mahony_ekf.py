"""Mahony filter, smoothed by an EKF on the quaternion (docs/algorithms.md section 2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators import quaternion_ekf
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.mahony import mahony_step
from ahrs_fmu.estimators.matrices import quaternion_std
from ahrs_fmu.estimators.state import Array, Mask, Sample


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    bias : ndarray (..., 3)
        Gyroscope bias of the Mahony filter, rad/s.
    mahony : ndarray (..., 4)
        Attitude of the Mahony filter.
    covariance : ndarray (..., 4, 4)
        Of the quaternion.
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    bias: Array
    mahony: Array
    covariance: Array
    reset: Mask


class MahonyEKF(Filter[State]):
    """Mahony for the accuracy, an EKF behind it as a fast low-pass."""

    def initial(self, q: Array) -> State:
        """Start both filters at the same attitude."""
        covariance = quaternion_ekf.initial_covariance(self.p, self.shape)
        return State(np.zeros((*self.shape, 3)), q, covariance, np.zeros(self.shape, dtype=np.bool_))

    def turned(self, state: State, q: Array) -> State:
        """Turn the Mahony filter with the EKF."""
        return state._replace(mahony=q)

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Advance Mahony, predict with the rate less its bias, correct by its attitude."""
        bias, mahony = mahony_step(self.p, state.bias, state.mahony, z)
        mahony = quaternion.normalise(mahony)
        rate = z.rate - bias if self.p.bias_feed else z.rate
        covariance, q = quaternion_ekf.predict(self.p, state.covariance, q, rate, z)
        variance = quaternion_ekf.measurement_variance(self.p, z)
        everywhere = np.ones(self.shape, dtype=np.bool_)
        covariance, q, reset = quaternion_ekf.correct(self.p, covariance, q, mahony, variance, everywhere)
        return State(bias, mahony, covariance, reset), q

    def gyro_bias(self, state: State) -> Array:
        """Give the bias of the Mahony filter."""
        return state.bias

    def attitude_std(self, state: State, q: Array) -> Array:
        """Give the standard deviation about the body axes."""
        return quaternion_std(state.covariance, q)

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset

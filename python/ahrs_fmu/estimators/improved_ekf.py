"""EKF on the quaternion, measured by accelerometer and magnetometer (docs/algorithms.md section 1)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators import quaternion_ekf
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.matrices import quaternion_std
from ahrs_fmu.estimators.state import Array, Mask, Sample
from ahrs_fmu.estimators.vectors import measured_attitude


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    covariance : ndarray (..., 4, 4)
        Of the quaternion.
    reset : ndarray (...) of bool
        Whether the covariance was reset at the last sample.
    """

    covariance: Array
    reset: Mask


class ImprovedEKF(Filter[State]):
    """Predict the quaternion with the rate, correct it by accelerometer and magnetometer attitude."""

    def initial(self, q: Array) -> State:  # noqa: ARG002
        """Start with a wide covariance."""
        covariance = quaternion_ekf.initial_covariance(self.p, self.shape)
        return State(covariance, np.zeros(self.shape, dtype=np.bool_))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        covariance, q = quaternion_ekf.predict(self.p, state.covariance, q, z.rate, z)
        measured = measured_attitude(quaternion.normalise(q), z)
        variance = quaternion_ekf.measurement_variance(self.p, z)
        usable = (z.accel_usable | z.mag_usable) & (z.gain_dt > 0.0)
        covariance, q, reset = quaternion_ekf.correct(self.p, covariance, q, measured, variance, usable)
        return State(covariance, reset), q

    def attitude_std(self, state: State, q: Array) -> Array:
        """Give the standard deviation about the body axes."""
        return quaternion_std(state.covariance, q)

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset

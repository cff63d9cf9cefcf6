"""EKF on the quaternion, corrected by the attitude the sensors show (docs/algorithms.md section 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators import quaternion_ekf
from ahrs_fmu.estimators.common import Array, Mask, Sample
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.matrices import guarded, quaternion_std
from ahrs_fmu.estimators.vectors import measured_attitude


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


class ImprovedEKF(Filter[State]):
    """Predict the quaternion with the rate, correct it by accelerometer and magnetometer attitude."""

    def initial(self, q: Array) -> State:
        """Start with a wide covariance."""
        covariance = np.broadcast_to(np.eye(4), (*self.shape, 4, 4))
        return State(covariance, quaternion_std(covariance, q), np.zeros(self.shape, dtype=np.bool_))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        covariance, q = quaternion_ekf.predict(self.p, state.covariance, q, z.rate, z.dt)
        if z.gain_dt > 0.0:
            measured = measured_attitude(quaternion.normalise(q), z)
            variance = quaternion_ekf.measurement_variance(self.p, z)
            usable = z.accel_usable | z.mag_usable
            covariance, q = quaternion_ekf.correct(covariance, q, measured, variance, usable)
        q = quaternion.normalise(q)
        covariance, reset = guarded(covariance, np.eye(4))
        return State(covariance, quaternion_std(covariance, q), reset), q

    def attitude_std(self, state: State) -> Array:
        """Give the standard deviation about the body axes."""
        return state.std

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset

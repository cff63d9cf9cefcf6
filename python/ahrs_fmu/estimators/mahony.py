"""Mahony filter, proportional and integral, with decoupled heading (docs/algorithms.md section 2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.geometry import down_of, north_of
from ahrs_fmu.estimators.state import Array, Parameters, Sample
from ahrs_fmu.estimators.vectors import decoupled_error


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    bias : ndarray (..., 3)
        Gyroscope bias, rad/s.
    """

    bias: Array


class Mahony(Filter[State]):
    """Add the error of the predicted attitude to the rate, learn the bias from it."""

    def initial(self, q: Array) -> State:  # noqa: ARG002
        """Start without bias."""
        return State(np.zeros((*self.shape, 3)))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        bias, q = mahony_step(self.p, state.bias, q, z)
        return State(bias), q

    def gyro_bias(self, state: State) -> Array:
        """Give the integral part."""
        return state.bias


def mahony_step(p: Parameters, bias: Array, q: Array, z: Sample) -> tuple[Array, Array]:
    """Give the next bias (..., 3) and attitude (..., 4)."""
    predicted = quaternion.multiply(q, quaternion.exp((z.rate - bias) * z.dt))
    e = decoupled_error(down_of(predicted), north_of(predicted), z)
    bias = np.clip(bias - p.ki * z.gain_dt * e, -p.bias_limit, p.bias_limit)
    turn = (z.rate - bias) * z.dt + p.kp * z.gain_dt * e
    return bias, quaternion.multiply(q, quaternion.exp(turn))

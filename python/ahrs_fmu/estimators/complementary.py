"""Complementary filter of first order on the quaternion (docs/algorithms.md section 1)."""

from __future__ import annotations

from typing import NamedTuple

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.state import Array, Sample
from ahrs_fmu.estimators.vectors import attitude_error


class State(NamedTuple):
    """The attitude is all there is."""


class Complementary(Filter[State]):
    """Predict with the rate, go the part kp T of the way to the attitude that the sensors show."""

    def initial(self, q: Array) -> State:  # noqa: ARG002
        """Start with nothing."""
        return State()

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict and correct."""
        q = quaternion.multiply(q, quaternion.exp(z.rate * z.dt))
        e = attitude_error(q, z)
        return state, quaternion.multiply(q, quaternion.exp(self.p.kp * z.gain_dt * e))

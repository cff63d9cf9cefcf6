"""Gyroscope alone, by fourth-order angle increments (docs/algorithms.md section 1)."""

from __future__ import annotations

from typing import NamedTuple

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.increments import increment
from ahrs_fmu.estimators.state import Array, Sample


class State(NamedTuple):
    """The attitude is all there is."""


class Strapdown(Filter[State]):
    """Integrate the rate; accelerometer and magnetometer give the first attitude only."""

    corrects = False

    def initial(self, q: Array) -> State:  # noqa: ARG002
        """Start with nothing."""
        return State()

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Turn by the angle increment."""
        return state, quaternion.multiply(q, increment(z.rate * z.dt, order=4))

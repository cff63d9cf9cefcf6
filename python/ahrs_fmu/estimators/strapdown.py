"""Gyroscope alone, integrated to the fourth order of the angle increment (docs/algorithms.md section 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu.estimators.common import Array, Sample, dot
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.matrices import apply, rate_matrix


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
        return state, apply(increment_matrix(z.rate * z.dt), q)


def increment_matrix(d: Array) -> Array:
    """Matrix (..., 4, 4) that turns a quaternion by the small rotation vector d (..., 3), to fourth order."""
    s = dot(d, d)[..., None, None]
    matrix: Array = (1.0 - s / 8.0 + s * s / 384.0) * np.eye(4) + (0.5 - s / 48.0) * rate_matrix(d)
    return matrix

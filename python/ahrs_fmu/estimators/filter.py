"""The frame of a numpy filter: one sample at a time for any batch of runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu.estimators import common
from ahrs_fmu.estimators.state import (
    Array,
    CommonState,
    Condition,
    Inputs,
    Mask,
    Parameters,
    Sample,
    select,
)

S = TypeVar("S", bound="tuple[NDArray[np.generic], ...]")


class Filter(ABC, Generic[S]):
    """An estimator that predicts with the gyroscope and corrects with the other two sensors.

    A subclass gives its equations as pure functions of its state, a named tuple of arrays whose leading
    dimensions are those of the batch; which runs of a batch they apply to is decided here.

    Parameters
    ----------
    p : Parameters
        Values of all parameters of the model by name.
    shape : tuple of int
        Shape of the batch; () is one run.
    """

    corrects = True
    """Whether accelerometer and magnetometer are used after the first attitude."""

    def __init__(self, p: Parameters, shape: tuple[int, ...] = ()) -> None:
        self.p = p
        self.shape = shape
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first sample."""
        self.common = CommonState.initial(self.shape)
        self.state = self.initial(self.common.q)

    @abstractmethod
    def initial(self, q: Array) -> S:
        """Give the state at the first attitude q (..., 4)."""

    def turned(self, state: S, q: Array) -> S:  # noqa: ARG002
        """Give the state after the attitude was turned about the vertical to q (..., 4)."""
        return state

    @abstractmethod
    def step(self, state: S, q: Array, z: Sample) -> tuple[S, Array]:
        """Predict and correct: the next state and attitude (..., 4), not necessarily of unit length.

        Runs without a usable sensor hold zeros in its place; runs that do nothing now may hold anything.
        """

    def gyro_bias(self, state: S) -> Array:  # noqa: ARG002
        """Give the estimated bias of the gyroscope (..., 3), rad/s; zero for a filter that has none."""
        return np.zeros((*self.shape, 3))

    def attitude_std(self, state: S, q: Array) -> Array | None:  # noqa: ARG002
        """Give the standard deviation of the attitude about the body axes (..., 3), rad; None if unknown."""
        return None

    def covariance_reset(self, state: S) -> Mask | None:  # noqa: ARG002
        """Where the last step had to reset the covariance; None for a filter that has none."""
        return None

    def update(self, inputs: Inputs, dt: float) -> None:
        """Take in one sample of every run, `dt` seconds after the last."""
        # Runs that are masked out divide by zero and overflow without harm.
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            z = common.begin(self.common, self.p, inputs, dt)
            if z is not None:
                self._advance(z)

    def outputs(self) -> dict[str, NDArray[np.generic]]:
        """Give the outputs of the model by name, in the axes of the user."""
        result = common.outputs(self.common, self.p, self.gyro_bias(self.state))
        std, reset = self.attitude_std(self.state, self.common.q), self.covariance_reset(self.state)
        if std is not None:
            result["attitude_std"] = std
        if reset is not None:
            result["covariance_reset"] = self.common.has(Condition.COVARIANCE_RESET)
        return result

    def _advance(self, z: Sample) -> None:
        if z.start.any():
            self.state = merged(z.start, self.initial(self.common.q), self.state)
        if z.turn.any():
            self.state = merged(z.turn, self.turned(self.state, self.common.q), self.state)
        if not z.run.any():
            return
        state, q = self.step(self.state, self.common.q, z)
        self.state = state if z.run.all() else merged(z.run, state, self.state)
        common.end(self.common, self.p, z, q)
        if not self.corrects:
            self.common.assign(Condition.ACCEL_USED | Condition.MAG_USED, np.zeros_like(z.run), z.run)
        reset = self.covariance_reset(self.state)
        if reset is not None:
            self.common.mark(Condition.COVARIANCE_RESET, z.run & reset)


def merged(where: Mask, new: S, old: S) -> S:
    """State whose runs are those of `new` where a mask is true and those of `old` elsewhere."""
    return type(new)(*(select(where, a, b) for a, b in zip(new, old, strict=True)))

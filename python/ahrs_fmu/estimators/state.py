"""What a numpy filter remembers and what it is told, for any batch of runs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntFlag
from types import SimpleNamespace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import quaternion

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
T = TypeVar("T", bound=np.generic)
Parameters = SimpleNamespace
"""Parameter values by name; that of an enumeration is the name of its item."""


class Condition(IntFlag):
    """Bits of `CommonState.conditions`."""

    HAS_ATTITUDE = 1
    HAS_HEADING = 2
    HAS_FIELD = 4
    GYRO_HELD = 8
    ACCEL_USED = 16
    MAG_USED = 32
    STEP_REJECTED = 64
    MOVED = 128
    COVARIANCE_RESET = 256
    ACCEL_SUMMED = 512
    MAG_SUMMED = 1024
    IMPLAUSIBLE = 2048
    MAG_DISTURBED = 4096
    HAS_GYRO_ZERO = 8192
    SMOOTHS_FORCE = 16384


MOMENTARY = (
    Condition.GYRO_HELD
    | Condition.ACCEL_USED
    | Condition.MAG_USED
    | Condition.STEP_REJECTED
    | Condition.COVARIANCE_RESET
    | Condition.IMPLAUSIBLE
    | Condition.MAG_DISTURBED
)
"""Those that tell of one sample only."""

STATUS = (
    "nominal",
    "mag_disturbed",
    "mag_unused",
    "accel_unused",
    "gyro_held",
    "step_rejected",
    "covariance_reset",
    "implausible",
    "initialising_in_motion",
    "initialising",
)
"""Names of the status, by its number."""


class Inputs(NamedTuple):
    """One sample of every run, in the axes of the user."""

    gyro: Array
    accel: Array
    mag: Array
    accel_valid: Mask
    mag_valid: Mask


class Sample(NamedTuple):
    """One sample of every run in inner axes. Vectors that are not usable are zero.

    `start`: the first attitude is there, begin from it. `turn`: the attitude was turned to north, take it
    over, then run. `run`: predict and correct. `gain_dt` is 0 after a gap that is too long to correct over.
    """

    rate: Array
    force: Array
    accel: Array
    mag: Array
    gyro_held: Mask
    force_usable: Mask
    accel_usable: Mask
    mag_usable: Mask
    start: Mask
    turn: Mask
    run: Mask
    field: Array
    dt: float
    gain_dt: float


@dataclass(slots=True)
class CommonState:
    """State that every estimator has, leading dimensions are those of the batch.

    Attributes
    ----------
    q : ndarray (..., 4)
        Attitude, body (forward-right-down) to magnetic north-east-down.
    gyro : ndarray (..., 3)
        Last usable rate, rad/s.
    motion_accel : ndarray (..., 3)
        Estimated motion acceleration, body axes, m/s2.
    field : ndarray (..., 2)
        Reference field: horizontal and downward part, T.
    accel_sum, mag_sum : ndarray (..., 3)
        Sums of the samples that initialise the attitude.
    elapsed, gated : ndarray (...)
        Time since the first of these samples; time for which the accelerometer has been ignored, s.
    force_low, force_band : ndarray (..., 3)
        States of the accelerometer's low-pass, m/s2.
    gyro_zero : ndarray (..., 3)
        Zero of the gyroscope, or the mean that becomes it, rad/s.
    gyro_spread, force_excess, zero_count : ndarray (...)
        Squared deviations from that mean, mean of specific force minus gravity, samples in them.
    conditions : ndarray (...) of int32
        Bits of `Condition`.
    """

    q: Array
    gyro: Array
    motion_accel: Array
    field: Array
    accel_sum: Array
    mag_sum: Array
    elapsed: Array
    gated: Array
    force_low: Array
    force_band: Array
    gyro_zero: Array
    gyro_spread: Array
    force_excess: Array
    zero_count: NDArray[np.int32]
    conditions: NDArray[np.int32]

    @classmethod
    def initial(cls, shape: tuple[int, ...]) -> CommonState:
        """State before the first sample, for a batch of `shape`."""
        return cls(
            q=np.broadcast_to(quaternion.IDENTITY, (*shape, 4)),
            gyro=np.zeros((*shape, 3)),
            motion_accel=np.zeros((*shape, 3)),
            field=np.zeros((*shape, 2)),
            accel_sum=np.zeros((*shape, 3)),
            mag_sum=np.zeros((*shape, 3)),
            elapsed=np.zeros(shape),
            gated=np.zeros(shape),
            force_low=np.zeros((*shape, 3)),
            force_band=np.zeros((*shape, 3)),
            gyro_zero=np.zeros((*shape, 3)),
            gyro_spread=np.zeros(shape),
            force_excess=np.zeros(shape),
            zero_count=np.zeros(shape, dtype=np.int32),
            conditions=np.zeros(shape, dtype=np.int32),
        )

    def has(self, condition: Condition) -> Mask:
        """Where a condition holds."""
        held: Mask = (self.conditions & np.int32(condition)) != 0
        return held

    def mark(self, condition: Condition, where: Mask) -> None:
        """Set a condition where a mask is true."""
        self.conditions = np.where(where, self.conditions | np.int32(condition), self.conditions)

    def assign(self, condition: Condition, value: Mask, where: Mask) -> None:
        """Set or clear a condition where a mask is true."""
        kept = self.conditions & ~np.int32(condition)
        self.conditions = np.where(where, np.where(value, kept | np.int32(condition), kept), self.conditions)

    def restart(self, where: Mask) -> None:
        """Forget everything where a mask is true."""
        fresh = CommonState.initial(where.shape)
        for field in fields(self):
            old, new = getattr(self, field.name), getattr(fresh, field.name)
            setattr(self, field.name, select(where, new, old))


def select(where: Mask, new: NDArray[T], old: NDArray[T]) -> NDArray[T]:
    """Elements of `new` (..., any trailing shape) where the mask (...) is true, of `old` elsewhere."""
    where = np.asarray(where)
    return np.where(where.reshape(where.shape + (1,) * (np.ndim(old) - where.ndim)), new, old)

"""What an estimator returns: one estimate, or a recording's worth of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import descriptors
from ahrs_fmu.frames import Frame

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

COMMON_OUTPUTS = frozenset(output.name for output in descriptors.interface("estimator").outputs)
"""Outputs that every estimator has, or may have."""

_FLAGS = ("gyro_held", "accel_used", "mag_used", "covariance_reset")
_NOT_REAL = frozenset(("status", *_FLAGS))


class Status(IntEnum):
    """The worst condition now; one numbering for all estimators, as in estimator.toml."""

    NOMINAL = 0
    MAG_DISTURBED = 1
    MAG_UNUSED = 2
    ACCEL_UNUSED = 3
    GYRO_HELD = 4
    STEP_REJECTED = 5
    COVARIANCE_RESET = 6
    IMPLAUSIBLE = 7
    INITIALISING_IN_MOTION = 8
    INITIALISING = 9


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """The attitude after one sample.

    Attributes
    ----------
    q : ndarray, shape (4,)
        Body to navigation, scalar first.
    euler : ndarray, shape (3,)
        Roll, pitch, yaw in radians, z-y-x order.
    rate, gyro_bias : ndarray, shape (3,)
        Rate without bias, and the bias; body axes, rad/s.
    motion_accel : ndarray, shape (3,)
        Accelerometer without gravity; body axes, m/s2.
    attitude_std : ndarray, shape (3,), or None
        Standard deviation of the attitude error about the body axes, rad; from filters with a covariance.
    status : Status
        The worst condition now.
    gyro_held, accel_used, mag_used, covariance_reset : bool
        The conditions behind it.
    others : mapping of str to ndarray
        Outputs that only this estimator has.
    """

    q: FloatArray
    euler: FloatArray
    rate: FloatArray
    gyro_bias: FloatArray
    motion_accel: FloatArray
    attitude_std: FloatArray | None
    status: Status
    gyro_held: bool
    accel_used: bool
    mag_used: bool
    covariance_reset: bool
    others: Mapping[str, FloatArray] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class EstimateResult:
    """The attitude over a recording; row k is the estimate after row k of the recording.

    Attributes are those of `Estimate` with a leading dimension of N rows, and:

    Attributes
    ----------
    time : ndarray, shape (N,)
        Seconds, of the recording.
    frame : Frame
        Frame of `q`, of the angles and of the body vectors.
    status : ndarray of int, shape (N,)
        Values of `Status`.
    """

    time: FloatArray
    frame: Frame
    q: FloatArray
    euler: FloatArray
    rate: FloatArray
    gyro_bias: FloatArray
    motion_accel: FloatArray
    attitude_std: FloatArray | None
    status: NDArray[np.int32]
    gyro_held: BoolArray
    accel_used: BoolArray
    mag_used: BoolArray
    covariance_reset: BoolArray
    others: Mapping[str, FloatArray] = field(default_factory=dict)

    @classmethod
    def from_outputs(
        cls, time: FloatArray, frame: Frame, outputs: Mapping[str, NDArray[np.generic]]
    ) -> EstimateResult:
        """Collect the output variables of an estimator, of whatever type a back-end keeps them in.

        Parameters
        ----------
        time : ndarray, shape (N,)
            Seconds.
        frame : Frame
            Frame of the outputs.
        outputs : mapping of str to ndarray, shape (N, ...)
            Every output by its name.
        """
        # Arrays that are of the right type already are taken over, not copied.
        floats = {
            name: np.asarray(values, dtype=np.float64)
            for name, values in outputs.items()
            if name not in _NOT_REAL
        }
        flags = {name: np.asarray(outputs[name], dtype=np.bool_) for name in _FLAGS if name in outputs}
        return cls(
            time=time,
            frame=frame,
            q=floats["q"],
            euler=np.stack((floats["roll"], floats["pitch"], floats["yaw"]), axis=-1),
            rate=floats["rate"],
            gyro_bias=floats["gyro_bias"],
            motion_accel=floats["motion_accel"],
            attitude_std=floats.get("attitude_std"),
            status=np.asarray(outputs["status"], dtype=np.int32),
            gyro_held=flags["gyro_held"],
            accel_used=flags["accel_used"],
            mag_used=flags["mag_used"],
            covariance_reset=flags.get("covariance_reset", np.zeros(len(time), dtype=np.bool_)),
            others={name: values for name, values in floats.items() if name not in COMMON_OUTPUTS},
        )

    def __len__(self) -> int:
        return len(self.time)

    @property
    def roll(self) -> FloatArray:
        """Roll angle (N,), rad."""
        return self.euler[:, 0]

    @property
    def pitch(self) -> FloatArray:
        """Pitch angle (N,), rad."""
        return self.euler[:, 1]

    @property
    def yaw(self) -> FloatArray:
        """Yaw angle (N,), rad."""
        return self.euler[:, 2]

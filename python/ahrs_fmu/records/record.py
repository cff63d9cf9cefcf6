"""One recording in memory."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import frames
from ahrs_fmu.errors import RecordError
from ahrs_fmu.frames import Frame

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MIN_SAMPLES = 2


def _absent() -> FloatArray:
    return np.full(3, np.nan)


def _always() -> BoolArray:
    return np.ones(1, dtype=np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Samples of gyroscope, accelerometer and magnetometer, with the true attitude when it is known.

    Row k holds the mean angular rate over (t_{k-1}, t_k] and the specific force and field at t_k.
    NaN in a sensor is data: the sensor said nothing in that row. The arrays are copied and locked.
    A single row given for `mag`, `accel_valid`, `mag_valid` or `evaluate` stands for all rows.

    Attributes
    ----------
    time : ndarray, shape (N,)
        Seconds, finite and strictly increasing.
    gyro : ndarray, shape (N, 3)
        Angular rate in body axes, rad/s.
    accel : ndarray, shape (N, 3)
        Specific force in body axes, m/s2; level rest reads (0, 0, -g) in NED, (0, 0, +g) in ENU.
    mag : ndarray, shape (N, 3)
        Magnetic flux density in body axes, T; NaN, the default, where there is no magnetometer.
    frame : Frame
        Axes of everything in the record.
    accel_valid, mag_valid : ndarray of bool, shape (N,)
        What the estimators are told about the sensor; true by default.
    q_true : ndarray, shape (N, 4), or None
        True attitude, body to navigation, scalar first, NaN rows where unknown.
    evaluate : ndarray of bool, shape (N,), or None
        Samples that count in a metric; None: all of them.
    name : str
        What to call the record in tables and plots.

    Raises
    ------
    RecordError
        Wrong shapes, fewer than two samples, or time that is not finite and increasing.
    """

    time: FloatArray
    gyro: FloatArray
    accel: FloatArray
    mag: FloatArray = field(default_factory=_absent)
    frame: Frame = Frame.NED
    accel_valid: BoolArray = field(default_factory=_always)
    mag_valid: BoolArray = field(default_factory=_always)
    q_true: FloatArray | None = None
    evaluate: BoolArray | None = None
    name: str = "record"

    def __post_init__(self) -> None:
        time = np.asarray(self.time, dtype=np.float64)
        if time.ndim != 1 or time.size < MIN_SAMPLES:
            raise RecordError(
                f"{self.name}: time has shape {time.shape}; a record needs (N,) with N >= {MIN_SAMPLES}"
            )
        n = time.size
        self._lock("time", time, (n,), np.float64)
        for sensor in ("gyro", "accel", "mag"):
            self._lock(sensor, getattr(self, sensor), (n, 3), np.float64)
        for flag in ("accel_valid", "mag_valid"):
            self._lock(flag, getattr(self, flag), (n,), np.bool_)
        if self.q_true is not None:
            self._lock("q_true", self.q_true, (n, 4), np.float64)
        if self.evaluate is not None:
            self._lock("evaluate", self.evaluate, (n,), np.bool_)
        self._check_time()

    def _lock(self, name: str, value: object, shape: tuple[int, ...], dtype: type[np.generic]) -> None:
        given = np.asarray(value, dtype=dtype)
        try:
            array = np.array(np.broadcast_to(given, shape), order="C")
        except ValueError:
            raise RecordError(f"{self.name}: {name} has shape {given.shape}; expected {shape}") from None
        array.flags.writeable = False
        object.__setattr__(self, name, array)

    def _check_time(self) -> None:
        lost = np.flatnonzero(~np.isfinite(self.time))
        if lost.size:
            raise RecordError(
                f"{self.name}: time of row {lost[0]} is {self.time[lost[0]]}; it must be finite"
            )
        back = np.flatnonzero(np.diff(self.time) <= 0.0)
        if back.size:
            row = int(back[0]) + 1
            raise RecordError(
                f"{self.name}: time must increase, but row {row} has {self.time[row]:.9g} s"
                f" after {self.time[row - 1]:.9g} s"
            )

    def __len__(self) -> int:
        return int(self.time.size)

    @property
    def sample_time(self) -> float:
        """Median time between rows, s."""
        return float(np.median(np.diff(self.time)))

    @property
    def duration(self) -> float:
        """Time from the first row to the last, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def has_mag(self) -> bool:
        """Whether any row holds a magnetometer sample."""
        return bool(np.isfinite(self.mag).all(axis=1).any())

    def rows(self, start: int | None = None, stop: int | None = None) -> Record:
        """Return the rows start to stop - 1 as a record of their own."""
        part = slice(start, stop)
        return replace(
            self,
            time=self.time[part],
            gyro=self.gyro[part],
            accel=self.accel[part],
            mag=self.mag[part],
            accel_valid=self.accel_valid[part],
            mag_valid=self.mag_valid[part],
            q_true=None if self.q_true is None else self.q_true[part],
            evaluate=None if self.evaluate is None else self.evaluate[part],
        )

    def in_frame(self, frame: Frame) -> Record:
        """Return the same recording in the axes of `frame`."""
        return replace(
            self,
            frame=frame,
            gyro=frames.body_vector(self.gyro, self.frame, frame),
            accel=frames.body_vector(self.accel, self.frame, frame),
            mag=frames.body_vector(self.mag, self.frame, frame),
            q_true=None if self.q_true is None else frames.attitude(self.q_true, self.frame, frame),
        )

"""One recording in memory."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu import frames
from ahrs_fmu.errors import RecordError
from ahrs_fmu.frames import Frame

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MIN_SAMPLES = 2
_REGULAR = 1e-3


class TimeFault(NamedTuple):
    """The first row whose time cannot be used, and why."""

    row: int
    reason: str


def time_fault(time: FloatArray) -> TimeFault | None:
    """Find the first row of time (N,) that is not finite or not after the row before it."""
    lost = np.flatnonzero(~np.isfinite(time))
    back = np.flatnonzero(np.diff(time) <= 0.0) + 1
    if lost.size and not (back.size and back[0] < lost[0]):
        return TimeFault(int(lost[0]), f"time is {time[lost[0]]}; it must be finite")
    if back.size:
        row = int(back[0])
        return TimeFault(row, f"time must increase, but {time[row]:.9g} s comes after {time[row - 1]:.9g} s")
    return None


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Samples of gyroscope, accelerometer and magnetometer, with the true attitude when it is known.

    Row k holds the mean angular rate over (t_{k-1}, t_k] and the specific force and field at t_k.
    NaN in a sensor is data: the sensor said nothing in that row. The arrays are copied and locked.
    `mag` left out or empty is a record without magnetometer; flags left out or empty are true.

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
    is_regular : bool
        Whether every row lies within a thousandth of an interval of an even grid.

    Raises
    ------
    RecordError
        Wrong shapes, fewer than two samples, or time that is not finite and increasing.
    """

    time: FloatArray
    gyro: FloatArray
    accel: FloatArray
    mag: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    frame: Frame = Frame.NED
    accel_valid: BoolArray = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    mag_valid: BoolArray = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    q_true: FloatArray | None = None
    evaluate: BoolArray | None = None
    name: str = "record"
    is_regular: bool = field(init=False)

    def __post_init__(self) -> None:
        time = np.asarray(self.time, dtype=np.float64)
        if time.ndim != 1 or time.size < MIN_SAMPLES:
            raise RecordError(f"time has shape {time.shape}; a record needs (N,) with N >= {MIN_SAMPLES}")
        fault = time_fault(time)
        if fault:
            raise RecordError(f"row {fault.row}: {fault.reason}")
        n = time.size
        self._lock("time", time)
        for sensor in ("gyro", "accel"):
            self._lock(sensor, _shaped(sensor, getattr(self, sensor), (n, 3), np.float64))
        self._lock("mag", _shaped("mag", _or_fill(self.mag, (n, 3), np.nan), (n, 3), np.float64))
        for flag in ("accel_valid", "mag_valid"):
            self._lock(flag, _shaped(flag, _or_fill(getattr(self, flag), (n,), True), (n,), np.bool_))
        if self.q_true is not None:
            self._lock("q_true", _shaped("q_true", self.q_true, (n, 4), np.float64))
        if self.evaluate is not None:
            self._lock("evaluate", _shaped("evaluate", self.evaluate, (n,), np.bool_))
        off_grid = np.abs(time - np.linspace(time[0], time[-1], n)).max()
        object.__setattr__(self, "is_regular", bool(off_grid * (n - 1) < _REGULAR * self.duration))

    def _lock(self, name: str, value: NDArray[np.generic]) -> None:
        array = np.array(value, order="C")
        array.flags.writeable = False
        object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return int(self.time.size)

    @property
    def sample_time(self) -> float:
        """Time between rows, s: the interval of the grid when the rows are regular, else the median."""
        return self.duration / (len(self) - 1) if self.is_regular else float(np.median(np.diff(self.time)))

    @property
    def steps(self) -> FloatArray:
        """Time since the row before (N,), s: 0 in the first, the same in all others of a regular record."""
        steps = np.full(len(self), self.sample_time) if self.is_regular else np.diff(self.time, prepend=0.0)
        steps[0] = 0.0
        return steps

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

    def in_frame(self, frame: Frame | str) -> Record:
        """Return the same recording in the axes of `frame`, a `Frame` or its name."""
        frame = Frame(frame)
        return replace(
            self,
            frame=frame,
            gyro=frames.body_vector(self.gyro, self.frame, frame),
            accel=frames.body_vector(self.accel, self.frame, frame),
            mag=frames.body_vector(self.mag, self.frame, frame),
            q_true=None if self.q_true is None else frames.attitude(self.q_true, self.frame, frame),
        )


def _shaped(
    name: str, value: ArrayLike, shape: tuple[int, ...], dtype: type[np.generic]
) -> NDArray[np.generic]:
    array = np.asarray(value, dtype=dtype)
    if array.shape != shape:
        raise RecordError(f"{name} has shape {array.shape}; expected {shape}")
    return array


def _or_fill(value: ArrayLike, shape: tuple[int, ...], fill: float | bool) -> ArrayLike:
    return np.full(shape, fill) if np.size(value) == 0 else value

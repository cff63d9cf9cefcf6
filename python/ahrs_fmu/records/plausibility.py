"""Judge whether a recording can be in the units and the frame it is said to be in.

A wrong unit does not stop an estimator: it gives a smooth, wrong attitude. So a file whose numbers
look like another unit is refused, unless the caller insists on the unit.
"""

from __future__ import annotations

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.errors import RecordError
from ahrs_fmu.frames import Frame
from ahrs_fmu.records.record import FloatArray, Record
from ahrs_fmu.records.signals import STANDARD_GRAVITY

_ACCEL_GUESSES = (("g", 0.5, 2.0), ("mg", 500.0, 2000.0))
_MAG_GUESSES = (
    ("mT", 0.01, 0.12),
    ("G", 0.12, 1.5),
    ("uT", 10.0, 120.0),
    ("mG", 120.0, 1500.0),
    ("nT", 1e4, 1.2e5),
)
_TIME_GUESSES = (("ms", 1.0, 1e3), ("us", 1e3, 1e6), ("ns", 1e6, 1e9))
_MAX_ACCEL = 20.0 * STANDARD_GRAVITY
_MAX_MAG = 1e-3
_MAX_STEP = 1.0
_CLEARLY_VERTICAL = 0.5 * STANDARD_GRAVITY
_GYRO_FULL_SCALE = np.radians(2000.0)
_GYRO_SLOW = 3.0
"""rad/s; below this rate the two readings of a gyro are not told apart."""
_WINDOW = 0.2
"""s; long enough for a turn to stand out of the noise, short enough for a bias not to matter."""


def check_units(record: Record, trusted: frozenset[str]) -> None:
    """Refuse signals that look like another unit than SI.

    Parameters
    ----------
    record : Record
        What was read, taken to be in SI.
    trusted : frozenset of str
        Signals whose unit the caller has declared; they are not judged.

    Raises
    ------
    RecordError
        The message names the unit that fits and how to declare it.
    """
    if "time" not in trusted:
        _judge("time", record.sample_time, "s", "a median step", _MAX_STEP, _TIME_GUESSES)
    if "accel" not in trusted:
        _judge("accel", _median_length(record.accel), "m/s2", "a median length", _MAX_ACCEL, _ACCEL_GUESSES)
    if "mag" not in trusted:
        _judge("mag", _median_length(record.mag), "T", "a median length", _MAX_MAG, _MAG_GUESSES)
    if "gyro" not in trusted:
        _judge_gyro(record)


def detect_frame(record: Record) -> Frame:
    """Tell the frame from the sign of the vertical specific force.

    At rest it points up: +g on the third axis in ENU, -g in NED. The mean over the recording is taken
    in the navigation frame when the true attitude is known and in the body frame otherwise. The frame
    that the record carries is not looked at.

    Raises
    ------
    RecordError
        The mean is closer to zero than half of g, so that the frame must be declared.
    """
    vertical = _vertical_force(record)
    if abs(vertical) < _CLEARLY_VERTICAL:
        raise RecordError(
            f"the frame cannot be told from the accelerometer (mean z {vertical:.2f} m/s2):"
            " declare frame 'ned' or 'enu'"
        )
    return Frame.ENU if vertical > 0.0 else Frame.NED


def check_gravity_sign(record: Record) -> None:
    """Refuse an accelerometer that, seen through the true attitude, says that gravity pushes up.

    Raises
    ------
    RecordError
        The sign of the specific force contradicts the frame of the record.
    """
    up = 1.0 if record.frame is Frame.ENU else -1.0
    if record.q_true is not None and up * _vertical_force(record) < -_CLEARLY_VERTICAL:
        raise RecordError(
            f"accel points down through the true attitude in frame {record.frame.value}; it must be specific"
            " force, which points up at rest: declare the other frame, or reverse accel"
        )


def _vertical_force(record: Record) -> float:
    force = record.accel if record.q_true is None else quaternion.rotate(record.q_true, record.accel)
    known = np.isfinite(force).all(axis=-1)
    return float(np.mean(force[known, 2])) if known.any() else 0.0


def _median_length(vectors: FloatArray) -> float:
    known = vectors[np.isfinite(vectors).all(axis=-1)]
    return float(np.median(np.linalg.norm(known, axis=-1))) if known.size else 0.0


def _judge(
    signal: str,
    value: float,
    unit: str,
    what: str,
    limit: float,
    guesses: tuple[tuple[str, float, float], ...],
) -> None:
    fits = [name for name, low, high in guesses if low < value <= high]
    if fits:
        raise RecordError(
            f"{signal} has {what} of {value:.4g}, so it is apparently in {fits[0]}, not in {unit}:"
            f" {_how(signal, fits[0])}"
        )
    if value > limit:
        raise RecordError(
            f"{signal} has {what} of {value:.4g}, which no sensor shows in {unit}; declare its unit"
        )


def _judge_gyro(record: Record) -> None:
    rates = np.linalg.norm(record.gyro[np.isfinite(record.gyro).all(axis=-1)], axis=-1)
    fast = float(np.percentile(rates, 99.0)) if rates.size else 0.0
    if fast < _GYRO_SLOW:
        return
    direction = record.mag if record.has_mag else record.accel
    as_rad, as_deg = (
        _turn_residual(record.time, record.gyro * scale, direction) for scale in (1.0, np.pi / 180.0)
    )
    if fast > _GYRO_FULL_SCALE or as_deg < 0.5 * as_rad:
        raise RecordError(
            f"gyro reaches {fast:.4g}, which does not fit the other sensors in rad/s, so it is apparently"
            f" in deg/s: {_how('gyro', 'deg/s')}"
        )


def _turn_residual(time: FloatArray, gyro: FloatArray, direction: FloatArray) -> float:
    """RMS by which a field fixed in space misses, in body axes, the turn that the gyro reports."""
    steps = np.diff(time)
    length = min(max(1, round(_WINDOW / float(np.median(steps)))), steps.size)
    start = np.arange(0, steps.size - length + 1, length)
    turn = np.tile(quaternion.IDENTITY, (start.size, 1))
    for k in range(1, length + 1):
        angle = gyro[start + k] * steps[start + k - 1, None]
        turn = quaternion.multiply(turn, quaternion.exp(angle))
    length_of = np.linalg.norm(direction, axis=-1, keepdims=True)
    unit = direction / np.where(length_of > 0.0, length_of, np.nan)
    miss = quaternion.rotate(quaternion.conjugate(turn), unit[start]) - unit[start + length]
    miss = miss[np.isfinite(miss).all(axis=-1)]
    return float(np.sqrt(np.mean(miss**2))) if miss.size else 0.0


def _how(signal: str, unit: str) -> str:
    return f"declare it (units={{'{signal}': '{unit}'}}, or --unit {signal}={unit})"

"""Calibration before the flight and the accelerometer low-pass (docs/algorithms.md, preprocessing).

Every function refuses data it cannot trust with a `CalibrationError` that holds the measured value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import lfilter, lfilter_zi

from ahrs_fmu.errors import CalibrationError, DesignError
from ahrs_fmu.frames import Frame

Array = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665
MOTION_FACTOR = 3.0
GRAVITY_TOLERANCE = 0.3
MIN_COVERAGE = 0.2


def gyro_zero_bias(
    gyro: ArrayLike,
    accel: ArrayLike,
    *,
    noise_std: float,
    samples: int = 200,
    gravity: float = STANDARD_GRAVITY,
) -> Array:
    """Bias of a gyroscope at rest: the mean of its first samples.

    Parameters
    ----------
    gyro, accel : array (N, 3)
        Readings, rad/s and m/s2; the first `samples` rows are used.
    noise_std : float
        Nominal standard deviation of one gyroscope sample, rad/s.
    samples : int
        Length of the rest, rows.
    gravity : float
        Local gravity, m/s2.

    Returns
    -------
    array (3,)
        Bias to subtract, rad/s.

    Raises
    ------
    CalibrationError
        If there are too few samples, one is not finite, the rate varies by more than three times its noise
        or the magnitude of the specific force is on average further than 0.3 m/s2 from gravity.
    """
    rate = _rest("gyro", gyro, samples)
    force = _rest("accel", accel, samples)
    spread = float(rate.std(axis=0).max())
    if spread > MOTION_FACTOR * noise_std:
        raise CalibrationError(
            f"gyro standard deviation is {spread:.3g} rad/s, limit {MOTION_FACTOR * noise_std:.3g} rad/s: "
            "the vehicle moves; keep it at rest or give its true noise_std"
        )
    # On average, so that neither one noisy sample counts as motion nor shaking cancels.
    excess = float(np.abs(np.linalg.norm(force, axis=-1) - gravity).mean())
    if excess > GRAVITY_TOLERANCE:
        raise CalibrationError(
            f"specific force differs from gravity by {excess:.3g} m/s2, limit {GRAVITY_TOLERANCE} m/s2: "
            "the vehicle accelerates or the accelerometer needs calibration"
        )
    bias: Array = rate.mean(axis=0)
    return bias


def accel_zero_bias(
    accel: ArrayLike,
    *,
    samples: int = 200,
    gravity: float = STANDARD_GRAVITY,
    frame: Frame = Frame.NED,
) -> Array:
    """Bias of an accelerometer on a levelled vehicle at rest.

    Only what is left of the mean after gravity is bias: level rest reads (0, 0, -g) in NED, +g in ENU.

    Parameters
    ----------
    accel : array (N, 3)
        Specific force, m/s2; the first `samples` rows are used.
    samples : int
        Length of the rest, rows.
    gravity : float
        Local gravity, m/s2.
    frame : Frame
        Axes of the reading.

    Returns
    -------
    array (3,)
        Bias to subtract, m/s2.

    Raises
    ------
    CalibrationError
        If there are too few samples or one is not finite.
    """
    level = -gravity if frame is Frame.NED else gravity
    bias: Array = _rest("accel", accel, samples).mean(axis=0) - np.array([0.0, 0.0, level])
    return bias


@dataclass(frozen=True, slots=True)
class MagCalibration:
    """Offset and relative gains of a magnetometer.

    Attributes
    ----------
    offset : tuple of 3
        Hard iron, T.
    gain : tuple of 3
        Factor that gives each axis the range of the x axis, 1.
    """

    offset: tuple[float, float, float]
    gain: tuple[float, float, float]

    def apply(self, mag: ArrayLike) -> Array:
        """Correct readings (..., 3), T."""
        corrected: Array = (np.asarray(mag, dtype=np.float64) - np.array(self.offset)) * np.array(self.gain)
        return corrected


def mag_min_max(mag: ArrayLike) -> MagCalibration:
    """Calibrate a magnetometer that was turned through all attitudes.

    Parameters
    ----------
    mag : array (N, 3)
        Readings, T; rows that are not finite are left out.

    Raises
    ------
    CalibrationError
        If the readings do not cover all axes: the smallest range is below 0.2 of the largest.
    """
    mag = np.asarray(mag, dtype=np.float64).reshape(-1, 3)
    mag = mag[np.isfinite(mag).all(axis=-1)]
    if mag.shape[0] < 2:
        raise CalibrationError(f"mag has {mag.shape[0]} usable rows; turn the vehicle through all attitudes")
    high, low = mag.max(axis=0), mag.min(axis=0)
    radius = 0.5 * (high - low)
    coverage = float(radius.min() / radius.max()) if radius.max() > 0.0 else 0.0
    if coverage < MIN_COVERAGE:
        raise CalibrationError(
            f"mag covers its {'xyz'[int(radius.argmin())]} axis with {coverage:.3g} of the largest range, "
            f"limit {MIN_COVERAGE}: turn the vehicle through all attitudes"
        )
    ox, oy, oz = (0.5 * (high + low)).tolist()
    gx, gy, gz = (radius[0] / radius).tolist()
    return MagCalibration((ox, oy, oz), (gx, gy, gz))


def butterworth_coefficients(cutoff: float, sample_time: float) -> tuple[Array, Array]:
    """Second-order Butterworth low-pass, bilinear transform with the corner kept in place.

    Parameters
    ----------
    cutoff : float
        Corner frequency, Hz.
    sample_time : float
        s.

    Returns
    -------
    numerator, denominator : array (3,)
        In powers of 1/z, denominator[0] = 1.

    Raises
    ------
    DesignError
        If the corner is not between 0 and half the sample rate.
    """
    if not 0.0 < cutoff * sample_time < 0.5:
        raise DesignError(
            f"cutoff = {cutoff} Hz must lie between 0 and half the sample rate, {0.5 / sample_time:.6g} Hz"
        )
    k = np.tan(np.pi * cutoff * sample_time)
    scale = 1.0 / (1.0 + np.sqrt(2.0) * k + k * k)
    numerator = k * k * scale * np.array([1.0, 2.0, 1.0])
    denominator = np.array([1.0, 2.0 * (k * k - 1.0) * scale, (1.0 - np.sqrt(2.0) * k + k * k) * scale])
    return numerator, denominator


def lowpass(signal: ArrayLike, cutoff: float, sample_time: float) -> Array:
    """Low-pass a finite signal (..., N, 3), starting in the steady state of its first sample.

    At frequencies well below the corner it delays by sqrt(2) / (2 pi cutoff), 45 ms at 5 Hz: a tilt measured
    through it lags by that time.
    """
    signal = np.asarray(signal, dtype=np.float64)
    numerator, denominator = butterworth_coefficients(cutoff, sample_time)
    start = lfilter_zi(numerator, denominator)[:, None] * signal[..., :1, :]
    filtered, _ = lfilter(numerator, denominator, signal, axis=-2, zi=start)
    return np.asarray(filtered, dtype=np.float64)


def _rest(name: str, values: ArrayLike, samples: int) -> Array:
    rows = np.asarray(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3 or rows.shape[0] < samples:
        raise CalibrationError(f"{name} has shape {rows.shape}; calibration needs ({samples} or more, 3)")
    rows = rows[:samples]
    lost = int(np.count_nonzero(~np.isfinite(rows).all(axis=1)))
    if lost:
        raise CalibrationError(f"{name} has {lost} rows that are not finite among its first {samples}")
    return rows

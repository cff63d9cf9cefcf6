"""The complementary filter that a measured response is nearest to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from ahrs_fmu.analysis.measure import FrequencyResponse, deviation
from ahrs_fmu.analysis.systems import Array, ComplexArray
from ahrs_fmu.analysis.theory import ComplementaryFilter, Gains, crossover, filter_of
from ahrs_fmu.errors import DesignError

_NO_INTEGRAL = 1e-3
"""An integral gain below this part of kp^2 makes no second-order filter."""
_WORTH_A_LAG = 0.5
"""A mismatch in dB above which a low-pass behind the filter is tried."""
_SLOWEST, _FASTEST = 1e-6, 0.99
"""Range of gains and corners: in rad/s, and times the sample rate."""


@dataclass(frozen=True, slots=True)
class Equivalent:
    """A measured response and the first- or second-order filter that is nearest to it."""

    response: FrequencyResponse
    gains: Gains
    filter: ComplementaryFilter
    lag: float | None
    """Corner of a first-order low-pass behind the filter, rad/s; None if there is none."""
    mismatch_db: float
    """Largest difference of the magnitudes, dB."""

    @property
    def crossover(self) -> float:
        """The corner of the estimator, rad/s: below it the measured angle decides, above it the gyro."""
        return crossover(self.filter)

    @property
    def sample_time(self) -> float | None:
        """That of the filter, s."""
        return self.filter.sample_time

    def respond(self, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return G_A and G_B of the nearest filter at `omega` rad/s, the low-pass behind it included.

        They sum to one, because an estimator follows a rotation that all its sensors report.
        """
        fitted = _expected(self.response, self.filter, self.lag, omega)
        rest = np.asarray(1.0 - fitted, dtype=np.complex128)
        return (fitted, rest) if self.response.path == "angle" else (rest, fitted)


def equivalent(response: FrequencyResponse, sample_time: float) -> Equivalent:
    """Return the nearest filter, of first order if an integral gain would not matter.

    Nearest in the logarithm of the complex gain, so that all frequencies count alike. An estimator that
    filters its answer once more, as a Kalman filter behind another one does, gets a low-pass in series.

    Parameters
    ----------
    response : FrequencyResponse
    sample_time : float
        Seconds.

    Raises
    ------
    DesignError
        The estimator does not answer on the excited axis.
    """
    if np.max(np.abs(response.main)) < 1e-6:
        raise DesignError("the estimator does not answer to the excitation: it has no equivalent filter")
    plain = _nearest(response, sample_time, lagged=False)
    if plain.mismatch_db < _WORTH_A_LAG or response.path == "rate":
        return plain
    lagged = _nearest(response, sample_time, lagged=True)
    return lagged if lagged.mismatch_db < 0.5 * plain.mismatch_db else plain


def _nearest(response: FrequencyResponse, sample_time: float, lagged: bool) -> Equivalent:
    second = _fit(response, sample_time, order=2, lagged=lagged)
    if second.gains.ki < _NO_INTEGRAL * second.gains.kp**2:
        return _fit(response, sample_time, order=1, lagged=lagged)
    return second


def _fit(response: FrequencyResponse, sample_time: float, order: int, lagged: bool) -> Equivalent:
    def parts(logarithms: Array) -> tuple[Gains, float | None]:
        values = [float(v) for v in np.exp(logarithms)]
        return Gains(*values[:order]), values[order] if lagged else None

    def mismatch(logarithms: Array) -> Array:
        gains, lag = parts(logarithms)
        expected = _expected(response, filter_of(gains, sample_time), lag, response.omega)
        ratio = np.log(response.main / expected)
        return np.concatenate((ratio.real, ratio.imag))

    start = np.log([1.0, 0.1][:order] + [5.0] * lagged)
    bounds = (math.log(_SLOWEST**2), math.log(_FASTEST / sample_time))
    gains, lag = parts(least_squares(mismatch, start, bounds=bounds, x_scale="jac").x)
    filter_ = filter_of(gains, sample_time)
    off = deviation(response.main, _expected(response, filter_, lag, response.omega)).magnitude_db
    return Equivalent(response, gains, filter_, lag, float(np.max(np.abs(off))))


def _expected(
    response: FrequencyResponse, filter_: ComplementaryFilter, lag: float | None, omega: ArrayLike
) -> ComplexArray:
    gain = filter_.respond(omega)[int(response.path == "rate")]
    if lag is None or filter_.sample_time is None:
        return gain
    z = np.exp(1j * np.asarray(omega) * filter_.sample_time)
    pole = math.exp(-lag * filter_.sample_time)
    return np.asarray(gain * (1.0 - pole) * z / (z - pole), dtype=np.complex128)

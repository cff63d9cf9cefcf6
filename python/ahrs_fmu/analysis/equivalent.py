"""The complementary filter that a measured response is nearest to."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from ahrs_fmu.analysis.measure import FrequencyResponse, deviation, plan, stepped_sine
from ahrs_fmu.analysis.systems import Array, ComplexArray
from ahrs_fmu.analysis.theory import ComplementaryFilter, Gains, Law, LowPass, crossover, filter_of
from ahrs_fmu.cosim.stepper import Stepper
from ahrs_fmu.errors import DesignError

_NO_INTEGRAL = 1e-3
"""An integral gain below this part of kp^2 makes no second-order filter."""
_SLOWEST_TONE, _FASTEST_TONE, _TONES = 0.02, 30.0, 14
"""Where a response is measured: rad/s, and how many."""
_SMALL = math.radians(1.0)
_ROUGH = 0.5
"""A mismatch in dB above which other forms than gains alone are tried."""
_BETTER = 0.5
"""What part of the mismatch they may leave to be taken."""
_FIRST_LAG = 5.0
"""Corner in rad/s at which the search for a low-pass begins."""
_SLOWEST, _FASTEST = 1e-6, 0.99
"""Range of gains and corners: in rad/s, and times the sample rate."""


@dataclass(frozen=True, slots=True)
class Equivalent:
    """A measured response and the first- or second-order filter that is nearest to it."""

    response: FrequencyResponse
    law: Law
    """Gains, or the low-pass of an estimator that averages the measured angle."""
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

    @property
    def form(self) -> str:
        """The form of the filter in words."""
        order = "first order" if self.law.order == 1 else "second order"
        name = f"low-pass of {order}" if isinstance(self.law, LowPass) else order
        return name if self.lag is None else f"{name} and low-pass {self.lag:.3g} rad/s"

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
    averages the measured angle is a low-pass without zero; one that filters its answer once more, as a
    Kalman filter behind another one does, gets a low-pass in series. Where gains alone are not near, the
    first of the two that is gets taken.

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
        raise DesignError(
            "the estimate does not answer to accelerometer and magnetometer on this axis, so it has no "
            "crossover: take another axis, or ahrs-fmu allan for the error of the gyro alone"
        )
    nearest = _with_gains(response, sample_time, lagged=False)
    if nearest.mismatch_db < _ROUGH:
        return nearest
    others = [_fit(response, sample_time, LowPass, (1.0, 0.7))]
    if response.path == "angle":
        others.append(_with_gains(response, sample_time, lagged=True))
    better = [other for other in others if other.mismatch_db < _BETTER * nearest.mismatch_db]
    near = [other for other in better if other.mismatch_db < _ROUGH]
    return (near or sorted(better, key=lambda other: other.mismatch_db) or [nearest])[0]


def small_signal(stepper: Stepper, sample_time: float, axis: int = 1) -> Equivalent:
    """Measure how an estimator answers when the measured attitude turns by 1 deg; find the nearest filter.

    Parameters
    ----------
    stepper : Stepper
    sample_time : float
        Step in seconds; the sample time of the estimator.
    axis : {0, 1, 2}, optional
        Body axis; pitch by default, which no coupled error mixes with another axis.

    Raises
    ------
    DesignError
        The stepper is no attitude estimator, or does not answer.
    """
    fastest = min(_FASTEST_TONE, math.pi / (2.0 * sample_time))
    tones = plan("angle", np.geomspace(_SLOWEST_TONE, fastest, _TONES), amplitude=_SMALL)
    return equivalent(stepped_sine(stepper, tones, sample_time, axis), sample_time)


def _with_gains(response: FrequencyResponse, sample_time: float, lagged: bool) -> Equivalent:
    second = _fit(response, sample_time, Gains, (1.0, 0.1), lagged)
    if isinstance(second.law, Gains) and second.law.ki < _NO_INTEGRAL * second.law.kp**2:
        return _fit(response, sample_time, Gains, (1.0,), lagged)
    return second


def _fit(
    response: FrequencyResponse,
    sample_time: float,
    make: Callable[..., Law],
    start: tuple[float, ...],
    lagged: bool = False,
) -> Equivalent:
    def parts(logarithms: Array) -> tuple[Law, float | None]:
        values = [float(v) for v in np.exp(logarithms)]
        return make(*values[: len(start)]), values[-1] if lagged else None

    def mismatch(logarithms: Array) -> Array:
        law, lag = parts(logarithms)
        expected = _expected(response, filter_of(law, sample_time), lag, response.omega)
        ratio = np.log(response.main / expected)
        return np.concatenate((ratio.real, ratio.imag))

    first = np.log([*start, _FIRST_LAG] if lagged else start)
    bounds = (math.log(_SLOWEST**2), math.log(_FASTEST / sample_time))
    law, lag = parts(least_squares(mismatch, first, bounds=bounds, x_scale="jac").x)
    filter_ = filter_of(law, sample_time)
    off = deviation(response.main, _expected(response, filter_, lag, response.omega)).magnitude_db
    return Equivalent(response, law, filter_, lag, float(np.max(np.abs(off))))


def _expected(
    response: FrequencyResponse, filter_: ComplementaryFilter, lag: float | None, omega: ArrayLike
) -> ComplexArray:
    gain = filter_.respond(omega)[int(response.path == "rate")]
    if lag is None or filter_.sample_time is None:
        return gain
    z = np.exp(1j * np.asarray(omega) * filter_.sample_time)
    pole = math.exp(-lag * filter_.sample_time)
    return np.asarray(gain * (1.0 - pole) * z / (z - pole), dtype=np.complex128)

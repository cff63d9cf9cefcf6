"""The complementary filter that a measured response is nearest to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ahrs_fmu.analysis.measure import FrequencyResponse, deviation
from ahrs_fmu.analysis.systems import Array
from ahrs_fmu.analysis.theory import ComplementaryFilter, Gains, crossover, filter_of
from ahrs_fmu.errors import DesignError

_NO_INTEGRAL = 1e-3
"""An integral gain below this part of kp^2 makes no second-order filter."""


@dataclass(frozen=True, slots=True)
class Equivalent:
    """A measured response and the first- or second-order filter that is nearest to it."""

    response: FrequencyResponse
    gains: Gains
    filter: ComplementaryFilter
    mismatch_db: float
    """Largest difference of the magnitudes, dB."""

    @property
    def crossover(self) -> float:
        """The corner of the estimator, rad/s: below it the measured angle decides, above it the gyro."""
        return crossover(self.filter)


def equivalent(response: FrequencyResponse, sample_time: float) -> Equivalent:
    """Return the nearest filter, of first order if an integral gain would not matter.

    Raises
    ------
    DesignError
        The estimator does not answer on the excited axis.
    """
    gains = equivalent_gains(response, sample_time)
    if gains.ki < _NO_INTEGRAL * gains.kp**2:
        gains = equivalent_gains(response, sample_time, order=1)
    filter_ = filter_of(gains, sample_time)
    expected = filter_.respond(response.omega)[int(response.path == "rate")]
    mismatch = deviation(response.main, expected).magnitude_db
    return Equivalent(response, gains, filter_, float(np.max(np.abs(mismatch))))


def equivalent_gains(response: FrequencyResponse, sample_time: float, order: int = 2) -> Gains:
    """Return the gains of the first- or second-order filter whose response is nearest to a measured one.

    Nearest in the logarithm of the complex gain, so that all frequencies count alike.

    Raises
    ------
    DesignError
        The order is not 1 or 2, or the estimator does not answer on the excited axis.
    """
    if order not in (1, 2):
        raise DesignError(f"order = {order}: an equivalent filter is of order 1 or 2")
    measured = response.main
    if np.max(np.abs(measured)) < 1e-6:
        raise DesignError("the estimator does not answer to the excitation: it has no equivalent filter")

    def mismatch(logarithms: Array) -> Array:
        filter_ = filter_of(Gains(*np.exp(logarithms)), sample_time)
        ratio = np.log(measured / filter_.respond(response.omega)[response.path == "rate"])
        return np.concatenate((ratio.real, ratio.imag))

    start = np.log([1.0, 0.1][:order])
    limit = math.log(0.99 / sample_time)
    found = least_squares(mismatch, start, bounds=(-20.0, limit), x_scale="jac")
    return Gains(*(float(g) for g in np.exp(found.x)))

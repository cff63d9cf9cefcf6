"""Allan deviation of a sensor at rest, and the noise densities it shows.

The Allan variance at an averaging time tau is half the mean square difference of neighbouring averages
over tau. Overlapping averages are used. A gyro shows white noise N falling as 1/sqrt(tau), bias
instability B as a floor, rate random walk K rising as sqrt(tau):

    variance(tau) = N^2/tau + B^2 (2 ln 2)/pi + K^2 tau/3        (IEEE Std 952).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from ahrs_fmu.analysis.quantity import require_positive
from ahrs_fmu.analysis.systems import Array
from ahrs_fmu.errors import DesignError

_SHORTEST = 100
_FLOOR = 2.0 * math.log(2.0) / math.pi
_POINTS_PER_DECADE = 10
_ITERATIONS = 20
_FREQUENCIES = 3000
_MODEL_ERROR = 0.02
"""Relative error of the three-term model itself: keeps the many averages at short times from deciding all."""


@dataclass(frozen=True, slots=True)
class AllanDeviation:
    """Allan deviation of one signal."""

    tau: Array
    """Averaging times (N,), seconds."""
    deviation: Array
    """Allan deviation (N,), in the unit of the signal."""
    sample_time: float
    """Seconds."""
    duration: float
    """Length of the record, seconds."""


def allan_deviation(signal: ArrayLike, sample_time: float, tau: ArrayLike | None = None) -> AllanDeviation:
    """Compute the overlapping Allan deviation.

    Parameters
    ----------
    signal : array (N,)
        Samples of a sensor at rest, evenly spaced.
    sample_time : float
        Seconds.
    tau : array, optional
        Averaging times in seconds, rounded to whole samples; by default ten per decade from one sample to a
        quarter of the record.

    Raises
    ------
    DesignError
        The record is shorter than 100 samples or holds values that are not finite, or a tau does not fit in.
    """
    x = np.asarray(signal, dtype=np.float64)
    T = require_positive("sample_time", sample_time, "s")
    if x.ndim != 1 or x.size < _SHORTEST:
        raise DesignError(f"the record has {x.size} samples: give one signal of {_SHORTEST} samples or more")
    if not np.all(np.isfinite(x)):
        missing = np.count_nonzero(~np.isfinite(x))
        raise DesignError(
            f"{missing} of {x.size} samples are not finite: cut the record to a stretch without gaps"
        )
    if tau is None:
        longest = x.size // 4
        points = math.ceil(_POINTS_PER_DECADE * math.log10(longest)) + 1
        m = np.unique(np.round(np.geomspace(1, longest, points)).astype(int))
    else:
        m = np.unique(np.round(np.asarray(tau, dtype=np.float64) / T).astype(int))
        if m[0] < 1 or 2 * m[-1] > x.size:
            raise DesignError(
                f"tau from {m[0] * T:g} to {m[-1] * T:g} s: keep it between one sample ({T:g} s) "
                f"and half the record ({0.5 * x.size * T:g} s)"
            )
    # Sums instead of averages: the difference of neighbouring averages is a second difference of the angle.
    angle = np.concatenate(([0.0], np.cumsum(x - np.mean(x))))
    variance = [
        np.mean((angle[2 * k :] - 2.0 * angle[k:-k] + angle[: -2 * k]) ** 2) / (2.0 * k * k) for k in m
    ]
    return AllanDeviation(m * T, np.sqrt(np.array(variance)), T, x.size * T)


@dataclass(frozen=True, slots=True)
class Estimate:
    """A fitted number with its standard error."""

    value: float
    standard_error: float

    @property
    def reach(self) -> float:
        """Half the 95 % confidence interval."""
        return 1.96 * self.standard_error

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % confidence interval; the lower end is not below zero."""
        return max(0.0, self.value - self.reach), self.value + self.reach


@dataclass(frozen=True, slots=True)
class AllanFit:
    """Noise densities that explain an Allan deviation; the units are those of a gyro signal in rad/s."""

    white: Estimate
    """N, rad/s/rtHz."""
    instability: Estimate
    """B, rad/s."""
    walk: Estimate
    """K, rad/s^2/rtHz."""
    spread: Array
    """Standard error (N,) that the Allan deviation at each averaging time has for the fitted noise."""

    def deviation(self, tau: ArrayLike) -> Array:
        """Return the fitted Allan deviation at `tau` seconds."""
        squares = np.array([self.white.value, self.instability.value, self.walk.value]) ** 2
        variance: Array = _slopes(np.asarray(tau, dtype=np.float64)) @ squares
        return np.sqrt(variance)


def fit_allan(allan: AllanDeviation, with_instability: bool = True, shortest: float = 0.0) -> AllanFit:
    """Fit N, B and K to an Allan deviation, none of them negative.

    Values at different averaging times come from the same samples and are correlated, more so the longer the
    times. Their covariance for the fitted noise weighs the points and gives the standard errors (generalised
    least squares on the variance, repeated until the weights agree with the fit).

    Parameters
    ----------
    allan : AllanDeviation
    with_instability : bool, optional
        Fit B as well; without it N and K are found more precisely where the sensor has no such floor.
    shortest : float, optional
        Averaging times below it do not count, s: a sensor's own low-pass takes white noise away there.

    Raises
    ------
    DesignError
        The record is too short to separate the terms, or it does not vary.
    """
    columns = [0, 1, 2] if with_instability else [0, 2]
    tau = allan.tau[allan.tau >= shortest]
    variance = allan.deviation[allan.tau >= shortest] ** 2
    if tau.size <= len(columns):
        raise DesignError(
            f"{tau.size} averaging times cannot fix {len(columns)} noise terms: give a longer record"
        )
    if not np.all(variance > 0.0):
        raise DesignError("the record does not vary: a sensor without noise needs no fit")
    # Solved in units of the first variance, because the solver has an absolute tolerance.
    unit = float(variance[0])
    slopes = _slopes(tau)[:, columns]
    weights = np.diag(unit / variance)
    squares = np.zeros(3)
    scatter = _scatter(allan, tau)
    for _ in range(_ITERATIONS):
        previous = squares.copy()
        squares[columns], _ = nnls(weights @ slopes, weights @ (variance / unit))
        covariance = scatter.covariance(squares)
        if np.allclose(squares, previous, rtol=1e-6, atol=0.0):
            break
        weights = np.linalg.inv(np.linalg.cholesky(covariance))
    errors = np.zeros(3)
    errors[columns] = np.sqrt(np.diag(np.linalg.inv(slopes.T @ np.linalg.solve(covariance, slopes))))
    white, instability, walk = (_root(unit * s, unit * e) for s, e in zip(squares, errors, strict=True))
    everywhere = np.diag(_scatter(allan, allan.tau).covariance(squares))
    spread = np.sqrt(unit * everywhere) / (2.0 * np.sqrt(_slopes(allan.tau) @ squares))
    return AllanFit(white, instability, walk, spread)


def _root(square: float, error_of_square: float) -> Estimate:
    """Return the root of a fitted square and its standard error, also where the square is near zero."""
    value = math.sqrt(max(square, 0.0))
    upper = math.sqrt(max(square, 0.0) + error_of_square)
    return Estimate(value, upper - value)


def _slopes(tau: Array) -> Array:
    """Return the Allan variance (N, 3) of unit N, B and K."""
    return np.stack((1.0 / tau, np.full_like(tau, _FLOOR), tau / 3.0), axis=-1)


@dataclass(frozen=True, slots=True)
class _Scatter:
    """How estimated Allan variances scatter, for any noise.

    The differences of averages are Gaussian with the cross spectrum S H_i H_j*, so the mean of their squares
    over the length L covers 2/L times the integral of |S H_i H_j|^2.
    """

    tau: Array
    spectra: Array
    """Two-sided spectra (3, F) of unit N, B and K."""
    transfer: Array
    """|H|^2 (N, F) of the differences, times the root of the frequency step."""
    length: Array
    """L (N, N), s."""

    def covariance(self, squares: Array) -> Array:
        """Return the covariance (N, N) for noise of the given N^2, B^2, K^2."""
        weighted = self.transfer * (squares @ self.spectra)
        model = _MODEL_ERROR * (_slopes(self.tau) @ squares)
        return np.asarray((weighted @ weighted.T) / self.length + np.diag(model**2))


def _scatter(allan: AllanDeviation, tau: Array) -> _Scatter:
    T = allan.sample_time
    f = np.geomspace(1e-2 / allan.duration, 0.5 / T, _FREQUENCIES)
    angular = 2.0 * math.pi * f
    m = tau[:, None] / T
    transfer = 4.0 * np.sin(math.pi * f * m * T) ** 4 / (m * np.sin(math.pi * f * T)) ** 2
    length = allan.duration - 2.0 * tau
    return _Scatter(
        tau=tau,
        spectra=np.stack((np.ones_like(f), 1.0 / angular, 1.0 / angular**2)),
        transfer=transfer * np.sqrt(np.gradient(f)),
        length=np.maximum(length[:, None], length),
    )

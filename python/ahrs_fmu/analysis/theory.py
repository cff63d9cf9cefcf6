"""Complementary filters as linear systems.

A correction law H turns the angle error into a rate. It makes the estimate the sum of a low-passed
angle measurement and a high-passed gyro angle,

    G_A = H / (s + H),    G_B = s / (s + H),    G_A + G_B = 1,

(docs/algorithms.md section 6). The same holds step by step for the sampled filter with its order of
operations: predict with the rate, take the error at the predicted attitude, correct. `correction`,
`discretise` and `compensate` build H, `complementary` closes the loop::

    pair = complementary(discretise(correction(Gains(kp=0.5, ki=0.1)), sample_time=0.02))

Angles are in radians, time in seconds. The error is taken with unit gain; `ahrs_fmu.analysis.coupling`
treats errors that are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from control import StateSpace, TransferFunction
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize_scalar
from scipy.signal import lfilter, step, tf2ss

from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.quantity import quantity, require_positive
from ahrs_fmu.analysis.systems import Array, ComplexArray
from ahrs_fmu.errors import DesignError

STANDARD_GRAVITY = 9.80665
"""Standard gravity, m/s^2."""

_SETTLED = 0.02
_POLE_TOLERANCE = 1e-7
"""How far inside the stability boundary a pole must lie to count as stable."""


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of the correction law H(s) = kp + ki/s + kii/s^2.

    Raises
    ------
    DesignError
        A gain is negative or not finite, kp is zero, or kii is given without ki.
    """

    kp: float
    """Proportional gain, rad/s."""
    ki: float = 0.0
    """Integral gain, rad2/s2; zero for a first-order filter."""
    kii: float = 0.0
    """Double-integral gain, rad3/s3; zero for a first- or second-order filter."""

    def __post_init__(self) -> None:
        require_positive("kp", self.kp, "rad/s")
        require_positive("ki", self.ki, "rad2/s2", zero_allowed=True)
        require_positive("kii", self.kii, "rad3/s3", zero_allowed=True)
        if self.kp * self.ki <= self.kii and self.kii:
            raise DesignError(
                f"kii = {self.kii:g} rad3/s3 makes the third-order filter unstable: "
                f"keep it below kp ki = {self.kp * self.ki:g}"
            )

    @property
    def order(self) -> int:
        """Order of the filter: 1, 2 or 3."""
        return 3 if self.kii else 2 if self.ki else 1

    def scaled(self, loop_gain: float) -> Gains:
        """Return the gains that act when the error carries the gain `loop_gain`."""
        return Gains(self.kp * loop_gain, self.ki * loop_gain, self.kii * loop_gain)


@dataclass(frozen=True, slots=True)
class LowPass:
    """Law of a filter that low-passes the measured angle in the frame of the integrated gyro.

    H(s) = wn^2/(s + 2 zeta wn) makes G_A = wn^2/(s^2 + 2 zeta wn s + wn^2), with two poles and no zero. It
    does not learn the gyro bias.

    Raises
    ------
    DesignError
        A value is not positive or not finite.
    """

    natural_frequency: float
    """wn, rad/s; with damping sqrt(1/2), a Butterworth filter, the -3 dB corner."""
    damping: float
    """zeta."""

    def __post_init__(self) -> None:
        require_positive("natural frequency", self.natural_frequency, "rad/s")
        require_positive("damping", self.damping, "1")

    @property
    def order(self) -> int:
        """Order of the filter."""
        return 2


Law = Gains | LowPass
"""What a correction law is given by."""


def correction(law: Law) -> TransferFunction:
    """Return H(s) of a law."""
    if isinstance(law, LowPass):
        wn = law.natural_frequency
        return systems.transfer_function([wn**2], [1.0, 2.0 * law.damping * wn], None)
    numerator = [law.kp, law.ki, law.kii][: law.order]
    return systems.transfer_function(numerator, [1.0, 0.0, 0.0][: law.order], None)


def describe(law: Law) -> str:
    """Return a law as people write it, with units."""
    if isinstance(law, LowPass):
        return f"natural frequency {law.natural_frequency:.4g} rad/s, damping {law.damping:.4g}"
    gains = (("kp", law.kp, "rad/s"), ("ki", law.ki, "rad2/s2"), ("kii", law.kii, "rad3/s3"))
    return ", ".join(f"{name} = {value:.4g} {unit}" for name, value, unit in gains if value)


def discretise(h: TransferFunction | StateSpace, sample_time: float) -> TransferFunction:
    """Return H(z) as the sampled filter applies H(s).

    The direct part of H corrects the attitude in the step itself. The rest is integrated backwards
    (s = (z - 1)/(T z)) and reaches the attitude through the next prediction, one step later.

    Parameters
    ----------
    h : control.TransferFunction or control.StateSpace
        Continuous correction law, at most as many zeros as poles.
    sample_time : float
        T in seconds.

    Raises
    ------
    DesignError
        H is discrete already or has more zeros than poles, or the sample time is not positive.
    """
    T = require_positive("sample_time", sample_time, "s")
    if systems.sample_time_of(h) is not None:
        raise DesignError(f"H is discrete already (dt = {h.dt:g} s): give the continuous H(s)")
    num, den = systems.fraction(h)
    degree = _proper_degree(num, den)
    direct = _direct(num, den)
    rest = np.polysub(num, direct * den)
    rest = np.concatenate((np.zeros(degree + 1 - rest.size), rest))
    backwards = [_power([1.0, -1.0], degree - i, [T, 0.0], i) for i in range(degree + 1)]
    strict = sum((c * p for c, p in zip(rest, backwards, strict=True)), np.zeros(degree + 1))
    poles = sum((c * p for c, p in zip(den, backwards, strict=True)), np.zeros(degree + 1))
    delayed = np.append(poles, 0.0)
    return systems.transfer_function(np.polyadd(direct * delayed, strict), delayed, T)


def compensation_factor(time_constant: float, sample_time: float) -> float:
    """Return c = exp(-T/tau) of the motion-acceleration compensation.

    An infinite time constant gives 1, which never looks at gravity again.
    """
    require_positive("sample_time", sample_time, "s")
    if time_constant != math.inf:
        require_positive("motion time constant", time_constant, "s")
    return math.exp(-sample_time / time_constant)


def compensate(h: TransferFunction, time_constant: float, sample_time: float) -> TransferFunction:
    """Return H of a filter that subtracts the motion acceleration it estimated a step before.

    The exact factor is 1 - c/z with c = exp(-T/tau) (docs/algorithms.md section 0). In continuous time
    its bilinear equivalent is taken, a lead (1 + c) (s + p (1 - c)/(1 + c)) / (s + p) with p = 2/T.

    Parameters
    ----------
    h : control.TransferFunction
        Correction law, continuous or discrete.
    time_constant : float
        tau in seconds; infinite is allowed.
    sample_time : float
        T in seconds, that of `h` if it is discrete.
    """
    c = compensation_factor(time_constant, sample_time)
    num, den = systems.fraction(h)
    dt = systems.sample_time_of(h)
    if dt is None:
        p = 2.0 / sample_time
        return systems.transfer_function(
            np.polymul(num, [1.0 + c, p * (1.0 - c)]), np.polymul(den, [1.0, p]), None
        )
    _same_sample_time(dt, sample_time)
    return systems.transfer_function(np.polymul(num, [1.0, -c]), np.polymul(den, [1.0, 0.0]), dt)


class Responding(Protocol):
    """What is known of any filter: a `ComplementaryFilter`, or the nearest one to a measured response."""

    @property
    def sample_time(self) -> float | None:
        """Seconds, or None in continuous time."""

    @property
    def crossover(self) -> float:
        """Frequency in rad/s where |G_A| = |G_B|."""

    def respond(self, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return G_A and G_B at `omega` rad/s."""


@dataclass(frozen=True, slots=True)
class ComplementaryFilter:
    """The closed loop of a correction law, made by `complementary`."""

    h: TransferFunction
    """The correction law, continuous or discrete."""
    g_a: TransferFunction
    """From the measured angle to the estimate."""
    g_b: TransferFunction
    """From the gyro angle (the sum of rate times sample time) to the estimate."""
    g_rate: TransferFunction
    """From the gyro rate to the estimate, seconds; also from a gyro bias to the angle error."""
    loop: TransferFunction
    """The open loop, from the error to the predicted attitude."""
    sample_time: float | None
    """Seconds, or None in continuous time."""

    def respond(self, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return G_A and G_B at `omega` rad/s, straight from H, so that they sum to 1 to the last digit."""
        s = 1j * np.asarray(omega, dtype=np.float64)
        h = systems.response(self.h, omega)
        if self.sample_time is None:
            return h / (s + h), s / (s + h)
        T = self.sample_time
        forward = np.exp(s * T) * T * h
        integrator = (1.0 - T * _direct(*systems.fraction(self.h))) * np.expm1(s * T)
        total = forward + integrator
        return forward / total, integrator / total

    def respond_rate(self, omega: ArrayLike) -> ComplexArray:
        """Return the response from gyro rate to the estimate at `omega` rad/s, in seconds."""
        omega = np.asarray(omega, dtype=np.float64)
        g_b = self.respond(omega)[1]
        if self.sample_time is None:
            return g_b / (1j * omega)
        T = self.sample_time
        return g_b * T * np.exp(1j * omega * T) / np.expm1(1j * omega * T)

    @property
    def crossover(self) -> float:
        """The highest frequency in rad/s at which |G_A| = |G_B|, nan if there is none."""
        return crossover(self)

    @property
    def poles(self) -> ComplexArray:
        """Closed-loop poles in the s or z plane."""
        return systems.poles(self.g_a)

    @property
    def continuous_poles(self) -> ComplexArray:
        """Closed-loop poles in 1/s; those of a sampled filter through s = ln(z)/T, pure delays left out."""
        if self.sample_time is None:
            return self.poles
        discrete = self.poles[np.abs(self.poles) > 1e-12]
        return np.asarray(np.log(discrete) / self.sample_time, dtype=np.complex128)

    @property
    def stable(self) -> bool:
        """Whether every transient dies out."""
        return _stable(systems.fraction(self.g_a).denominator, self.sample_time)

    def require_stable(self) -> ComplementaryFilter:
        """Return the filter itself, or say how far the gains are from stability.

        Raises
        ------
        DesignError
            A closed-loop pole lies on or beyond the stability boundary.
        """
        if not self.stable:
            if self.sample_time is None:
                where = f"a pole at {np.max(self.poles.real):.3g} 1/s: give gains with kp ki > kii > 0"
            else:
                where = (
                    f"a pole of modulus {np.max(np.abs(self.poles)):.4g} at "
                    f"sample_time = {self.sample_time:g} s: lower the gains or the sample time "
                    f"until kp T < 2 and ki T^2 < 4 - 2 kp T"
                )
            raise DesignError(f"the filter is unstable, {where}")
        return self


def complementary(h: TransferFunction | StateSpace) -> ComplementaryFilter:
    """Close the loop of a correction law.

    Parameters
    ----------
    h : control.TransferFunction or control.StateSpace
        H(s), or H(z) as `discretise` defines it, with a sample time in seconds.

    Raises
    ------
    DesignError
        H has several inputs or outputs, more zeros than poles, or no definite sample time, or its direct
        part times the sample time is exactly 1, which leaves no trace of the gyro.
    """
    num, den = systems.fraction(h)
    _proper_degree(num, den)
    T = systems.sample_time_of(h)
    law = systems.transfer_function(num, den, T)
    if T is None:
        integrated = np.append(den, 0.0)
        closed = np.polyadd(num, integrated)
        return ComplementaryFilter(
            h=law,
            g_a=systems.transfer_function(num, closed, None),
            g_b=systems.transfer_function(integrated, closed, None),
            g_rate=systems.transfer_function(den, closed, None),
            loop=systems.transfer_function(num, integrated, None),
            sample_time=None,
        )
    direct = _direct(num, den) * T
    if direct == 1.0:
        raise DesignError("the direct part of H times the sample time is 1: the gyro has no effect, lower kp")
    forward = T * np.append(num, 0.0)
    integrated = (1.0 - direct) * np.polymul(den, [1.0, -1.0])
    closed = np.polyadd(forward, integrated)
    open_loop = np.polymul(den, [1.0, -1.0])
    return ComplementaryFilter(
        h=law,
        g_a=systems.transfer_function(forward, closed, T),
        g_b=systems.transfer_function(integrated, closed, T),
        g_rate=systems.transfer_function((1.0 - direct) * T * np.append(den, 0.0), closed, T),
        loop=systems.transfer_function(np.polysub(forward, direct * open_loop), open_loop, T),
        sample_time=T,
    )


def filter_of(
    law: Law, sample_time: float | None = None, motion_time_constant: float | None = None
) -> ComplementaryFilter:
    """Return the filter of the given gains or low-pass.

    Parameters
    ----------
    law : Gains or LowPass
    sample_time : float, optional
        Seconds; None gives the continuous filter.
    motion_time_constant : float, optional
        Time constant in seconds of the motion-acceleration compensation, which needs a sample time.
    """
    h = correction(law)
    if sample_time is not None:
        h = discretise(h, sample_time)
    if motion_time_constant is not None:
        if sample_time is None:
            raise DesignError("motion compensation acts from sample to sample: give sample_time as well")
        h = compensate(h, motion_time_constant, sample_time)
    return complementary(h)


@dataclass(frozen=True, slots=True)
class Characteristics:
    """What the gains mean, as numbers."""

    order: int
    """Number of poles of the filter."""
    stable: bool
    """Whether every transient dies out."""
    crossover: float = quantity(
        "rad/s", "above it the gyro decides, below it the accelerometer and magnetometer"
    )
    natural_frequency: float = quantity("rad/s", "of the slowest pair of poles")
    damping: float = quantity("1", "of the slowest pair of poles")
    slowest_time_constant: float = quantity("s", "of the pole that dies out last")
    bandwidth: float = quantity("rad/s", "where the measured angle is passed with -3 dB")
    peak: float = quantity("1", "largest gain from the measured angle to the estimate")
    noise_bandwidth: float = quantity("Hz", "one-sided bandwidth for noise of the measured angle")
    settling_time: float = quantity("s", "until an initial error stays below 2 %")
    bias_error: float = quantity("s", "angle error per constant gyro bias, rad per rad/s")
    ramp_error: float = quantity("s^2", "angle error per steady drift of the bias, rad per rad/s^2")
    tilt_error: float = quantity(
        "rad/(m/s^2)", "tilt per horizontal acceleration at 1 rad/s, in standard gravity"
    )
    gain_margin: float = quantity("1", "factor by which all gains may rise before the filter is unstable")
    gain_reduction_margin: float = quantity("1", "factor below which all gains must not fall")
    phase_margin: float = quantity("rad", "of the loop at the frequency where its gain is 1")
    pole_radius: float = quantity("1", "largest modulus of a pole in the z plane; 1 is the limit")


def characterise(filter_: ComplementaryFilter) -> Characteristics:
    """Compute the `Characteristics` of a filter, stable or not."""
    stable = filter_.stable
    natural_frequency, damping = _dominant_pair(filter_)
    peak = _peak(filter_) if stable else math.inf
    low, high = _gain_limits(filter_) if stable else (math.nan, math.nan)
    return Characteristics(
        order=filter_.continuous_poles.size,
        stable=stable,
        crossover=crossover(filter_),
        natural_frequency=natural_frequency,
        damping=damping,
        slowest_time_constant=_slowest_time_constant(filter_) if stable else math.inf,
        bandwidth=_bandwidth(filter_),
        peak=peak,
        noise_bandwidth=noise_bandwidth(filter_) if stable else math.inf,
        settling_time=settling_time(filter_) if stable else math.inf,
        bias_error=bias_error(filter_),
        ramp_error=ramp_error(filter_),
        tilt_error=float(tilt_error(filter_, 1.0)),
        gain_margin=high,
        gain_reduction_margin=low,
        phase_margin=_phase_margin(filter_),
        pole_radius=float(np.max(np.abs(filter_.poles))) if filter_.sample_time else math.nan,
    )


def crossover(filter_: ComplementaryFilter) -> float:
    """Return the highest frequency in rad/s at which |G_A| = |G_B|, nan if there is none."""

    def balance(omega: ArrayLike) -> Array:
        g_a, g_b = filter_.respond(omega)
        return np.log(np.abs(g_a)) - np.log(np.abs(g_b))

    crossings = _zero_crossings(balance, _grid(filter_))
    return crossings[-1] if crossings else math.nan


def noise_bandwidth(filter_: ComplementaryFilter) -> float:
    """Return the integral of |G_A|^2 over the frequencies 0 to infinity (or half the sample rate), in Hz."""
    return 0.5 * noise_power(filter_.g_a)


def noise_power(system: TransferFunction) -> float:
    """Return the output variance for white noise of two-sided density 1, from a Lyapunov equation.

    In discrete time that is a variance of 1/T per sample. Infinite for a system that is not stable, and for
    a continuous one with a direct part.
    """
    T = systems.sample_time_of(system)
    num, den = systems.fraction(system)
    if not _stable(den, T):
        return math.inf
    if T is not None:
        num, den = (systems.in_delta(p, T) for p in (num, den))
    a, b, c, d = tf2ss(num, den)
    direct = float(d[0, 0])
    if direct and T is None:
        return math.inf
    covariance = systems.stationary_covariance(a, b @ b.T, T or 0.0)
    return float((c @ covariance @ c.T)[0, 0]) + (direct**2 / T if T else 0.0)


def bias_error(filter_: ComplementaryFilter) -> float:
    """Return the steady angle error in rad that a gyro bias of 1 rad/s leaves."""
    num, den = _law_at_rest(filter_)
    if num[-1] == 0.0:
        return math.inf
    return float(_gyro_share(filter_) * den[-1] / num[-1])


def ramp_error(filter_: ComplementaryFilter) -> float:
    """Return the steady angle error in rad for a gyro bias that grows by 1 rad/s every second."""
    num, den = _law_at_rest(filter_)
    if den[-1] != 0.0 or num[-1] == 0.0:
        return math.inf
    return float(_gyro_share(filter_) * den[-2] * (filter_.sample_time or 1.0) / num[-1])


def tilt_error(filter_: ComplementaryFilter, omega: ArrayLike, gravity: float = STANDARD_GRAVITY) -> Array:
    """Return the tilt error in rad per m/s^2 of horizontal motion acceleration at `omega` rad/s.

    The accelerometer takes an acceleration a for a tilt a/g, of which the filter passes |G_A|.
    """
    return np.abs(filter_.respond(omega)[0]) / gravity


def settling_time(filter_: ComplementaryFilter, tolerance: float = _SETTLED) -> float:
    """Return the time in seconds after which an initial error stays below `tolerance` of itself."""
    # A pole's envelope needs ln(1/tolerance) time constants; equal poles and zeros near one need some more.
    reach = (2.0 + 1.5 * math.log(1.0 / tolerance)) * _slowest_time_constant(filter_.require_stable())
    times, error = step_error(filter_, reach)
    outside = np.flatnonzero(np.abs(error) > tolerance)
    return float(times[min(outside[-1] + 1, times.size - 1)]) if outside.size else 0.0


def step_error(filter_: ComplementaryFilter, duration: float | None = None) -> tuple[Array, Array]:
    """Return times in seconds and the part of an initial attitude error that is left then.

    An initial error is the response of G_B to a unit step of the gyro angle.

    Parameters
    ----------
    filter_ : ComplementaryFilter
    duration : float, optional
        Seconds; by default eight times the slowest time constant.

    Raises
    ------
    DesignError
        The filter is unstable.
    """
    slowest = _slowest_time_constant(filter_.require_stable())
    duration = duration or 8.0 * slowest
    num, den = systems.fraction(filter_.g_b)
    if filter_.sample_time is None:
        times, error = step((num, den), T=np.linspace(0.0, duration, 2001))
        return np.asarray(times), np.asarray(error)
    count = max(2, math.ceil(duration / filter_.sample_time) + 1)
    num = np.concatenate((np.zeros(den.size - num.size), num))
    times = np.arange(count, dtype=np.float64) * filter_.sample_time
    return times, np.asarray(lfilter(num, den, np.ones(count)))


def _proper_degree(num: Array, den: Array) -> int:
    if num.size > den.size:
        raise DesignError(
            f"H has {num.size - 1} zeros and {den.size - 1} poles: a filter can only apply an H "
            f"with at most as many zeros as poles"
        )
    return den.size - 1


def _direct(num: Array, den: Array) -> float:
    return float(num[0] / den[0]) if num.size == den.size else 0.0


def _power(p: ArrayLike, m: int, q: ArrayLike, n: int) -> Array:
    """Return the polynomial p^m q^n."""
    result: Array = np.ones(1)
    for factor in [np.asarray(p)] * m + [np.asarray(q)] * n:
        result = np.polymul(result, factor).astype(np.float64)
    return result


def _same_sample_time(of_law: float, given: float) -> None:
    if not math.isclose(of_law, given, rel_tol=1e-9):
        raise DesignError(f"H has dt = {of_law:g} s and sample_time is {given:g} s: give the same")


def _stable(
    denominator: NDArray[np.floating], sample_time: float | None, tolerance: float = _POLE_TOLERANCE
) -> bool:
    poles = np.roots(denominator)
    if sample_time is None:
        return bool(np.all(poles.real < -tolerance * np.abs(poles)))
    return bool(np.all(np.abs(poles) < 1.0 - tolerance))


def _law_at_rest(filter_: ComplementaryFilter) -> tuple[Array, Array]:
    """Return H as polynomials about zero frequency, the denominator with two coefficients at least."""
    num, den = systems.fraction(filter_.h)
    if filter_.sample_time is not None:
        num, den = systems.about_one(num), systems.about_one(den)
    den = np.where(np.abs(den) < 1e-12 * np.max(np.abs(den)), 0.0, den)
    return num, np.concatenate((np.zeros(max(0, 2 - den.size)), den))


def _gyro_share(filter_: ComplementaryFilter) -> float:
    """Return what the correction of the same step leaves of a new gyro increment."""
    return 1.0 - _direct(*systems.fraction(filter_.h)) * (filter_.sample_time or 0.0)


def _grid(filter_: ComplementaryFilter) -> Array:
    speeds = np.abs(filter_.continuous_poles)
    speeds = speeds[speeds > 1e-9]
    low, high = (1e-3 * speeds.min(), 1e4 * speeds.max()) if speeds.size else (1e-6, 1e3)
    if filter_.sample_time is not None:
        high = math.pi / filter_.sample_time
    return np.geomspace(min(low, 1e-3 * high), high, 2000)


def _zero_crossings(function: Callable[[Any], Any], grid: Array) -> list[float]:
    values = function(grid)
    changes = np.flatnonzero(np.diff(np.signbit(values)))
    return [float(brentq(function, grid[i], grid[i + 1], xtol=1e-14, rtol=1e-13)) for i in changes]


def _dominant_pair(filter_: ComplementaryFilter) -> tuple[float, float]:
    poles = filter_.continuous_poles
    oscillating = poles[np.abs(poles.imag) > 1e-9 * np.abs(poles)]
    candidates = oscillating if oscillating.size else poles
    slowest = candidates[np.argsort(-candidates.real)][:2]
    natural_frequency = float(np.exp(np.mean(np.log(np.maximum(np.abs(slowest), 1e-300)))))
    if natural_frequency < 1e-100:
        return 0.0, math.nan
    return natural_frequency, float(-np.mean(slowest.real) / natural_frequency)


def _slowest_time_constant(filter_: ComplementaryFilter) -> float:
    return float(-1.0 / np.max(filter_.continuous_poles.real))


def _bandwidth(filter_: ComplementaryFilter) -> float:
    def above(omega: ArrayLike) -> Array:
        return np.log(np.abs(filter_.respond(omega)[0])) + 0.5 * math.log(2.0)

    crossings = _zero_crossings(above, _grid(filter_))
    return crossings[-1] if crossings else math.nan


def _peak(filter_: ComplementaryFilter) -> float:
    def gain(log_omega: float) -> float:
        return -float(np.abs(filter_.respond(math.exp(log_omega))[0]))

    grid = _grid(filter_)
    i = int(np.argmax(np.abs(filter_.respond(grid)[0])))
    bounds = (math.log(grid[max(i - 1, 0)]), math.log(grid[min(i + 1, grid.size - 1)]))
    return max(
        1.0, -float(minimize_scalar(gain, bounds=bounds, method="bounded", options={"xatol": 1e-10}).fun)
    )


def _gain_limits(filter_: ComplementaryFilter) -> tuple[float, float]:
    """Return the factors on H, below and above 1, at which the stable filter becomes unstable."""
    num, den = systems.fraction(filter_.loop)

    def stable_at(log_factor: float) -> bool:
        return _stable(np.polyadd(den, math.exp(log_factor) * num), filter_.sample_time, tolerance=0.0)

    def limit(direction: float, none: float) -> float:
        inside = 0.0
        for reach in direction * np.linspace(0.05, math.log(1e4), 200):
            if not stable_at(reach):
                outside = reach
                break
            inside = reach
        else:
            return none
        while abs(outside - inside) > 1e-12:
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if stable_at(middle) else (inside, middle)
        return math.exp(inside)

    return limit(-1.0, 0.0), limit(1.0, math.inf)


def _phase_margin(filter_: ComplementaryFilter) -> float:
    if not np.any(systems.fraction(filter_.loop).numerator):
        return math.inf

    def excess(omega: ArrayLike) -> Array:
        return np.log(np.abs(systems.response(filter_.loop, omega)))

    crossings = _zero_crossings(excess, _grid(filter_))
    if not crossings:
        return math.inf
    angles = np.angle(systems.response(filter_.loop, np.array(crossings)))
    return float(np.min(np.abs(np.angle(np.exp(1j * (angles + math.pi))))))

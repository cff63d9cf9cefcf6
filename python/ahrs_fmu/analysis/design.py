"""Gains from what is wanted (crossover, damping) or from what the sensors are (noise).

The optimal gains are those of the steady Kalman filter with the states angle and gyro bias
(docs/algorithms.md section 6). Noise is given as densities, so that it does not depend on the rate:
a standard deviation s of white samples T apart is the density s sqrt(T).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import control
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.coupling import ErrorKind, error_model, gains_on_axes
from ahrs_fmu.analysis.quantity import quantity, require_positive
from ahrs_fmu.analysis.systems import Array
from ahrs_fmu.analysis.theory import (
    STANDARD_GRAVITY,
    ComplementaryFilter,
    Gains,
    Law,
    filter_of,
    noise_power,
)
from ahrs_fmu.errors import DesignError

_BUTTERWORTH = math.sqrt(0.5)


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise densities of one axis.

    Raises
    ------
    DesignError
        A density is negative or not finite, or the angle is free of noise.
    """

    gyro: float = quantity("rad/s/rtHz", "angle random walk N: white noise of the gyro")
    bias_walk: float = quantity("rad/s^2/rtHz", "rate random walk K: how fast the gyro bias wanders")
    angle: float = quantity("rad/rtHz", "R: white noise of the angle from accelerometer or magnetometer")

    def __post_init__(self) -> None:
        require_positive("gyro noise density", self.gyro, "rad/s/rtHz", zero_allowed=True)
        require_positive("bias walk density", self.bias_walk, "rad/s^2/rtHz", zero_allowed=True)
        require_positive("angle noise density", self.angle, "rad/rtHz")
        if not self.gyro and not self.bias_walk:
            raise DesignError(
                "the gyro has neither noise nor bias walk: no correction is optimal, give one of them"
            )


def noise_of_samples(gyro: float, bias_step: float, angle: float, sample_time: float) -> Noise:
    """Return the densities of white samples.

    Parameters
    ----------
    gyro : float
        Standard deviation of a gyro sample, rad/s.
    bias_step : float
        Standard deviation of the bias increment from sample to sample, rad/s.
    angle : float
        Standard deviation of an angle measurement, rad.
    sample_time : float
        Seconds.
    """
    root = math.sqrt(require_positive("sample_time", sample_time, "s"))
    return Noise(gyro=gyro * root, bias_walk=bias_step / root, angle=angle * root)


def tilt_angle_noise(accel_density: float, gravity: float = STANDARD_GRAVITY) -> float:
    """Return the angle density in rad/rtHz of a tilt measured with `accel_density` m/s^2/rtHz."""
    return accel_density / gravity


def heading_angle_noise(mag_density: float, field: float, dip: float) -> float:
    """Return the angle density in rad/rtHz of a heading measured in a field of `field` T and `dip` rad."""
    horizontal = require_positive("horizontal field", field * math.cos(dip), "T")
    return mag_density / horizontal


def gains_for(
    crossover: float, damping: float = _BUTTERWORTH, order: int = 2, loop_gain: float = 1.0
) -> Gains:
    """Return the gains of a filter with a wanted crossover.

    Parameters
    ----------
    crossover : float
        Frequency in rad/s where |G_A| = |G_B|.
    damping : float, optional
        Of the pair of poles; no effect at order 1. At order 3 the real pole has the pair's natural frequency.
    order : {1, 2, 3}, optional
        Order of the filter.
    loop_gain : float, optional
        Gain of the filter's error on the axis of interest, an eigenvalue of M.

    Raises
    ------
    DesignError
        A value is not positive, or the order is not 1, 2 or 3.
    """
    require_positive("crossover", crossover, "rad/s")
    require_positive("damping", damping, "1")
    require_positive("loop gain", loop_gain, "1")
    if order == 1:
        return Gains(crossover / loop_gain)
    if order == 2:
        shape = Gains(2.0 * damping, 1.0)
    elif order == 3:
        shape = Gains(1.0 + 2.0 * damping, 1.0 + 2.0 * damping, 1.0)
    else:
        raise DesignError(f"order = {order}: give 1, 2 or 3")
    wn = crossover / _crossover_of(shape)
    return Gains(shape.kp * wn / loop_gain, shape.ki * wn**2 / loop_gain, shape.kii * wn**3 / loop_gain)


def optimal_gains(noise: Noise) -> Gains:
    """Return the gains with the smallest variance, in closed form.

    ki = K/R, kp = sqrt(N^2/R^2 + 2 K/R): the damping is 0.7071 or more. Without bias walk the filter
    is of first order.
    """
    ki = float(noise.bias_walk / noise.angle)
    return Gains(kp=math.hypot(noise.gyro / noise.angle, math.sqrt(2.0 * ki)), ki=ki)


def kalman_gains(noise: Noise) -> Gains:
    """Return the gains of the continuous Kalman filter, from the Riccati equation."""
    if not noise.bias_walk:
        gain, _, _ = control.lqe([[0.0]], [[1.0]], [[1.0]], [[noise.gyro**2]], [[noise.angle**2]])
        return Gains(float(gain[0, 0]))
    gain, _, _ = control.lqe(
        [[0.0, -1.0], [0.0, 0.0]],
        np.eye(2),
        [[1.0, 0.0]],
        np.diag([noise.gyro**2, noise.bias_walk**2]),
        [[noise.angle**2]],
    )
    # The bias enters as -b, so its gain is negative.
    return Gains(float(gain[0, 0]), -float(gain[1, 0]))


def optimal_covariance(noise: Noise) -> Array:
    """Return the covariance (2, 2) of angle and bias that the optimal gains leave, in closed form.

    P11 = R sqrt(N^2 + 2KR), P12 = -KR, P22 = K sqrt(N^2 + 2KR), in rad^2, rad^2/s and rad^2/s^2.
    """
    together = math.sqrt(noise.gyro**2 + 2.0 * noise.bias_walk * noise.angle)
    across = -noise.bias_walk * noise.angle
    return np.array([[noise.angle * together, across], [across, noise.bias_walk * together]])


def sampled_kalman_gains(noise: Noise, sample_time: float) -> Gains:
    """Return kp and ki whose sampled filter is the steady Kalman filter at this sample time.

    From the discrete Riccati equation: kp = K1/T and ki = -K2/T with the Kalman gains K1, K2.
    """
    T = require_positive("sample_time", sample_time, "s")
    n, k, r = noise.gyro**2, noise.bias_walk**2, noise.angle**2 / T
    if not noise.bias_walk:
        prior, _, _ = control.dare([[1.0]], [[1.0]], [[n * T]], [[r]])
        return Gains(float(prior[0, 0] / (prior[0, 0] + r)) / T)
    transition = np.array([[1.0, -T], [0.0, 1.0]])
    process = np.array([[n * T + k * T**3 / 3.0, -k * T**2 / 2.0], [-k * T**2 / 2.0, k * T]])
    prior, _, _ = control.dare(transition.T, np.array([[1.0], [0.0]]), process, np.array([[r]]))
    gain = prior[:, 0] / (prior[0, 0] + r)
    return Gains(float(gain[0]) / T, -float(gain[1]) / T)


@dataclass(frozen=True, slots=True)
class ErrorBudget:
    """Predicted RMS error of an angle, split by source."""

    gyro: float = quantity("rad", "from the gyro's white noise")
    bias_walk: float = quantity("rad", "from the wandering of the gyro bias")
    angle: float = quantity("rad", "from the noise of the measured angle")
    motion: float = quantity("rad", "from motion acceleration taken for tilt")
    total: float = quantity("rad", "all together")


@dataclass(frozen=True, slots=True)
class Motion:
    """Spectrum of the horizontal motion acceleration, which the accelerometer takes for tilt."""

    frequency: Array
    """Hz, increasing."""
    density: Array
    """One-sided power spectral density, (m/s^2)^2/Hz, at each frequency."""
    gravity: float = STANDARD_GRAVITY
    """m/s^2."""

    def __post_init__(self) -> None:
        usable = (
            self.frequency.ndim == 1
            and self.frequency.shape == self.density.shape
            and self.frequency.size > 1
        )
        if not usable or np.any(np.diff(self.frequency) <= 0.0) or np.any(self.density < 0.0):
            raise DesignError(
                "a motion spectrum needs two or more increasing frequencies in Hz, each with a density >= 0"
            )

    def variance(self, filter_: ComplementaryFilter) -> float:
        """Return the variance in rad^2 of the tilt that the filter takes from the motion."""
        fine = np.union1d(self.frequency, np.linspace(self.frequency[0], self.frequency[-1], 1000))
        g_a = np.abs(filter_.respond(2.0 * math.pi * fine)[0])
        density = np.interp(fine, self.frequency, self.density)
        return float(np.trapezoid(g_a**2 * density, fine)) / self.gravity**2


def motion_band(rms: float, low: float, high: float) -> Motion:
    """Return a flat spectrum of `rms` m/s^2 between `low` and `high` Hz."""
    require_positive("motion acceleration", rms, "m/s^2")
    require_positive("lower edge of the motion band", low, "Hz")
    if not low < high < math.inf:
        raise DesignError(f"the motion band {low:g} to {high:g} Hz is empty: give the lower edge first")
    return Motion(np.array([low, high]), np.full(2, rms**2 / (high - low)))


def predict_rms(
    law: Law, noise: Noise, sample_time: float | None = None, motion: Motion | None = None
) -> ErrorBudget:
    """Predict the RMS error of one axis whose error has unit gain.

    Parameters
    ----------
    law : Gains or LowPass
    noise : Noise
    sample_time : float, optional
        Seconds, for the exact sampled filter; None for the continuous one.
    motion : Motion, optional
        Motion acceleration, for a tilt axis.

    Returns
    -------
    ErrorBudget
        Infinite where a bias walk meets a filter without integral gain, or the filter is unstable.
    """
    gyro, walk, angle = _unit_variances(law, sample_time)
    disturbance = motion.variance(filter_of(law, sample_time)) if motion else 0.0
    variances = (
        noise.gyro**2 * gyro,
        noise.bias_walk**2 * walk if noise.bias_walk else 0.0,
        noise.angle**2 * angle,
        disturbance,
    )
    return ErrorBudget(*(math.sqrt(v) for v in (*variances, sum(variances))))


def gains_under_motion(
    noise: Noise, motion: Motion, sample_time: float | None = None, least_damping: float = 0.7
) -> Gains:
    """Return kp and ki with the smallest RMS tilt error under noise and motion acceleration together.

    Parameters
    ----------
    noise : Noise
    motion : Motion
    sample_time : float, optional
        Seconds, for the exact sampled filter; None for the continuous one.
    least_damping : float, optional
        Limit without which the filter would ring beside a narrow band of motion; up to 0.7071.
    """
    start = optimal_gains(noise)

    def cost(logarithms: Array) -> float:
        gains = Gains(*np.exp(logarithms))
        ringing = gains.kp < 2.0 * least_damping * math.sqrt(gains.ki)
        if ringing or not filter_of(gains, sample_time).stable:
            return math.inf
        return math.log(predict_rms(gains, noise, sample_time, motion).total)

    first = np.log([start.kp, start.ki] if start.ki else [start.kp])
    found = minimize(cost, first, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-10})
    return Gains(*(float(g) for g in np.exp(found.x)))


@dataclass(frozen=True, slots=True)
class ErrorCurve:
    """RMS error in rad against crossover in rad/s, at constant damping; every array (N,)."""

    crossover: Array
    gyro: Array
    bias_walk: Array
    angle: Array
    motion: Array
    total: Array

    @property
    def best(self) -> float:
        """Crossover in rad/s with the smallest total, between the grid points by a parabola."""
        i = int(np.clip(np.argmin(self.total), 1, self.total.size - 2))
        near = slice(i - 1, i + 2)
        a, b, _ = np.polyfit(np.log(self.crossover[near]), self.total[near], 2)
        return math.exp(-b / (2.0 * a))


def error_against_crossover(
    noise: Noise,
    crossovers: ArrayLike,
    damping: float = _BUTTERWORTH,
    order: int = 2,
    sample_time: float | None = None,
    motion: Motion | None = None,
) -> ErrorCurve:
    """Predict the RMS error of filters of one damping and many crossovers (rad/s)."""
    crossovers = np.asarray(crossovers, dtype=np.float64)
    budgets = [
        predict_rms(gains_for(float(wc), damping, order), noise, sample_time, motion) for wc in crossovers
    ]
    return ErrorCurve(
        crossover=crossovers,
        gyro=np.array([b.gyro for b in budgets]),
        bias_walk=np.array([b.bias_walk for b in budgets]),
        angle=np.array([b.angle for b in budgets]),
        motion=np.array([b.motion for b in budgets]),
        total=np.array([b.total for b in budgets]),
    )


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How much the RMS error grows when the gains or the noise are not what they should be."""

    half_gains: float = quantity("1", "error with half the crossover, relative to the error now")
    double_gains: float = quantity("1", "error with twice the crossover, relative to the error now")
    gyro: float = quantity("1", "percent of error per percent of gyro noise")
    bias_walk: float = quantity("1", "percent of error per percent of bias walk")
    angle: float = quantity("1", "percent of error per percent of angle noise")


def sensitivity(gains: Gains, noise: Noise, sample_time: float | None = None) -> Sensitivity:
    """Return how the predicted error reacts around the given gains."""
    now = predict_rms(gains, noise, sample_time)

    def with_speed(factor: float) -> float:
        scaled = Gains(gains.kp * factor, gains.ki * factor**2, gains.kii * factor**3)
        return predict_rms(scaled, noise, sample_time).total / now.total

    return Sensitivity(
        half_gains=with_speed(0.5),
        double_gains=with_speed(2.0),
        gyro=(now.gyro / now.total) ** 2,
        bias_walk=(now.bias_walk / now.total) ** 2,
        angle=(now.angle / now.total) ** 2,
    )


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Noise of a sensor set, and the field it measures in."""

    gyro: float = quantity("rad/s/rtHz", "gyro white noise N")
    bias_walk: float = quantity("rad/s^2/rtHz", "gyro rate random walk K")
    accel: float = quantity("m/s^2/rtHz", "accelerometer white noise")
    mag: float = quantity("T/rtHz", "magnetometer white noise")
    field: float = quantity("T", "magnitude of the magnetic field")
    dip: float = quantity("rad", "inclination of the field below the horizon")
    gravity: float = STANDARD_GRAVITY
    """m/s^2."""

    @property
    def tilt(self) -> Noise:
        """Noise of roll and pitch."""
        return Noise(self.gyro, self.bias_walk, tilt_angle_noise(self.accel, self.gravity))

    @property
    def heading(self) -> Noise:
        """Noise of the heading, without what leaks into it from tilt."""
        return Noise(self.gyro, self.bias_walk, heading_angle_noise(self.mag, self.field, self.dip))


@dataclass(frozen=True, slots=True)
class AttitudeBudget:
    """Predicted RMS error of an attitude at rest, level, heading north."""

    roll: float = quantity("rad", "RMS roll error")
    pitch: float = quantity("rad", "RMS pitch error")
    heading: float = quantity("rad", "RMS heading error, tilt leaking through the dip included")


def predict_attitude_rms(
    gains: Gains,
    sensor: SensorNoise,
    sample_time: float | None = None,
    kind: ErrorKind = "decoupled",
    motion_time_constant: float | None = None,
) -> AttitudeBudget:
    """Predict the RMS error of all axes together, coupled as the error of the filter couples them."""
    error = error_model(kind, sensor.dip, gravity=sensor.gravity)
    covariance = gains_on_axes(gains, sample_time, error, motion_time_constant).covariance(
        gyro=sensor.gyro, bias_walk=sensor.bias_walk, accel=sensor.accel, mag=sensor.mag / sensor.field
    )
    return AttitudeBudget(*(float(v) for v in np.sqrt(np.diag(covariance))))


def _crossover_of(shape: Gains) -> float:
    """Return the crossover in rad/s from |H(jw)| = w (docs/algorithms.md section 6)."""
    kp, ki, kii = shape.kp, shape.ki, shape.kii
    squares = np.roots([1.0, -(kp**2), 2.0 * kp * kii - ki**2, -(kii**2)])
    return math.sqrt(max(x.real for x in squares if abs(x.imag) <= 1e-9 * abs(x)))


def _unit_variances(law: Law, sample_time: float | None) -> tuple[float, float, float]:
    """Return the variances for unit densities of gyro noise, bias walk and angle noise."""
    filter_ = filter_of(law, sample_time)
    num, den = systems.fraction(filter_.g_rate)
    if sample_time is None:
        walk = systems.transfer_function(num, np.append(den, 0.0), None)
    else:
        # The walk grows by increments: g_rate T z/(z - 1), whose pole an integrator in H cancels.
        summed, remainder = np.polydiv(num, [1.0, -1.0])
        if np.any(np.abs(remainder) > 1e-12 * np.max(np.abs(num))):
            return noise_power(filter_.g_rate), math.inf, noise_power(filter_.g_a)
        walk = systems.transfer_function(sample_time * np.append(summed, 0.0), den, sample_time)
    return noise_power(filter_.g_rate), noise_power(walk), noise_power(filter_.g_a)

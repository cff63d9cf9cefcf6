"""Frequency response of anything that steps.

The estimator is held at an attitude and its sensors are turned about it by small angles: G_A shows what
accelerometer and magnetometer turn while the gyro reads zero, G_B what the gyro reports while the other
two stand still (docs/algorithms.md section 6). The answer is the body rotation vector from the held
attitude to the estimated one, so that all three axes and their cross-coupling are seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ahrs_fmu import quaternion
from ahrs_fmu.analysis.quantity import require_positive
from ahrs_fmu.analysis.systems import Array, ComplexArray
from ahrs_fmu.analysis.theory import STANDARD_GRAVITY, ComplementaryFilter, settling_time
from ahrs_fmu.cosim.stepper import Stepper, replay
from ahrs_fmu.errors import DesignError

Excited = Literal["angle", "rate"]
"""What is excited: the measured angle (G_A) or the gyro (G_B)."""
AXES = ("roll", "pitch", "yaw")

_INPUTS = ("gyro", "accel", "mag")
_TRANSIENT = 1e-6
"""What is left of a transient before a measurement begins."""
_FIVE_DEGREES = math.radians(5.0)
_LARGEST_AMPLITUDE = math.radians(45.0)
_LARGEST_BOOST = 10.0
_LARGEST_RATE = 0.1
_LEAST_DURATION = 20.0
SETTLE = 200.0
"""Time at rest that suits most estimators, s."""


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """Attitude and surroundings at which an estimator is measured."""

    attitude: Array = field(default_factory=quaternion.IDENTITY.copy)
    """q_nb (4,), body to NED with x to magnetic north."""
    dip: float = math.radians(36.87)
    """Inclination of the field below the horizon, rad."""
    magnitude: float = 50e-6
    """Magnitude of the field, T."""
    gravity: float = STANDARD_GRAVITY
    """m/s^2."""

    def sensors(self, turn: Array, rate: Array) -> dict[str, Array]:
        """Return what the sensors read, turned by body rotation vectors (N, 3), with gyro rate (N, 3)."""
        c = quaternion.to_matrix(quaternion.multiply(self.attitude, quaternion.exp(turn)))
        field_ned = self.magnitude * np.array([math.cos(self.dip), 0.0, math.sin(self.dip)])
        return {
            "gyro": rate,
            "accel": -self.gravity * c[:, 2, :],
            "mag": np.einsum("nij,i->nj", c, field_ned),
        }

    def turned(self, q: Array) -> Array:
        """Return the body rotation vectors (N, 3) from the held attitude to estimates (N, 4)."""
        return quaternion.log(quaternion.multiply(quaternion.conjugate(self.attitude), q))


@dataclass(frozen=True, slots=True)
class Plan:
    """What to excite, how strongly and how long; made by `plan`."""

    path: Excited
    """Whether the measured angle or the gyro is excited."""
    omega: Array
    """Angular frequencies (F,), rad/s, increasing."""
    amplitude: Array
    """Amplitude (F,) of the excitation, rad."""
    answer: Array
    """Amplitude (F,) expected of the answer, rad."""
    settle: float
    """Time before a measurement begins, s."""
    periods: int = 1
    """Whole periods that are measured, at least."""
    duration: float = _LEAST_DURATION
    """Time that is measured at least, s."""


def plan(
    path: Excited,
    omega: ArrayLike,
    expected: ComplementaryFilter | None = None,
    amplitude: float = _FIVE_DEGREES,
    settle: float | None = None,
    periods: int = 1,
) -> Plan:
    """Choose amplitudes and times.

    Parameters
    ----------
    path : {"angle", "rate"}
        Excite the measured angle (G_A) or the gyro (G_B).
    omega : array (F,)
        Angular frequencies, rad/s.
    expected : ComplementaryFilter, optional
        The filter that the answer should be near to. It tells how long transients last, and at which
        frequencies the answer is so small that the excitation may be larger.
    amplitude : float, optional
        Largest angle of excitation or answer, rad: the filters are linear for small angles.
    settle : float, optional
        Time before a measurement begins, s; by default until a transient of `expected` has gone, or 200 s.
    periods : int, optional
        Whole periods to measure.

    Raises
    ------
    DesignError
        A frequency, the amplitude, the settling time or the number of periods cannot be used.
    """
    omega = np.unique(np.asarray(omega, dtype=np.float64))
    if not omega.size or not np.all(np.isfinite(omega)) or omega[0] <= 0.0:
        lowest = omega[0] if omega.size else math.nan
        raise DesignError(f"frequency = {lowest:g} rad/s: give positive, finite frequencies")
    require_positive("amplitude", math.degrees(amplitude), "deg")
    if amplitude > _LARGEST_AMPLITUDE:
        raise DesignError(f"amplitude = {math.degrees(amplitude):g} deg: a small signal has 45 deg or less")
    if periods < 1:
        raise DesignError(f"periods = {periods}: measure one or more")
    gain = np.ones_like(omega)
    if expected is not None:
        if expected.sample_time is not None and omega[-1] * expected.sample_time >= math.pi:
            raise DesignError(
                f"frequency = {omega[-1]:g} rad/s: stay below half the sample rate, "
                f"{math.pi / expected.sample_time:g} rad/s"
            )
        gain = np.abs(expected.require_stable().respond(omega)[path == "rate"])
    if settle is None:
        settle = SETTLE if expected is None else settling_time(expected, _TRANSIENT)
    excitation = amplitude / np.maximum(1.0, gain)
    if path == "rate":
        # A suppressed rotation may be larger, as long as its rate stays a gyro bias that filters believe in.
        stronger = np.minimum(_LARGEST_BOOST, _LARGEST_RATE / (omega * amplitude))
        excitation *= np.clip(0.5 / gain, 1.0, np.maximum(1.0, stronger))
    return Plan(
        path=path,
        omega=omega,
        amplitude=excitation,
        answer=excitation * gain,
        settle=require_positive("settling time", settle, "s", zero_allowed=True),
        periods=periods,
    )


def harmonics(low: float, high: float, points: int) -> Array:
    """Return multiples of `low` (rad/s) up to `high`, as evenly spread in the logarithm as multiples can be.

    One period of `low` is a whole number of periods of each, so that `multisine` needs no longer. There are
    `points` of them or a few more, or all if there are fewer.
    """
    last = math.floor(high / low + 1e-9)
    if last <= points:
        return low * np.arange(1.0, last + 1.0)
    count = points
    while (numbers := np.unique(np.round(np.geomspace(1.0, last, count)))).size < points:
        count += 1
    return np.asarray(low * numbers, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class FrequencyResponse:
    """A measured response of all axes to the excitation of one."""

    path: Excited
    """Whether the measured angle (G_A) or the gyro (G_B) was excited."""
    axis: int
    """The excited body axis: 0 roll, 1 pitch, 2 yaw."""
    omega: Array
    """Angular frequencies (F,), rad/s."""
    gain: ComplexArray
    """Gain (F, 3) to each axis of the estimate."""
    standard_error: Array
    """Standard error (F, 3) of real and imaginary part, from what the sinusoids leave unexplained."""
    coherence: Array
    """Part (F,) of the answer's power on the excited axis that the sinusoids explain."""
    steps: int
    """Steps that the measurement took."""

    @property
    def main(self) -> ComplexArray:
        """Gain (F,) from the excited axis to itself."""
        return self.gain[:, self.axis]

    @property
    def error_db(self) -> Array:
        """Standard error (F,) of the magnitude of `main`, dB."""
        return 20.0 / math.log(10.0) * self.standard_error[:, self.axis] / np.abs(self.main)

    @property
    def error_phase(self) -> Array:
        """Standard error (F,) of the phase of `main`, rad."""
        return self.standard_error[:, self.axis] / np.abs(self.main)


@dataclass(frozen=True, slots=True)
class Deviation:
    """Difference between a measured and an expected response."""

    magnitude_db: Array
    """dB (F,)."""
    phase: Array
    """rad (F,)."""


def deviation(measured: ComplexArray, expected: ComplexArray) -> Deviation:
    """Compare two responses of the same shape."""
    ratio = measured / expected
    return Deviation(20.0 * np.log10(np.abs(ratio)), np.angle(ratio))


def stepped_sine(
    stepper: Stepper,
    plan: Plan,
    sample_time: float,
    axis: int = 0,
    point: OperatingPoint | None = None,
    progress: Callable[[int], None] | None = None,
) -> FrequencyResponse:
    """Measure one frequency after the other, each from a fresh start.

    Parameters
    ----------
    stepper : Stepper
        Has the inputs gyro, accel and mag and the output q.
    plan : Plan
    sample_time : float
        Step in seconds; the sample time of the estimator.
    axis : {0, 1, 2}, optional
        The body axis to excite.
    point : OperatingPoint, optional
        Where to measure; level and heading north by default.
    progress : callable, optional
        Called with 1 for every frequency that is done.

    Raises
    ------
    DesignError
        The stepper is no attitude estimator, or a frequency is too high for the sample time.
    """
    tones = _tones(plan, sample_time, axis, point)
    return _joined(plan, axis, _noted((_measure(stepper, tone) for tone in tones), progress))


def shared_stepped_sine(
    open_stepper: Callable[[], AbstractContextManager[Stepper]],
    plans: Sequence[Plan],
    sample_time: float,
    axis: int = 0,
    point: OperatingPoint | None = None,
    progress: Callable[[int], None] | None = None,
    workers: int = 2,
) -> list[FrequencyResponse]:
    """Do what `stepped_sine` does for several plans, all frequencies shared among processes.

    Parameters
    ----------
    open_stepper : callable
        Gives the stepper as a context, such as `ahrs_fmu.cosim.opening.fmu`; other processes have to be
        able to import it, or it is a `functools.partial` of what they can import.
    plans : sequence of Plan
    sample_time, axis, point, progress
        As in `stepped_sine`.
    workers : int, optional
        Number of processes.

    Returns
    -------
    list of FrequencyResponse
        One for each plan.
    """
    tones = [tone for p in plans for tone in _tones(p, sample_time, axis, point)]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        answers = iter(_noted(pool.map(partial(_open_and_measure, open_stepper), tones), progress))
    return [_joined(p, axis, [next(answers) for _ in p.omega]) for p in plans]


def multisine(
    stepper: Stepper,
    plan: Plan,
    sample_time: float,
    axis: int = 0,
    point: OperatingPoint | None = None,
) -> FrequencyResponse:
    """Measure all frequencies at once, with the angle of the sum kept as small as that of one sine.

    Faster than `stepped_sine`, most of all with `harmonics`, and best at an amplitude of a degree: the tones
    share the amplitude, and what the filter bends of one tone falls on the others. Same parameters.
    """
    _check(axis, plan, sample_time)
    together = _Tone(plan, sample_time, axis, point or OperatingPoint(), tuple(range(plan.omega.size)))
    return _joined(plan, axis, [_measure(stepper, together)])


@dataclass(frozen=True, slots=True)
class _Tone:
    """One run: which of the plan's frequencies sound in it."""

    plan: Plan
    sample_time: float
    axis: int
    point: OperatingPoint
    indices: tuple[int, ...]

    @property
    def omega(self) -> Array:
        return self.plan.omega[list(self.indices)]

    @property
    def settle(self) -> int:
        return math.ceil(self.plan.settle / self.sample_time)

    @property
    def measured(self) -> int:
        """Steps to measure: whole periods of the slowest tone, long enough to tell neighbours apart."""
        omega = self.omega
        period = 2.0 * math.pi / float(omega[0])
        least = max(self.plan.periods * period, self.plan.duration)
        if omega.size > 1:
            least = max(least, 2.0 * math.pi / float(np.min(np.diff(omega))))
        return round(math.ceil(least / period - 1e-9) * period / self.sample_time)

    def excitation(self) -> tuple[Array, Array]:
        """Return amplitudes and phases of the tones, rad."""
        chosen = list(self.indices)
        amplitude, answer = self.plan.amplitude[chosen], self.plan.answer[chosen]
        # Quadratic phases spread the power of the sum over time.
        phase = -math.pi * np.arange(amplitude.size) ** 2 / amplitude.size
        if amplitude.size == 1:
            return amplitude, phase
        t = np.linspace(0.0, 2.0 * math.pi / self.omega[0], 20_000)
        waves = np.sin(self.omega[:, None] * t + phase[:, None])
        reached = max(np.max(np.abs(answer @ waves)), np.max(np.abs(amplitude @ waves)) / _LARGEST_BOOST)
        return amplitude * float(np.max(answer)) / reached, phase


@dataclass(frozen=True, slots=True)
class _Answer:
    gain: ComplexArray
    standard_error: Array
    coherence: Array
    steps: int


def _tones(plan: Plan, sample_time: float, axis: int, point: OperatingPoint | None) -> list[_Tone]:
    _check(axis, plan, sample_time)
    at = point or OperatingPoint()
    return [_Tone(plan, sample_time, axis, at, (i,)) for i in range(plan.omega.size)]


def _noted(answers: Iterable[_Answer], progress: Callable[[int], None] | None) -> list[_Answer]:
    done = []
    for answer in answers:
        done.append(answer)
        if progress is not None:
            progress(1)
    return done


def _open_and_measure(open_stepper: Callable[[], AbstractContextManager[Stepper]], tone: _Tone) -> _Answer:
    with open_stepper() as stepper:
        return _measure(stepper, tone)


def _measure(stepper: Stepper, tone: _Tone) -> _Answer:
    require_estimator(stepper)
    T, steps = tone.sample_time, tone.settle + tone.measured
    amplitude, phase = tone.excitation()
    omega = tone.omega
    # The excitation starts from zero, where the estimator is initialised.
    time = np.arange(steps + 1, dtype=np.float64) * T
    angle = np.sum(amplitude * (np.sin(np.outer(time, omega) + phase) - np.sin(phase)), axis=-1)
    direction = np.eye(3)[tone.axis]
    still = np.zeros((steps, 3))
    if tone.plan.path == "angle":
        turn, rate = angle[1:, None] * direction, still
    else:
        turn, rate = still, np.diff(angle)[:, None] / T * direction
    stepper.reset()
    found = replay(stepper, tone.point.sensors(turn, rate), ["q"], T)["q"]
    answer = tone.point.turned(found)[tone.settle :]
    return _fit(answer, time[1 + tone.settle :], omega, amplitude, phase, tone.axis, steps)


def _fit(
    answer: Array, time: Array, omega: Array, amplitude: Array, phase: Array, axis: int, steps: int
) -> _Answer:
    """Fit sinusoids and an offset by least squares."""
    argument = np.outer(time, omega) + phase
    basis = np.hstack((np.sin(argument), np.cos(argument), np.ones((time.size, 1))))
    weights, _, _, _ = np.linalg.lstsq(basis, answer, rcond=None)
    residual = answer - basis @ weights
    variance = np.sum(residual**2, axis=0) / max(1, time.size - basis.shape[1])
    n = omega.size
    spread = np.diag(np.linalg.inv(basis.T @ basis))[:n]
    total = float(np.sum((answer[:, axis] - np.mean(answer[:, axis])) ** 2))
    unexplained = float(np.sum(residual[:, axis] ** 2))
    return _Answer(
        gain=(weights[:n] + 1j * weights[n : 2 * n]) / amplitude[:, None],
        standard_error=np.sqrt(np.outer(spread, variance)) / amplitude[:, None],
        coherence=np.full(n, 1.0 - unexplained / total if total > 0.0 else 0.0),
        steps=steps,
    )


def _joined(plan: Plan, axis: int, answers: Sequence[_Answer]) -> FrequencyResponse:
    return FrequencyResponse(
        path=plan.path,
        axis=axis,
        omega=plan.omega,
        gain=np.concatenate([a.gain for a in answers]),
        standard_error=np.concatenate([a.standard_error for a in answers]),
        coherence=np.concatenate([a.coherence for a in answers]),
        steps=sum(a.steps for a in answers),
    )


def _check(axis: int, plan: Plan, sample_time: float) -> None:
    require_positive("sample_time", sample_time, "s")
    if axis not in range(3):
        raise DesignError(f"axis = {axis}: give 0 (roll), 1 (pitch) or 2 (yaw)")
    if plan.omega[-1] * sample_time >= math.pi:
        raise DesignError(
            f"frequency = {plan.omega[-1]:g} rad/s: stay below half the sample rate, "
            f"{math.pi / sample_time:g} rad/s"
        )


def require_estimator(stepper: Stepper) -> None:
    """Refuse what has not the variables of an attitude estimator.

    Raises
    ------
    DesignError
        An input or the output q is missing.
    """
    missing = [name for name in _INPUTS if name not in stepper.inputs]
    missing += ["q"] if "q" not in stepper.outputs else []
    if missing:
        raise DesignError(
            f"no variable {', '.join(missing)}: a response is measured on an attitude estimator "
            f"with the inputs gyro, accel, mag and the output q"
        )

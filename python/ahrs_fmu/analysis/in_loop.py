"""What an estimator costs in a control loop: gain and phase from the true attitude to the estimated one.

A rotation of the vehicle reaches the estimate on two ways,

    estimate / truth = (G_A L_A M + G_B L_G) D,

through the measured angle and through the gyro. L_A and L_G are the sensors' own low-pass and delay, M is
what the accelerometer shows of a tilt that also accelerates the vehicle, D the delay and the hold of the
estimate. As G_A + G_B = 1, perfect sensors on a vehicle that does not accelerate cost nothing, whatever the
gains: what is left is what `InLoop` adds up.

In a closed loop the loop gain at its crossover is multiplied by this number, so that its phase is taken
from the phase margin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from control import TransferFunction
from numpy.typing import ArrayLike

from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.quantity import quantity, require_positive
from ahrs_fmu.analysis.systems import ComplexArray
from ahrs_fmu.analysis.theory import Responding
from ahrs_fmu.errors import DesignError
from ahrs_fmu.sensors import Triad

_PERFECT = Triad()


def thrust_borne(drag: float) -> TransferFunction:
    """Return M = d/(s + d) of a vehicle that its thrust alone carries, such as a multirotor.

    Tilting it accelerates it by g times the tilt, less d times its speed, so that drag is all the
    accelerometer feels: slower than d it shows the tilt, faster it shows none.

    Parameters
    ----------
    drag : float
        d, horizontal drag over mass and speed, 1/s (docs/vehicle.md: 0.26 for the quadrotor in hover).
    """
    require_positive("drag", drag, "1/s")
    return systems.transfer_function([drag], [1.0, drag], None)


@dataclass(frozen=True, slots=True)
class LoopCost:
    """Gain and phase that an estimator adds to a loop at one frequency; the phases sum to `phase`."""

    frequency: float = quantity("rad/s", "where the loop is looked at")
    gain: float = quantity("1", "amplitude of the estimated attitude over that of the true one")
    phase: float = quantity("rad", "of the estimated attitude against the true one; a lag is negative")
    sensors: float = quantity("rad", "of it from the sensors' own low-passes and delays")
    motion: float = quantity("rad", "of it from acceleration taken for tilt")
    timing: float = quantity("rad", "of it from delay and hold of the estimate")
    equivalent_delay: float = quantity("s", "pure delay with the same phase")


@dataclass(frozen=True, slots=True)
class InLoop:
    """An estimator between the true attitude and the controller, on one axis.

    Raises
    ------
    DesignError
        The delay is negative or not finite.
    """

    filter: Responding
    """The estimator: a filter, or the nearest one to a measured response."""
    gyro: Triad = _PERFECT
    """The gyroscope, of which bandwidth, delay and rate count; perfect by default."""
    angle: Triad = _PERFECT
    """The sensor of the angle: the accelerometer for tilt, the magnetometer for heading."""
    seen: TransferFunction | None = None
    """M: measured over true angle, such as `thrust_borne`; None where motion does not disturb."""
    delay: float = 0.0
    """Time from a sample to the use of its estimate, s: one step where an importer sets the inputs of t and
    steps to t + h, zero in the order of docs/vehicle.md."""
    held: bool = True
    """Whether the controller sees the estimate as a staircase. False for one that samples with the
    estimator: the hold of its own command is then the only one."""

    def __post_init__(self) -> None:
        require_positive("delay", self.delay, "s", zero_allowed=True)

    def respond(self, omega: ArrayLike) -> ComplexArray:
        """Return estimated over true attitude at `omega` rad/s.

        Raises
        ------
        DesignError
            A frequency is not positive, or not below half the sample rate.
        """
        omega = self._checked(omega)
        by_angle, by_gyro = self._ways(omega)
        return (by_angle * self._seen(omega) + by_gyro) * self._timing(omega)

    def cost(self, omega: float) -> LoopCost:
        """Return gain and phase at one frequency in rad/s, by cause.

        Raises
        ------
        DesignError
            The frequency is not positive, or not below half the sample rate.
        """
        at = self._checked(omega)
        by_angle, by_gyro = self._ways(at)
        still, moving = by_angle + by_gyro, by_angle * self._seen(at) + by_gyro
        timing = self._timing(at)
        sensors, motion, waiting = (float(np.angle(part)) for part in (still, moving / still, timing))
        phase = sensors + motion + waiting
        gain = float(np.abs(moving * timing))
        return LoopCost(float(omega), gain, phase, sensors, motion, waiting, -phase / float(omega))

    def _checked(self, omega: ArrayLike) -> systems.Array:
        omega = np.asarray(omega, dtype=np.float64)
        T = self.filter.sample_time
        limit = math.inf if T is None else math.pi / T
        wrong = omega[~((omega > 0.0) & (omega < limit))]
        if wrong.size:
            raise DesignError(
                f"frequency = {wrong.flat[0]:g} rad/s: give a positive one"
                + ("" if T is None else f" below half the sample rate, {limit:g} rad/s")
            )
        return omega

    def _ways(self, omega: systems.Array) -> tuple[ComplexArray, ComplexArray]:
        g_a, g_b = self.filter.respond(omega)
        T = self.filter.sample_time
        return g_a * _sensor(self.angle, omega, T), g_b * _sensor(self.gyro, omega, T)

    def _seen(self, omega: systems.Array) -> ComplexArray:
        if self.seen is None:
            return np.ones(omega.shape, dtype=np.complex128)
        return systems.response(self.seen, omega)

    def _timing(self, omega: systems.Array) -> ComplexArray:
        s, T = 1j * omega, self.filter.sample_time
        waiting = np.exp(-s * self.delay)
        if T is None or not self.held:
            return np.asarray(waiting, dtype=np.complex128)
        return np.asarray(waiting * -np.expm1(-s * T) / (s * T), dtype=np.complex128)


def _sensor(triad: Triad, omega: systems.Array, sample_time: float | None) -> ComplexArray:
    """Return the response of a sensor as `ahrs_fmu.sensors` models it, or of its continuous counterpart."""
    s = 1j * omega
    corner = 2.0 * math.pi * triad.bandwidth
    if sample_time is None:
        hold = 1.0 if math.isinf(triad.rate) else -np.expm1(-s / triad.rate) * triad.rate / s
        return np.asarray(np.exp(-s * triad.delay) / (1.0 + s / corner) * hold, dtype=np.complex128)
    T = sample_time
    back = np.exp(-s * T)
    pole = math.exp(-corner * T)
    low_pass = (1.0 - pole) / (1.0 - pole * back)
    repeats = max(1, round(1.0 / (triad.rate * T)))
    hold = np.mean(back[..., None] ** np.arange(repeats), axis=-1)
    return np.asarray(low_pass * back ** round(triad.delay / T) * hold, dtype=np.complex128)

"""Motion as data: sums of simple functions of time for the attitude, and what accelerates the vehicle.

The structures are read from a scenario file; their methods turn times into arrays. Everything is NED.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ahrs_fmu import quaternion

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Trapezoid = tuple[float, float, float, float]
SCurve = tuple[float, float, float]

_DIFFERENCE_STEP = 2e-4


class Data(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of what a scenario file holds: unknown names are refused."""


class Sine(Data, frozen=True):
    """Sine of time, A sin(2 pi f (t - start) + phase), shown through its windows."""

    amplitude: float
    frequency: Positive
    phase: float = 0.0
    start: float = 0.0
    windows: tuple[Trapezoid, ...] = ()

    def __call__(self, t: Array) -> Array:
        """Value at times t, s."""
        angle = 2.0 * np.pi * self.frequency * (t - self.start) + self.phase
        shown = sum((trapezoid(t, *window) for window in self.windows), np.zeros_like(t))
        wave: Array = self.amplitude * np.sin(angle) * (shown if self.windows else 1.0)
        return wave


class Profile(Data, frozen=True):
    """Sum of simple functions of time.

    Attributes
    ----------
    trapezoids : tuple of (t0, t1, rise, height)
        Raised-cosine trapezoids.
    curves : tuple of (t0, t1, height)
        Two parabolas from 0 at t0 to `height` at t1, which then stays.
    sines : tuple of Sine
    """

    trapezoids: tuple[Trapezoid, ...] = ()
    curves: tuple[SCurve, ...] = ()
    sines: tuple[Sine, ...] = ()

    def __call__(self, t: Array) -> Array:
        """Value at times t, s."""
        value = np.zeros_like(t)
        for four in self.trapezoids:
            value = value + trapezoid(t, *four)
        for three in self.curves:
            value = value + s_curve(t, *three)
        for sine in self.sines:
            value = value + sine(t)
        return value


class Rotation(Data, frozen=True):
    """Attitude over time.

    Attributes
    ----------
    roll_deg, pitch_deg, yaw_deg : Profile
        Euler angles in degrees.
    yaw_rate : Profile
        Rate of a further yaw in rad/s, integrated by the trapezoidal rule.
    """

    roll_deg: Profile = Profile()
    pitch_deg: Profile = Profile()
    yaw_deg: Profile = Profile()
    yaw_rate: Profile = Profile()

    def euler(self, t: Array) -> Array:
        """Roll, pitch, yaw (N, 3) at times t, rad."""
        rate = self.yaw_rate(t)
        turned = np.cumsum(np.diff(t, prepend=t[0]) * 0.5 * (rate + np.roll(rate, 1)))
        yaw = np.radians(self.yaw_deg(t)) + turned
        return np.stack((np.radians(self.roll_deg(t)), np.radians(self.pitch_deg(t)), yaw), axis=-1)


class Multirotor(Data, frozen=True, tag="multirotor", tag_field="kind"):
    """Level flight on tilted thrust: the tilt accelerates, drag (1/s) brakes."""

    drag: float

    def acceleration(self, t: Array, rotation: Rotation, gravity: float) -> Array:
        """Acceleration (N, 3) in NED, m/s2."""
        euler = rotation.euler(t)
        lift = gravity / (np.cos(euler[:, 0]) * np.cos(euler[:, 1]))
        thrust = -lift[:, None] * quaternion.to_matrix(quaternion.from_euler(euler))[:, :, 2]
        push = thrust * np.array([1.0, 1.0, 0.0])
        # v' = push - drag v on the grid of samples, starting at rest: velocity lags by one sample.
        step = float(t[1] - t[0])
        velocity = np.asarray(lfilter([0.0, step], [1.0, self.drag * step - 1.0], push, axis=0))
        acceleration: Array = push - self.drag * velocity
        return acceleration


class Pivot(Data, frozen=True, tag="pivot", tag_field="kind"):
    """Rotation about a fixed point, the sensor at `arm` (m, body axes) from it."""

    arm: Vector

    def acceleration(self, t: Array, rotation: Rotation, gravity: float) -> Array:  # noqa: ARG002
        """Acceleration (N, 3) in NED, m/s2."""

        def position(time: Array) -> Array:
            return quaternion.rotate(quaternion.from_euler(rotation.euler(time)), self.arm)

        h = _DIFFERENCE_STEP
        acceleration: Array = (position(t + h) - 2.0 * position(t) + position(t - h)) / h**2
        return acceleration


class Line(Data, frozen=True, tag="line", tag_field="kind"):
    """Straight motion to the north with a given acceleration, m/s2."""

    north: Profile

    def acceleration(self, t: Array, rotation: Rotation, gravity: float) -> Array:  # noqa: ARG002
        """Acceleration (N, 3) in NED, m/s2."""
        acceleration: Array = self.north(t)[:, None] * np.array([1.0, 0.0, 0.0])
        return acceleration


class Circle(Data, frozen=True, tag="circle", tag_field="kind"):
    """Level circle of `radius` (m), nose along the path, at the yaw rate of the rotation."""

    radius: Positive

    def acceleration(self, t: Array, rotation: Rotation, gravity: float) -> Array:  # noqa: ARG002
        """Acceleration (N, 3) in NED, m/s2."""
        h = _DIFFERENCE_STEP
        rate = rotation.yaw_rate(t)
        along = self.radius * (rotation.yaw_rate(t + h) - rotation.yaw_rate(t - h)) / (2.0 * h)
        across = self.radius * rate**2
        yaw = rotation.euler(t)[:, 2]
        north = along * np.cos(yaw) - across * np.sin(yaw)
        east = along * np.sin(yaw) + across * np.cos(yaw)
        return np.stack((north, east, np.zeros_like(t)), axis=-1)


class Vibration(Data, frozen=True):
    """Sinusoidal acceleration of the sensor in body axes, m/s2 and Hz."""

    amplitude: Vector
    frequency: Positive


class Kinematics(NamedTuple):
    """How a sensor moves."""

    q: Array
    """Attitude (N, 4), body to NED."""
    rate: Array
    """Mean body rate since the time before (N, 3), rad/s; row 0 repeats row 1."""
    specific_force: Array
    """Acceleration without gravity (N, 3), body axes, m/s2."""


def kinematics(
    t: Array,
    rotation: Rotation,
    motion: Multirotor | Pivot | Line | Circle | None,
    vibration: Vibration | None,
    gravity: float,
) -> Kinematics:
    """Compute attitude, rate and specific force at times t (N,), s, equally spaced; `gravity` in m/s2."""
    q = quaternion.from_euler(rotation.euler(t))
    turns = quaternion.log(quaternion.multiply(quaternion.conjugate(q[:-1]), q[1:]))
    rate = np.concatenate((turns[:1], turns)) / (t[1] - t[0])
    acceleration = np.zeros((t.size, 3)) if motion is None else motion.acceleration(t, rotation, gravity)
    force = quaternion.rotate(quaternion.conjugate(q), acceleration - np.array([0.0, 0.0, gravity]))
    if vibration is not None:
        shake = np.sin(2.0 * np.pi * vibration.frequency * t)
        force = force + shake[:, None] * np.asarray(vibration.amplitude)
    return Kinematics(q, rate, force)


def trapezoid(t: Array, start: float, end: float, rise: float, height: float) -> Array:
    """Rise from 0 to `height` as a raised cosine within `rise` after `start`, and fall likewise to `end`."""
    up = 1.0 - np.cos(np.pi * np.clip((t - start) / rise, 0.0, 1.0))
    down = 1.0 - np.cos(np.pi * np.clip((end - t) / rise, 0.0, 1.0))
    value: Array = 0.25 * height * up * down
    return value


def s_curve(t: Array, start: float, end: float, height: float) -> Array:
    """Go from 0 at `start` to `height` at `end` with constant acceleration, then deceleration."""
    x = np.clip((t - start) / (end - start), 0.0, 1.0)
    value: Array = height * np.where(x < 0.5, 2.0 * x**2, 1.0 - 2.0 * (1.0 - x) ** 2)
    return value

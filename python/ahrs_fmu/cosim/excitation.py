"""What moves a closed or an open loop, as data: a manoeuvre to fly, a wind, a motion that is given.

Each becomes a `Playback` of columns. Everything is NED/FRD; angles in a file are in degrees.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated

import msgspec
import numpy as np
from scipy.signal import lfilter

from ahrs_fmu import counter_random, quaternion, scenarios
from ahrs_fmu.cosim.playback import Playback
from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.trajectories import (
    Circle,
    Data,
    Kinematics,
    Line,
    Multirotor,
    Pivot,
    Positive,
    Profile,
    Rotation,
    Vector,
    Vibration,
    kinematics,
)

STANDARD_GRAVITY = 9.80665

_DIFFERENCE_STEP = 1e-3
_WIND_STREAM = 0x57494E44  # "WIND", away from the streams of a sensor
_REMEMBERED = 16
_STEEPEST = np.radians(75.0)


class Manoeuvre(Rotation, frozen=True):
    """Reference of an attitude controller: `q_ref`, `rate_ref`, `angular_acceleration_ref`, `thrust`.

    Attributes
    ----------
    roll_deg, pitch_deg, yaw_deg, yaw_rate : Profile
        Attitude over time, see `ahrs_fmu.trajectories.Rotation`.
    hover_thrust : float
        Thrust that carries the level vehicle, N.
    hold_height : bool
        Divide it by the cosine of the tilt, so that a tilted vehicle keeps its height.
    thrust : Profile
        What is added, N.
    """

    hover_thrust: Positive = STANDARD_GRAVITY
    hold_height: bool = True
    thrust: Profile = Profile()

    def playback(self, step: float, rows: int) -> Playback:
        """Compute the reference at rows + 1 times, `step` seconds apart."""
        units = {"rate_ref": "rad/s", "angular_acceleration_ref": "rad/s2", "thrust": "N"}
        return Playback(_columns(self, step, rows), units, step)

    def columns(self, t: Array) -> dict[str, Array]:
        """Compute the reference at times t (N,), s, equally spaced."""
        h = _DIFFERENCE_STEP

        def attitude(at: Array) -> Array:
            return quaternion.from_euler(self._euler(at, t))

        def rate(at: Array) -> Array:
            turn = quaternion.multiply(quaternion.conjugate(attitude(at - h)), attitude(at + h))
            return quaternion.log(turn) / (2.0 * h)

        q = attitude(t)
        cosine = np.maximum(quaternion.to_matrix(q)[:, 2, 2], np.cos(_STEEPEST))
        lift = self.hover_thrust / (cosine if self.hold_height else 1.0)
        return {
            "q_ref": q,
            "rate_ref": rate(t),
            "angular_acceleration_ref": (rate(t + h) - rate(t - h)) / (2.0 * h),
            "thrust": np.broadcast_to(lift, t.shape) + self.thrust(t),
        }

    def _euler(self, at: Array, grid: Array) -> Array:
        """Angles at times that need not be on the grid; a yaw rate is integrated on the grid."""
        yaw_rate = self.yaw_rate(grid)
        turned = np.cumsum(np.diff(grid, prepend=grid[0]) * 0.5 * (yaw_rate + np.roll(yaw_rate, 1)))
        # Between rows and a little beyond both ends the rate is that of the nearest row.
        nearest = np.clip(np.rint(at / (grid[1] - grid[0])).astype(int), 0, len(grid) - 1)
        yaw = turned[nearest] + yaw_rate[nearest] * (at - grid[nearest])
        angles = np.stack((self.roll_deg(at), self.pitch_deg(at), self.yaw_deg(at)), axis=-1)
        euler: Array = np.radians(angles) + yaw[:, None] * np.array([0.0, 0.0, 1.0])
        return euler


class Wind(Data, frozen=True):
    """Velocity of the air, `velocity`, m/s, in NED.

    Attributes
    ----------
    mean : tuple of 3
        Steady wind, m/s.
    north, east, down : Profile
        Gusts, m/s.
    turbulence : float
        Standard deviation of a first-order Gauss-Markov process on each axis, m/s.
    turbulence_time : float
        Its correlation time, s.
    """

    mean: Vector = (0.0, 0.0, 0.0)
    north: Profile = Profile()
    east: Profile = Profile()
    down: Profile = Profile()
    turbulence: Annotated[float, msgspec.Meta(ge=0.0)] = 0.0
    turbulence_time: Positive = 2.0

    def playback(self, step: float, rows: int, seed: int) -> Playback:
        """Compute the wind at rows + 1 times, `step` seconds apart."""
        t = _times(step, rows)
        gusts = np.stack((self.north(t), self.east(t), self.down(t)), axis=-1)
        velocity = np.asarray(self.mean) + gusts + self._turbulence(step, rows + 1, seed)
        return Playback({"velocity": velocity}, {"velocity": "m/s"}, step)

    def _turbulence(self, step: float, rows: int, seed: int) -> Array:
        if self.turbulence == 0.0:
            return np.zeros((rows, 3))
        drawn = counter_random.normal_pair(seed, _WIND_STREAM + np.arange(3), np.arange(rows)[:, None])[
            ..., 0
        ]
        memory = float(np.exp(-step / self.turbulence_time))
        # The first value has the stationary distribution already.
        drive = drawn * np.where(np.arange(rows)[:, None] == 0, 1.0, np.sqrt(1.0 - memory**2))
        turbulence: Array = self.turbulence * lfilter([1.0], [1.0, -memory], drive, axis=0)
        return turbulence


class Motion(Data, frozen=True):
    """Motion that is given, for an estimator without a loop: `q`, `rate`, `specific_force`.

    Attributes
    ----------
    experiment : str or None
        Name of a published experiment whose motion it is (`ahrs_fmu.scenarios`).
    rotation : Rotation
        Attitude over time.
    acceleration : Multirotor, Pivot, Line, Circle or None
    vibration : Vibration or None
    """

    experiment: str | None = None
    rotation: Rotation = Rotation()
    acceleration: Multirotor | Pivot | Line | Circle | None = None
    vibration: Vibration | None = None

    def playback(self, step: float, rows: int) -> Playback:
        """Compute the motion at rows + 1 times, `step` seconds apart.

        Raises
        ------
        ScenarioError
            If there is no experiment of that name.
        """
        return Playback(_columns(self, step, rows), {"rate": "rad/s", "specific_force": "m/s2"}, step)

    def columns(self, t: Array) -> dict[str, Array]:
        """Compute the motion at times t (N,), s, equally spaced."""
        what = self._kinematics(t)
        return {"q": what.q, "rate": what.rate, "specific_force": what.specific_force}

    def _kinematics(self, t: Array) -> Kinematics:
        if self.experiment is None:
            return kinematics(t, self.rotation, self.acceleration, self.vibration, STANDARD_GRAVITY)
        published = scenarios.describe(self.experiment)
        return kinematics(t, published.rotation, published.motion, published.vibration, STANDARD_GRAVITY)


@lru_cache(maxsize=_REMEMBERED)
def _columns(what: Manoeuvre | Motion, step: float, rows: int) -> dict[str, Array]:
    """Columns of something that no seed changes: computed once for all runs of a campaign."""
    columns = what.columns(_times(step, rows))
    for column in columns.values():
        column.flags.writeable = False
    return columns


def _times(step: float, rows: int) -> Array:
    return step * np.arange(rows + 1, dtype=np.float64)

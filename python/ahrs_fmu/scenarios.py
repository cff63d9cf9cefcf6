"""The published experiments: true motion, sensor and noise levels as data, readings from a seed.

    record = scenarios.load("gc/lin", seed=1)

The file scenarios.toml says what each experiment is (docs/algorithms.md section 8); this module turns it
into arrays. Everything is NED, SI. Random numbers are those of numpy's ``default_rng(7919 seed + 13)``.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import NamedTuple

import msgspec
import numpy as np

from ahrs_fmu import quaternion, sensors
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.frames import Frame
from ahrs_fmu.records import Record
from ahrs_fmu.trajectories import (
    Array,
    Circle,
    Data,
    Line,
    Multirotor,
    Pivot,
    Positive,
    Rotation,
    Vector,
    Vibration,
    kinematics,
)

INITIAL_SAMPLES = 50


class FilterNoise(Data, frozen=True):
    """What a covariance filter is told about the sensor in an experiment.

    Attributes
    ----------
    gyro_std : float
        Per sample, rad/s.
    gyro_bias_walk : float
        Random walk of the bias, rad/s2/sqrt(Hz); times the square root of the sample time it is the step.
    accel_std : float
        Per sample, m/s2; it may hold the motion.
    mag_std : float
        Per sample, T.
    """

    gyro_std: Positive
    gyro_bias_walk: Positive
    accel_std: Positive
    mag_std: Positive


class Scenario(Data, frozen=True):
    """One experiment.

    Attributes
    ----------
    description : str
    rate : float
        Samples per second.
    duration : float
        s.
    sensor : str
        Name in `sensors`.
    filter_noise : FilterNoise
    gravity : float
        m/s2.
    field : tuple of 3
        Magnetic field in NED, T; the navigation frame is magnetic.
    rotation : Rotation
    motion : Multirotor, Pivot, Line, Circle or None
        Acceleration; None is none.
    vibration : Vibration or None
    gyro_bias_end : tuple of 3
        What a ramp adds to the gyroscope's bias by the end, rad/s.
    evaluate : tuple (from, to) or None
        Times between which an error counts, s; None: all.
    """

    description: str
    rate: Positive
    duration: Positive
    sensor: str
    filter_noise: FilterNoise
    gravity: Positive = 9.8
    field: Vector = (4e-5, 0.0, 3e-5)
    rotation: Rotation = Rotation()
    motion: Multirotor | Pivot | Line | Circle | None = None
    vibration: Vibration | None = None
    gyro_bias_end: Vector = (0.0, 0.0, 0.0)
    evaluate: tuple[float, float] | None = None

    @property
    def sample_time(self) -> float:
        """Time between samples, s."""
        return 1.0 / self.rate

    @property
    def time(self) -> Array:
        """Times of the samples (N,), s."""
        return np.arange(round(self.duration * self.rate)) / self.rate


class Truth(NamedTuple):
    """What happens in a scenario, whatever reads it."""

    time: Array
    """(N,), s."""
    q: Array
    """Attitude (N, 4), body to NED."""
    gyro: Array
    """Mean body rate since the sample before (N, 3), rad/s; row 0 repeats row 1."""
    accel: Array
    """Specific force (N, 3), body axes, m/s2."""
    mag: Array
    """Field (N, 3), body axes, T."""


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """A scenario read by its sensor.

    Attributes
    ----------
    record : Record
        Readings and true attitude.
    scenario : Scenario
        What was simulated; its noise levels and field are there.
    q0 : ndarray, shape (4,)
        Initial attitude by the rule of the experiments, `initial_attitude`.
    gyro_bias : ndarray, shape (N, 3)
        True bias of the gyroscope, rad/s.
    truth : Truth
        What happened, and what perfect sensors would have read.
    """

    record: Record
    scenario: Scenario
    q0: Array
    gyro_bias: Array
    truth: Truth


def names() -> tuple[str, ...]:
    """Names of the scenarios that `load` knows."""
    return tuple(_table())


def describe(name: str) -> Scenario:
    """Return the definition of a scenario.

    Raises
    ------
    ScenarioError
        If there is no scenario of that name.
    """
    table = _table()
    if name not in table:
        raise ScenarioError(f"scenario {name!r} is unknown; known are {', '.join(table)}")
    return table[name]


def load(name: str, seed: int = 1) -> Record:
    """Return the readings of a scenario with its true attitude.

    Raises
    ------
    ScenarioError
        If there is no scenario of that name.
    """
    return simulate(name, seed).record


def simulate(name: str, seed: int = 1) -> Simulation:
    """Read a named scenario; the result also says what the sensor's bias was and how to begin.

    Raises
    ------
    ScenarioError
        If there is no scenario of that name.
    """
    return run(describe(name), seed, name)


def run(scenario: Scenario, seed: int = 1, name: str = "scenario") -> Simulation:
    """Read any scenario, such as a variant made with ``msgspec.structs.replace``."""
    what = truth(scenario)
    ramp = what.time[:, None] / scenario.duration * np.asarray(scenario.gyro_bias_end)
    draws = sensors.GeneratorDraws(np.random.default_rng(seed * 7919 + 13))
    readings = sensors.measure(
        sensors.load(scenario.sensor),
        what.gyro + ramp,
        what.accel,
        what.mag,
        sample_time=scenario.sample_time,
        draws=draws,
    )
    evaluate = None
    if scenario.evaluate is not None:
        start, end = scenario.evaluate
        evaluate = (what.time >= start) & (what.time <= end)
    record = Record(
        time=what.time,
        gyro=readings.gyro,
        accel=readings.accel,
        mag=readings.mag,
        frame=Frame.NED,
        accel_valid=readings.accel_fresh,
        mag_valid=readings.mag_fresh,
        q_true=what.q,
        evaluate=evaluate,
        name=name,
    )
    return Simulation(record, scenario, initial_attitude(record), readings.gyro_bias + ramp, what)


def truth(scenario: Scenario) -> Truth:
    """Compute the motion of a scenario and what perfect sensors would read."""
    t = scenario.time
    what = kinematics(t, scenario.rotation, scenario.motion, scenario.vibration, scenario.gravity)
    mag = quaternion.rotate(quaternion.conjugate(what.q), np.asarray(scenario.field))
    return Truth(t, what.q, what.rate, what.specific_force, mag)


def initial_attitude(record: Record, samples: int = INITIAL_SAMPLES) -> Array:
    """Attitude (4,) of the mean specific force and field of the first samples (docs/algorithms.md section 1).

    Down is against the specific force, east is down times field.
    """
    local = record.in_frame(Frame.NED)
    down = -np.nanmean(local.accel[:samples], axis=0)
    east = np.cross(down, np.nanmean(local.mag[:samples], axis=0))
    axes = np.stack((np.cross(east, down), east, down))
    return quaternion.from_matrix(axes / np.linalg.norm(axes, axis=-1, keepdims=True))


@cache
def _table() -> dict[str, Scenario]:
    text = resources.files("ahrs_fmu").joinpath("scenarios.toml").read_text(encoding="utf-8")
    return msgspec.convert(tomllib.loads(text), dict[str, Scenario])

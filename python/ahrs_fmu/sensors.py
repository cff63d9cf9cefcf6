"""Error model of an inertial measurement unit, and named sensors.

A triad (gyroscope, accelerometer or magnetometer) turns the truth x into the reading y in this order::

    x -> axes (scale, misalignment; the magnetometer also soft and hard iron)
      -> + bias (constant, turn-on, instability, walk) + white noise
      -> bandwidth -> delay -> output rate -> quantisation -> saturation

Noise and walk are given as densities in the convention of docs/algorithms.md section 6: white noise N has
the standard deviation N/sqrt(T) per sample and shows as N/sqrt(tau) in an Allan deviation. Data sheets
print the one-sided density, sqrt(2) times as large. What a sensor is, is data: the file sensors.toml.
"""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Annotated, NamedTuple, Protocol

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import lfilter

from ahrs_fmu import counter_random
from ahrs_fmu.errors import ScenarioError

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Level = Annotated[float, msgspec.Meta(ge=0.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]

_UNBOUNDED = float("inf")
_STREAMS_PER_TRIAD = 8
_SLOW_BIAS_STREAM = 4


class Triad(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Errors of three orthogonal sensors; `unit` is rad/s, m/s2 or T.

    Attributes
    ----------
    noise_density : float
        White noise N, unit/sqrt(Hz).
    noise_std : float
        Further white noise, unit per sample whatever the rate: for sources that state it so.
    bias : tuple of 3
        Constant offset, unit.
    turn_on_bias : float
        Standard deviation of an offset drawn once per run, unit.
    bias_instability, bias_time : float
        Standard deviation (unit) and correlation time (s) of a first-order Gauss-Markov bias.
    bias_walk : float
        Random walk K of the bias, unit/s/sqrt(Hz); it starts at zero.
    scale : tuple of 3
        Relative scale error of each axis, 1.
    misalignment : tuple of 3
        Small rotation of the axes against the body, rad.
    bandwidth : float
        Corner of a single-pole low-pass, Hz, on signal and noise alike.
    delay : float
        Transport delay, s, rounded to whole samples.
    rate : float
        Output rate, Hz; below the sample rate the last output is held.
    quantisation : float
        Least significant bit, unit; 0 is none.
    saturation : float
        Largest magnitude of a reading, unit.
    """

    noise_density: Level = 0.0
    noise_std: Level = 0.0
    bias: Vector = (0.0, 0.0, 0.0)
    turn_on_bias: Level = 0.0
    bias_instability: Level = 0.0
    bias_time: Positive = 100.0
    bias_walk: Level = 0.0
    scale: Vector = (0.0, 0.0, 0.0)
    misalignment: Vector = (0.0, 0.0, 0.0)
    bandwidth: Positive = _UNBOUNDED
    delay: Level = 0.0
    rate: Positive = _UNBOUNDED
    quantisation: Level = 0.0
    saturation: Positive = _UNBOUNDED

    def white_std(self, sample_time: float) -> float:
        """Give the standard deviation of the white noise of one sample, before the bandwidth."""
        return float(np.sqrt(self.noise_density**2 / sample_time + self.noise_std**2))


class Imu(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Errors of a whole unit.

    Attributes
    ----------
    description : str
        What the figures are and where they are from.
    gyro, accel, mag : Triad
        The three sensors; a perfect one by default.
    hard_iron : tuple of 3
        Field that the vehicle adds in body axes, T.
    soft_iron : tuple of 3 rows
        Matrix that distorts the field in body axes, 1.
    """

    description: str = ""
    gyro: Triad = Triad()
    accel: Triad = Triad()
    mag: Triad = Triad()
    hard_iron: Vector = (0.0, 0.0, 0.0)
    soft_iron: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Readings(NamedTuple):
    """What an `Imu` reads; `...` are the dimensions of truth and seed together."""

    gyro: Array
    """Angular rate (..., N, 3), rad/s."""
    accel: Array
    """Specific force (..., N, 3), m/s2."""
    mag: Array
    """Field (..., N, 3), T."""
    gyro_bias: Array
    """True bias of the gyroscope (..., N, 3), rad/s."""
    accel_fresh: NDArray[np.bool_]
    """Whether the row holds a new output of the accelerometer, (N,)."""
    mag_fresh: NDArray[np.bool_]
    """Whether the row holds a new output of the magnetometer, (N,)."""


class Draws(Protocol):
    """A source of standard normal numbers."""

    def __call__(self, stream: int, samples: int) -> Array:
        """Give two numbers per sample and axis of a stream: (..., samples, 3, 2)."""


class CounterDraws:
    """Draws of `counter_random`: the same for sample k however many samples are asked for.

    Axis i of stream s uses the random stream s + i, sample k its index k.

    Parameters
    ----------
    seed : integer or array (...) of integers
        One run per seed.
    """

    def __init__(self, seed: ArrayLike) -> None:
        self._seed = np.asarray(seed)[..., None, None]

    def __call__(self, stream: int, samples: int) -> Array:
        """Give two numbers per sample and axis of a stream: (..., samples, 3, 2)."""
        return counter_random.normal_pair(self._seed, stream + np.arange(3), np.arange(samples)[:, None])


class GeneratorDraws:
    """Draws of a numpy generator, in the order in which they are asked for."""

    def __init__(self, generator: np.random.Generator) -> None:
        self._generator = generator

    def __call__(self, stream: int, samples: int) -> Array:  # noqa: ARG002
        """Give two numbers per sample and axis: (samples, 3, 2)."""
        return self._generator.standard_normal((samples, 3, 2))


def names() -> tuple[str, ...]:
    """Names of the sensors that `load` knows."""
    return tuple(_table())


def load(name: str) -> Imu:
    """Return a named sensor of sensors.toml.

    Raises
    ------
    ScenarioError
        If there is no sensor of that name.
    """
    table = _table()
    if name not in table:
        raise ScenarioError(f"sensor {name!r} is unknown; known are {', '.join(table)}")
    return table[name]


def measure(imu: Imu, gyro: Array, accel: Array, mag: Array, *, sample_time: float, draws: Draws) -> Readings:
    """Read the truth with a sensor.

    Parameters
    ----------
    imu : Imu
        The sensor.
    gyro, accel, mag : array (..., N, 3)
        True mean rate (rad/s), specific force (m/s2) and field (T) in body axes.
    sample_time : float
        Time between samples, s.
    draws : Draws
        Random numbers; a batch of seeds gives a batch of readings.
    """
    iron = np.asarray(imu.soft_iron)
    field = mag @ iron.T + np.asarray(imu.hard_iron)
    rate, gyro_bias, _ = _read(imu.gyro, gyro, sample_time, draws, 0)
    force, _, accel_fresh = _read(imu.accel, accel, sample_time, draws, _STREAMS_PER_TRIAD)
    flux, _, mag_fresh = _read(imu.mag, field, sample_time, draws, 2 * _STREAMS_PER_TRIAD)
    return Readings(rate, force, flux, gyro_bias, accel_fresh, mag_fresh)


def _read(
    triad: Triad, truth: Array, sample_time: float, draws: Draws, stream: int
) -> tuple[Array, Array, NDArray[np.bool_]]:
    samples = truth.shape[-2]
    bias, white = _bias_and_noise(triad, samples, sample_time, draws, stream)
    reading = truth @ _axes(triad).T + bias + white
    if triad.bandwidth < _UNBOUNDED:
        pole = float(np.exp(-2.0 * np.pi * triad.bandwidth * sample_time))
        reading, _ = lfilter([1.0 - pole], [1.0, -pole], reading, axis=-2, zi=pole * reading[..., :1, :])
    lag = min(round(triad.delay / sample_time), samples - 1)
    fresh = _fresh(triad.rate, samples, sample_time)
    source = np.maximum.accumulate(np.where(fresh, np.arange(samples), 0))
    reading = reading[..., np.maximum(source - lag, 0), :]
    if triad.quantisation > 0.0:
        reading = np.round(reading / triad.quantisation) * triad.quantisation
    reading = np.clip(reading, -triad.saturation, triad.saturation)
    return reading, np.broadcast_to(bias, reading.shape), fresh


def _axes(triad: Triad) -> Array:
    x, y, z = triad.misalignment
    # Small rotation of the sensor: a vector seen from turned axes turns the other way.
    turned = np.array([[1.0, z, -y], [-z, 1.0, x], [y, -x, 1.0]])
    axes: Array = np.diag(1.0 + np.asarray(triad.scale)) @ turned
    return axes


def _bias_and_noise(
    triad: Triad, samples: int, sample_time: float, draws: Draws, stream: int
) -> tuple[Array, Array]:
    bias = np.broadcast_to(np.asarray(triad.bias), (samples, 3))
    white = np.zeros((samples, 3))
    white_std = triad.white_std(sample_time)
    if white_std > 0.0 or triad.bias_walk > 0.0:
        fast = draws(stream, samples)
        white = white_std * fast[..., 0]
        steps = triad.bias_walk * np.sqrt(sample_time) * fast[..., 1]
        bias = bias + np.cumsum(steps, axis=-2) - steps[..., :1, :]
    if triad.bias_instability > 0.0 or triad.turn_on_bias > 0.0:
        slow = draws(stream + _SLOW_BIAS_STREAM, samples)
        memory = float(np.exp(-sample_time / triad.bias_time))
        drive = triad.bias_instability * np.sqrt(1.0 - memory**2) * slow[..., 0]
        # The first value is drawn from the stationary distribution.
        first = triad.bias_instability * slow[..., :1, :, 0] - drive[..., :1, :]
        wander, _ = lfilter([1.0], [1.0, -memory], drive, axis=-2, zi=first)
        bias = bias + wander + triad.turn_on_bias * slow[..., :1, :, 1]
    return bias, white


def _fresh(rate: float, samples: int, sample_time: float) -> NDArray[np.bool_]:
    if rate * sample_time >= 1.0:
        return np.ones(samples, dtype=np.bool_)
    # A half step of 1e-9 keeps a rate that divides the sample rate free of rounding.
    ticks = np.floor(np.arange(samples) * (sample_time * rate) + 1e-9)
    fresh: NDArray[np.bool_] = np.diff(ticks, prepend=-1.0) > 0.0
    return fresh


@cache
def _table() -> dict[str, Imu]:
    text = resources.files("ahrs_fmu").joinpath("sensors.toml").read_text(encoding="utf-8")
    return msgspec.convert(tomllib.loads(text), dict[str, Imu])

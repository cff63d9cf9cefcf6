"""Noise of a sensor set: from its named error model, or from a recording at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu.analysis.allan import AllanDeviation, AllanFit, allan_deviation, fit_allan
from ahrs_fmu.analysis.design import SensorNoise
from ahrs_fmu.analysis.systems import Array
from ahrs_fmu.errors import RecordError
from ahrs_fmu.frames import Frame
from ahrs_fmu.records import Record
from ahrs_fmu.sensors import Imu, Triad

AXES = ("x", "y", "z")
FIELD = 50e-6
"""Magnitude of the field where nothing else is known, T."""
DIP = math.radians(60.0)
"""Its inclination, rad."""

_WINDOW = 1.0
_RESTLESS = 2.0
_QUIET_PERCENTILE = 5.0
_MOVING = math.radians(3.0)
_SHORTEST_REST = 10.0
_SENSOR_MEMORY = 0.05
"""Seconds over which a sensor's own filter and sampling may smooth its noise."""


def noise_of_imu(imu: Imu, sample_time: float, field: float = FIELD, dip: float = DIP) -> SensorNoise:
    """Return the densities of a sensor model.

    A bias that wanders about a mean (Gauss-Markov, standard deviation s, time constant tau) acts on a
    filter that is faster than tau like a random walk of density s sqrt(2/tau).

    Parameters
    ----------
    imu : Imu
    sample_time : float
        Seconds; noise that the model states per sample becomes a density with it.
    field, dip : float, optional
        Magnitude (T) and inclination (rad) of the magnetic field.
    """
    gyro = imu.gyro
    wander = gyro.bias_instability * math.sqrt(2.0 / gyro.bias_time)
    return SensorNoise(
        gyro=_density(gyro, sample_time),
        bias_walk=math.hypot(gyro.bias_walk, wander),
        accel=_density(imu.accel, sample_time),
        mag=_density(imu.mag, sample_time),
        field=field,
        dip=dip,
    )


@dataclass(frozen=True, slots=True)
class RecordedNoise:
    """What a recording at rest tells of its sensors."""

    noise: SensorNoise
    """Mean of the axes."""
    allan: dict[str, AllanDeviation]
    """Allan deviation of the gyro, by axis, rad/s."""
    fits: dict[str, AllanFit]
    """Fits to them."""
    duration: float
    """Length of the rest, s."""
    walk_resolved: bool
    """Whether the record is long enough to see the bias walk; if not, `noise` has the largest walk that the
    record does not exclude."""


def noise_of_record(record: Record) -> RecordedNoise:
    """Return the noise densities that a recording shows while it is at rest.

    Parameters
    ----------
    record : Record
        At rest as a whole or for some time; its longest rest is used.

    Raises
    ------
    RecordError
        There is no rest of 10 s, or no magnetometer.
    """
    quiet = record.in_frame(Frame.NED).rows(*rest(record))
    T = quiet.sample_time
    allan = {name: allan_deviation(quiet.gyro[:, i], T) for i, name in enumerate(AXES)}
    fits = {name: fit_allan(a, shortest=_SENSOR_MEMORY) for name, a in allan.items()}
    if not quiet.has_mag:
        raise RecordError(f"{record.name}: no magnetometer, which the heading needs")
    field = np.nanmean(quiet.mag, axis=0)
    up = np.nanmean(quiet.accel, axis=0)
    magnitude, gravity = float(np.linalg.norm(field)), float(np.linalg.norm(up))
    walk, resolved = _walk(list(fits.values()))
    noise = SensorNoise(
        gyro=_rms([f.white.value for f in fits.values()]),
        bias_walk=walk,
        accel=_white(quiet.accel, T),
        mag=_white(quiet.mag, T),
        field=magnitude,
        dip=math.asin(float(np.clip(-field @ up / (magnitude * gravity), -1.0, 1.0))),
        gravity=gravity,
    )
    return RecordedNoise(noise, allan, fits, quiet.duration, resolved)


def rest(record: Record) -> tuple[int, int]:
    """Return the first row of the longest rest, and the first row after it.

    A second belongs to a rest if its gyro scatters no more than twice as much as in the calmest seconds.

    Raises
    ------
    RecordError
        The longest rest is shorter than 10 s.
    """
    window = max(2, round(_WINDOW / record.sample_time))
    seconds = len(record) // window
    gyro = record.gyro[: seconds * window].reshape(seconds, window, 3)
    whole = np.isfinite(gyro).all(axis=(1, 2))
    scatter = np.where(whole, np.max(np.std(gyro, axis=1), axis=-1), np.inf)
    calm = float(np.percentile(scatter[whole], _QUIET_PERCENTILE)) if whole.any() else math.inf
    start, stop = _longest(scatter <= _RESTLESS * calm) if calm < _MOVING else (0, 0)
    length = (stop - start) * window * record.sample_time
    if length < _SHORTEST_REST:
        raise RecordError(
            f"{record.name}: the longest rest is {length:.0f} s: record {_SHORTEST_REST:.0f} s or more "
            f"at rest, an hour for the bias walk"
        )
    return start * window, stop * window


def _longest(flags: NDArray[np.bool_]) -> tuple[int, int]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    starts, stops = edges[::2], edges[1::2]
    i = int(np.argmax(stops - starts))
    return int(starts[i]), int(stops[i])


def _density(triad: Triad, sample_time: float) -> float:
    slowest = sample_time if math.isinf(triad.rate) else max(sample_time, 1.0 / triad.rate)
    return math.hypot(triad.noise_density, triad.noise_std * math.sqrt(slowest))


def _white(values: Array, sample_time: float) -> float:
    """Return the white noise density of a sensor (N, 3), its rows without a sample left out."""
    kept = values[np.isfinite(values).all(axis=1)]
    each = [allan_deviation(kept[:, i], sample_time) for i in range(3)]
    return _rms([fit_allan(a, shortest=_SENSOR_MEMORY).white.value for a in each])


def _walk(fits: list[AllanFit]) -> tuple[float, bool]:
    resolved = all(f.walk.interval[0] > 0.0 for f in fits)
    return _rms([f.walk.value if resolved else f.walk.interval[1] for f in fits]), resolved


def _rms(values: list[float]) -> float:
    return math.sqrt(sum(v * v for v in values) / len(values))

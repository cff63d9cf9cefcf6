"""Sensors at rest with white noise and wandering gyro bias: the counterpart of the predicted errors."""

from __future__ import annotations

import math

import numpy as np

from ahrs_fmu.analysis.design import SensorNoise
from ahrs_fmu.analysis.measure import OperatingPoint
from ahrs_fmu.analysis.systems import Array
from ahrs_fmu.cosim.stepper import Stepper, replay


def sensors_at_rest(sensor: SensorNoise, sample_time: float, seconds: float, seed: int) -> dict[str, Array]:
    """Return what the sensors of a level vehicle that points north read.

    Parameters
    ----------
    sensor : SensorNoise
    sample_time : float
        Seconds.
    seconds : float
        Duration.
    seed : int
        The same seed gives the same noise.

    Returns
    -------
    dict of str to array (N, 3)
        gyro (rad/s), accel (m/s^2) and mag (T).
    """
    rng = np.random.default_rng(seed)
    steps, root = round(seconds / sample_time), math.sqrt(sample_time)
    rest = np.zeros((steps, 3))
    read = OperatingPoint(dip=sensor.dip, magnitude=sensor.field, gravity=sensor.gravity).sensors(rest, rest)
    bias = np.cumsum(sensor.bias_walk * root * rng.standard_normal((steps, 3)), axis=0)
    densities = {"gyro": sensor.gyro, "accel": sensor.accel, "mag": sensor.mag}
    noisy = {name: read[name] + d / root * rng.standard_normal((steps, 3)) for name, d in densities.items()}
    return {**noisy, "gyro": noisy["gyro"] + bias}


def errors_at_rest(
    stepper: Stepper, sensor: SensorNoise, sample_time: float, seconds: float, seed: int
) -> Array:
    """Return the attitude error (N, 3) of an estimator at rest, as body rotation vectors in rad.

    The stepper is reset. Its parameters are its own affair: the gravity has to be that of the sensor, and
    the field where it is given.
    """
    stepper.reset()
    q = replay(stepper, sensors_at_rest(sensor, sample_time, seconds, seed), ["q"], sample_time)["q"]
    return OperatingPoint().turned(q)

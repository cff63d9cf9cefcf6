"""A generated flight with known truth, for when no recording is at hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import quaternion
from ahrs_fmu.records import Record

FloatArray = NDArray[np.float64]

_RATE = 100.0
_REST = 5.0
_RAMP = 2.0
_GRAVITY = np.array([0.0, 0.0, 9.80665])
_FIELD = 50e-6 * np.array([np.cos(np.radians(60.0)), 0.0, np.sin(np.radians(60.0))])

_GYRO_BIAS = np.radians([0.3, -0.2, 0.25])
_GYRO_NOISE = np.radians(0.1)
_ACCEL_NOISE = 0.05
_MAG_NOISE = 0.4e-6


def demo_flight(duration: float = 60.0, seed: int = 1) -> Record:
    """Generate a small multirotor rocking in roll and pitch while it turns once around.

    Parameters
    ----------
    duration : float
        Seconds; the first five are at rest.
    seed : int
        Of the sensor noise.

    Returns
    -------
    Record
        100 Hz, frame NED, true attitude included; what comes after the rest counts in the RMS error.

    Notes
    -----
    Gyro noise 0.1 deg/s and constant bias 0.2 to 0.3 deg/s, accelerometer noise 0.05 m/s2, magnetometer
    noise 0.4 uT per sample. The vehicle accelerates sideways as its bank and pitch demand, against a drag
    of half its speed per second.
    """
    time = np.arange(round(duration * _RATE) + 1) / _RATE
    q = quaternion.from_euler(_angles(time))
    gyro = np.zeros((time.size, 3))
    gyro[1:] = quaternion.log(quaternion.multiply(quaternion.conjugate(q[:-1]), q[1:])) * _RATE
    body = quaternion.conjugate(q)
    noise = np.random.default_rng(seed).normal(size=(3, time.size, 3))
    return Record(
        time=time,
        gyro=gyro + _GYRO_BIAS + _GYRO_NOISE * noise[0],
        accel=quaternion.rotate(body, _acceleration(q) - _GRAVITY) + _ACCEL_NOISE * noise[1],
        mag=quaternion.rotate(body, np.broadcast_to(_FIELD, (time.size, 3))) + _MAG_NOISE * noise[2],
        q_true=q,
        evaluate=time >= _REST,
        name="generated flight",
    )


def _angles(time: FloatArray) -> FloatArray:
    """Roll, pitch, yaw (N, 3): slow waves that fade in after the rest."""
    moving = np.maximum(time - _REST, 0.0)
    fade = 0.5 - 0.5 * np.cos(np.pi * np.minimum(moving / _RAMP, 1.0))
    roll = 10.0 * np.sin(4.1 * moving) + 3.0 * np.sin(5.3 * moving)
    pitch = 7.0 * np.sin(3.3 * moving + 0.5) + 2.0 * np.sin(4.7 * moving)
    yaw = 8.0 * moving + 30.0 * np.sin(0.25 * moving)
    return np.radians(fade[:, None] * np.stack((roll, pitch, yaw), axis=-1))


def _acceleration(q: FloatArray) -> FloatArray:
    """Horizontal acceleration (N, 3) under a thrust that carries the weight, with linear drag."""
    thrust = -quaternion.to_matrix(q)[:, :, 2]
    pull = thrust * (_GRAVITY[2] / -thrust[:, 2:])
    acceleration: FloatArray = np.zeros(pull.shape)
    velocity = np.zeros(2)
    for k in range(1, len(q)):
        acceleration[k, :2] = pull[k, :2] - 0.5 * velocity
        velocity += acceleration[k, :2] / _RATE
    return acceleration

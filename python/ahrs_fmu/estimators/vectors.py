"""Errors of an attitude against the measured directions, as rotation vectors in body axes."""

from __future__ import annotations

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.geometry import (
    attitude_of,
    dot,
    down_of,
    has_horizontal_part,
    masked,
    near,
    norm,
    north_of,
    unit,
)
from ahrs_fmu.estimators.state import Array, Mask, Sample, select
from ahrs_fmu.quaternion import cross


def tilt_error(down: Array, z: Sample) -> Array:
    """Measured cross expected direction of the specific force."""
    return masked(z.accel_usable, cross(down, unit(z.accel)))


def decoupled_error(down: Array, north: Array, z: Sample) -> Array:
    """Tilt from gravity, heading from the horizontal field: loop gain one on all axes."""
    x, y = dot(north, z.mag), dot(cross(down, north), z.mag)
    length = np.hypot(x, y)
    heading = masked(z.mag_usable & (length > 0.0), (-y / length)[..., None] * down)
    return tilt_error(down, z) + heading


def coupled_error(kg: float, kh: float, down: Array, north: Array, z: Sample) -> Array:
    """Both cross products, measured x expected: loop gain kg (I - gg') + kh (I - hh')."""
    field = z.field[..., :1] * north + z.field[..., 1:] * down
    heading = masked(z.mag_usable & (norm(field) > 0.0), cross(unit(z.mag), unit(field)))
    return kg * tilt_error(down, z) + kh * heading


def shows_attitude(z: Sample) -> Mask:
    """Where both vectors together show an attitude.

    The front end has looked at the accelerometer as read; here it is what motion compensation leaves.
    """
    return z.accel_usable & z.mag_usable & has_horizontal_part(z.mag, z.accel)


def attitude_error(q: Array, z: Sample) -> Array:
    """Rotation from the attitude q (..., 4) to the one that accelerometer and magnetometer show.

    Without a usable magnetometer it is the shortest one that brings down to its measured direction.
    """
    both = shows_attitude(z)
    shown = select(both, attitude_of(z.accel, z.mag), q)
    full = quaternion.log(quaternion.multiply(quaternion.conjugate(q), shown))
    if both.all():
        return full
    down, measured = down_of(q), unit(-z.accel)
    axis = cross(measured, down)
    sine = norm(axis)
    tilt = masked(sine > 0.0, (np.arctan2(sine, dot(measured, down)) / sine)[..., None] * axis)
    rest = select(z.accel_usable, tilt, decoupled_error(down, north_of(q), z))
    return select(both, full, rest)


def measured_attitude(q: Array, z: Sample) -> Array:
    """Attitude that accelerometer and magnetometer show, with the sign of the predicted one q (..., 4)."""
    return near(quaternion.multiply(q, quaternion.exp(attitude_error(q, z))), q)

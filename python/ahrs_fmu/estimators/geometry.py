"""Vectors and attitudes as the filters need them, over leading batch dimensions."""

from __future__ import annotations

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.state import Array, Mask, select
from ahrs_fmu.quaternion import cross, join

MAG_SINE = 0.05
"""Of the angle between field and gravity: below there is no heading."""


def dot(a: Array, b: Array) -> Array:
    """Scalar product over the last axis."""
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def norm(v: Array) -> Array:
    """Length over the last axis."""
    return np.sqrt(dot(v, v))


def unit(v: Array) -> Array:
    """Direction over the last axis; NaN for zero, which the caller masks."""
    return v / norm(v)[..., None]


def down_of(q: Array) -> Array:
    """Direction of gravity seen from the body, (..., 3)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return join(2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z)


def north_of(q: Array) -> Array:
    """Direction of magnetic north seen from the body, (..., 3)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return join(w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y))


def near(q: Array, reference: Array) -> Array:
    """The same attitude as q with the sign that is nearer to the reference."""
    return np.where(dot(q, reference)[..., None] < 0.0, -q, q)


def attitude_from_axes(axes: Array) -> Array:
    """Attitude whose rotation matrix has these rows (..., 3, 3): the navigation axes seen from the body.

    Its sign is that of the C core: the component with the largest square is positive.
    """
    q = quaternion.from_matrix(axes)
    diagonal = np.diagonal(axes, axis1=-2, axis2=-1)
    pivot = np.where(diagonal.sum(axis=-1) > 0.0, 0, 1 + np.argmax(diagonal, axis=-1))
    return np.where(np.take_along_axis(q, pivot[..., None], axis=-1) < 0.0, -q, q)


def attitude_of(force: Array, mag: Array) -> Array:
    """Attitude from specific force and field, accelerometer first; with a zero field the heading is zero."""
    down = unit(-force)
    east = unit(cross(down, mag))
    headed = norm(mag) > 0.0
    roll = np.arctan2(down[..., 1], down[..., 2])
    pitch = np.arctan2(-down[..., 0], np.hypot(down[..., 1], down[..., 2]))
    level = quaternion.from_euler(join(roll, pitch, np.zeros_like(roll)))
    if not headed.any():
        return level
    axes = np.where(headed[..., None, None], np.stack((cross(east, down), east, down), axis=-2), np.eye(3))
    return np.where(headed[..., None], attitude_from_axes(axes), level)


def masked(where: Mask, vector: Array) -> Array:
    """Vectors (..., 3) where a mask is true, zero elsewhere."""
    return select(where, vector, np.zeros_like(vector))


def has_horizontal_part(mag: Array, vertical: Array) -> Mask:
    """Where the angle between field and vertical leaves a heading."""
    across = cross(vertical, mag)
    # Strict, so that a zero field has none.
    return np.asarray(dot(across, across) > MAG_SINE**2 * dot(vertical, vertical) * dot(mag, mag))

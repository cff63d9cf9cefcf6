"""Quaternion algebra over any leading batch dimensions.

A quaternion is an array (..., 4), Hamilton product, scalar first. As an attitude it turns body
vectors into navigation vectors, ``v_n = q v_b q*`` (docs/algorithms.md section 0). Arrays of single
precision are computed with in single precision, everything else in double.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0])
IDENTITY.flags.writeable = False


def _array(x: ArrayLike) -> Array:
    given = np.asarray(x)
    return given if given.dtype == np.float32 else np.asarray(given, dtype=np.float64)


def join(*parts: ArrayLike) -> Array:
    """Put components of equal shape (...) together as (..., n)."""
    first = _array(parts[0])
    joined = np.empty((*first.shape, len(parts)), dtype=first.dtype)
    for i, part in enumerate(parts):
        joined[..., i] = part
    return joined


def multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """Hamilton product p ⊗ q, shapes (..., 4) broadcast against each other."""
    p, q = _array(p), _array(q)
    pw, px, py, pz = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    qw, qx, qy, qz = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return join(
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def conjugate(q: ArrayLike) -> Array:
    """Conjugate (..., 4): the inverse rotation of a unit quaternion."""
    q = _array(q)
    conjugated: Array = q * np.array([1.0, -1.0, -1.0, -1.0], dtype=q.dtype)
    return conjugated


def normalise(q: ArrayLike) -> Array:
    """Scale (..., 4) to unit length."""
    q = _array(q)
    unit: Array = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def exp(v: ArrayLike) -> Array:
    """Quaternion (..., 4) of the rotation vector (..., 3) in radians."""
    v = _array(v)
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    factor = np.where(small, 0.5 - angle**2 / 48.0, np.sin(0.5 * safe) / safe)
    return np.concatenate((np.cos(0.5 * angle), factor * v), axis=-1)


def log(q: ArrayLike) -> Array:
    """Shortest rotation vector (..., 3) in radians of the unit quaternion (..., 4)."""
    q = _array(q)
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    small = sine < 1e-8
    safe = np.where(small, 1.0, sine)
    factor = np.where(
        small, 2.0 / np.where(small, q[..., :1], 1.0), 2.0 * np.arctan2(safe, q[..., :1]) / safe
    )
    return factor * q[..., 1:]


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Turn body vectors (..., 3) into navigation vectors: q v q*."""
    q, v = _array(q), _array(v)
    axis = q[..., 1:]
    t = 2.0 * cross(axis, v)
    return v + q[..., :1] * t + cross(axis, t)


def cross(a: ArrayLike, b: ArrayLike) -> Array:
    """Vector product of (..., 3) arrays, which broadcast against each other."""
    a, b = _array(a), _array(b)
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return join(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


def to_matrix(q: ArrayLike) -> Array:
    """Rotation matrix C_nb (..., 3, 3) with ``v_n = C v_b``."""
    q = _array(q)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    rows = join(
        *(w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    return rows.reshape(*q.shape[:-1], 3, 3)


def from_matrix(c: ArrayLike) -> Array:
    """Quaternion (..., 4) of the rotation matrix C_nb (..., 3, 3), with w >= 0.

    Takes the largest of the four components as the pivot, so that no division is by a small number.
    """
    c = _array(c)
    m00, m11, m22 = c[..., 0, 0], c[..., 1, 1], c[..., 2, 2]
    a, b, d = c[..., 2, 1], c[..., 1, 2], c[..., 0, 2]
    e, f, h = c[..., 2, 0], c[..., 1, 0], c[..., 0, 1]
    candidates = np.stack(
        (
            np.stack((1 + m00 + m11 + m22, a - b, d - e, f - h), axis=-1),
            np.stack((a - b, 1 + m00 - m11 - m22, h + f, d + e), axis=-1),
            np.stack((d - e, h + f, 1 - m00 + m11 - m22, a + b), axis=-1),
            np.stack((f - h, d + e, a + b, 1 - m00 - m11 + m22), axis=-1),
        ),
        axis=-2,
    )
    pivot = np.argmax(np.diagonal(candidates, axis1=-2, axis2=-1), axis=-1)
    q = normalise(np.take_along_axis(candidates, pivot[..., None, None], axis=-2)[..., 0, :])
    return np.where(q[..., :1] < 0.0, -q, q)


def to_euler(q: ArrayLike) -> Array:
    """Roll, pitch, yaw (..., 3) in radians, z-y-x order."""
    q = _array(q)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    roll = np.arctan2(2 * (w * x + y * z), w * w - x * x - y * y + z * z)
    # The arc tangent keeps its accuracy at 90 deg of pitch, where the arc sine loses half of the digits.
    pitch = np.arctan2(2 * (w * y - x * z), np.hypot(2 * (w * x + y * z), w * w - x * x - y * y + z * z))
    yaw = np.arctan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z)
    return join(roll, pitch, yaw)


def from_euler(euler: ArrayLike) -> Array:
    """Quaternion (..., 4) of roll, pitch, yaw (..., 3) in radians, z-y-x order."""
    half = 0.5 * _array(euler)
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(np.cos(half), -1, 0), np.moveaxis(np.sin(half), -1, 0)
    return np.stack(
        (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ),
        axis=-1,
    )

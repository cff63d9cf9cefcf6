"""Rotation of one sample as truncated series in the angle increment (docs/algorithms.md section 1).

An increment r is a quaternion, not of unit length: q (x) r is the attitude after it.
"""

from __future__ import annotations

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.geometry import dot
from ahrs_fmu.estimators.state import Array

LARGEST = 1.0
"""rad: beyond this the series mean nothing, and the exact rotation takes their place."""


def increment(d: Array, order: int) -> Array:
    """Quaternion (..., 4) of the angle increment d (..., 3), rad, to first, second or fourth order."""
    s = dot(d, d)
    half = np.full_like(s, 0.5)
    if order == 1:
        scalar, factor = np.ones_like(s), half
    elif order == 2:
        scalar, factor = 1.0 - s / 8.0, half
    else:
        scalar, factor = 1.0 - s / 8.0 + s * s / 384.0, half - s / 48.0
    series = np.concatenate((scalar[..., None], factor[..., None] * d), axis=-1)
    return np.where((s > LARGEST**2)[..., None], quaternion.exp(d), series)


def right_matrix(r: Array) -> Array:
    """Matrix (..., 4, 4) that multiplies quaternions with r from the right."""
    w, x, y, z = r[..., 0], r[..., 1], r[..., 2], r[..., 3]
    rows = ((w, -x, -y, -z), (x, w, z, -y), (y, -z, w, x), (z, y, -x, w))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

"""Navigation and body frames.

Inside, everything is NED (north-east-down) with the body axes FRD (forward-right-down). Users may
also speak ENU (east-north-up) with FLU (forward-left-up); the two differ by two half turns.
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu import quaternion

_FRD_FROM_FLU = np.array([1.0, -1.0, -1.0])
_Q_ENU_NED = np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0])
_Q_FRD_FLU = np.array([0.0, 1.0, 0.0, 0.0])


class Frame(Enum):
    """A navigation frame together with its body frame."""

    NED = "ned"
    """North-east-down, body forward-right-down; level rest reads (0, 0, -g)."""
    ENU = "enu"
    """East-north-up, body forward-left-up; level rest reads (0, 0, +g)."""


def body_vector(v: ArrayLike, source: Frame, target: Frame) -> NDArray[np.float64]:
    """Re-express body vectors (..., 3) of `source` in the body axes of `target`."""
    v = np.asarray(v, dtype=np.float64)
    return v.copy() if source is target else v * _FRD_FROM_FLU


def attitude(q: ArrayLike, source: Frame, target: Frame) -> NDArray[np.float64]:
    """Re-express attitudes (..., 4), body to navigation, of `source` in the axes of `target`."""
    q = np.asarray(q, dtype=np.float64)
    if source is target:
        return q.copy()
    # Both half turns are their own inverses up to sign, so one product serves both directions.
    return quaternion.multiply(quaternion.multiply(_Q_ENU_NED, q), _Q_FRD_FLU)

"""How far an estimated attitude is from the true one.

The error is the rotation q_est ⊗ q_true*, seen in the navigation frame. It splits into a turn about
the vertical, the heading error, and the tilt that remains, the inclination error. The vertical is the
third axis of both frames, so that one definition serves NED and ENU. The RMS of these angles over the
samples that count is the score of the BROAD data set (doi 10.3390/data6070072).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu import quaternion
from ahrs_fmu.errors import RecordError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class RmsError:
    """Root mean square of each error angle, in radians.

    Attributes
    ----------
    total, heading, inclination : float
        Angle of the error rotation, its turn about the vertical, and its tilt.
    roll, pitch, yaw : float
        Wrapped differences of the Euler angles.
    """

    total: float
    heading: float
    inclination: float
    roll: float
    pitch: float
    yaw: float

    def degrees(self) -> dict[str, float]:
        """Return the same numbers by name in degrees, for display."""
        return {name: float(np.degrees(value)) for name, value in asdict(self).items()}


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeError:
    """Error of an attitude over time, in radians.

    Attributes
    ----------
    known : ndarray of bool, shape (N,)
        Where the true attitude is known; elsewhere the errors are NaN.
    total, heading, inclination : ndarray, shape (N,)
        Angle of the error rotation, its turn about the vertical, and its tilt; in [0, pi].
    euler : ndarray, shape (N, 3)
        Estimated minus true roll, pitch, yaw, wrapped to (-pi, pi].
    """

    known: BoolArray
    total: FloatArray
    heading: FloatArray
    inclination: FloatArray
    euler: FloatArray

    def rms(self, evaluate: BoolArray | None = None) -> RmsError:
        """Root mean square over the samples that count.

        Parameters
        ----------
        evaluate : ndarray of bool, shape (N,), optional
            Samples that count; None: all. Samples without truth never count. An estimate that is not
            finite makes the result NaN.

        Raises
        ------
        RecordError
            No sample counts.
        """
        counts = self.known if evaluate is None else self.known & evaluate
        if not counts.any():
            raise RecordError(
                "no sample both counts and has a true attitude; there is nothing to compare with"
            )

        def root_mean_square(x: FloatArray) -> float:
            return float(np.sqrt(np.mean(x[counts] ** 2)))

        return RmsError(
            total=root_mean_square(self.total),
            heading=root_mean_square(self.heading),
            inclination=root_mean_square(self.inclination),
            roll=root_mean_square(self.euler[:, 0]),
            pitch=root_mean_square(self.euler[:, 1]),
            yaw=root_mean_square(self.euler[:, 2]),
        )


def attitude_error(q_est: ArrayLike, q_true: ArrayLike) -> AttitudeError:
    """Compare estimated attitudes with true ones.

    Parameters
    ----------
    q_est, q_true : array_like, shape (N, 4)
        Body to navigation, scalar first, both in the same frame; sign does not matter. NaN rows of
        `q_true` mean that the truth is unknown.

    Returns
    -------
    AttitudeError
        Computed by atan2 of the parts of the error quaternion, which keeps small angles exact where an
        arc cosine would lose half of the digits.
    """
    q_est, q_true = (np.asarray(q, dtype=np.float64) for q in (q_est, q_true))
    w, x, y, z = np.moveaxis(np.abs(quaternion.multiply(q_est, quaternion.conjugate(q_true))), -1, 0)
    tilt = np.hypot(x, y)
    euler = quaternion.to_euler(q_est) - quaternion.to_euler(q_true)
    return AttitudeError(
        known=np.asarray(np.isfinite(q_true).all(axis=-1)),
        total=2.0 * np.arctan2(np.hypot(tilt, z), w),
        heading=2.0 * np.arctan2(z, w),
        inclination=2.0 * np.arctan2(tilt, np.hypot(w, z)),
        euler=wrap(euler),
    )


def wrap(angle: ArrayLike) -> FloatArray:
    """Bring angles in radians into (-pi, pi]."""
    return np.pi - np.mod(np.pi - np.asarray(angle, dtype=np.float64), 2.0 * np.pi)

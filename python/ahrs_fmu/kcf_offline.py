"""The KCF for recordings: forward in time, then backward with all that was learned, then both together.

The forward pass knows the past of every sample. The backward pass is the same C filter: it goes on from where
the forward pass ended, over the recording turned around in time, and knows the whole recording when it comes
to a sample. Their errors differ where the filter was still learning and after every change of the field, so
that the middle between them is better than either (docs/accuracy.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import quaternion
from ahrs_fmu.estimate import EstimateResult
from ahrs_fmu.models import KCF
from ahrs_fmu.records import Record

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedResult:
    """Attitude of a recording from all of its samples.

    Attributes
    ----------
    q : ndarray, shape (N, 4)
        Body to navigation, scalar first, in the frame of the estimator.
    forward : EstimateResult
        What the filter gave as it went, over the same rows.
    backward : ndarray, shape (N, 4)
        What it gave on the way back.
    """

    q: FloatArray
    forward: EstimateResult
    backward: FloatArray


def smooth(record: Record, estimator: KCF | None = None) -> SmoothedResult:
    """Estimate the attitude of a recording from past and future.

    Parameters
    ----------
    record : Record
        The recording.
    estimator : KCF, optional
        The filter with its parameters; by default one with the frame and sample time of the recording.

    Returns
    -------
    SmoothedResult
        The smoothed attitude with both passes.
    """
    if estimator is None:
        estimator = KCF(frame=record.frame.value, sample_time=record.sample_time)
    samples = record.in_frame(estimator.frame)
    n = len(samples)
    learned = estimator.run(samples)
    there_and_back = estimator.run(_and_back(samples, learned))
    backward = there_and_back.q[: n - 2 : -1]
    return SmoothedResult(between(learned.q, backward), learned, backward)


def between(p: FloatArray, q: FloatArray) -> FloatArray:
    """Attitudes (N, 4) half way between two, heading and tilt each for itself.

    Parameters
    ----------
    p, q : ndarray, shape (N, 4)
        Unit quaternions.

    Returns
    -------
    ndarray, shape (N, 4)
        q turned back about the vertical by half the difference in heading, and half of the remaining tilt.
    """
    turn = quaternion.multiply(q, quaternion.conjugate(p))
    turn = turn * np.where(turn[:, :1] < 0.0, -1.0, 1.0)
    heading = 2.0 * np.arctan2(turn[:, 3], turn[:, 0])
    level = quaternion.multiply(_about_vertical(-heading), q)
    tilt = quaternion.log(quaternion.multiply(level, quaternion.conjugate(p)))
    return quaternion.multiply(
        _about_vertical(0.5 * heading), quaternion.multiply(quaternion.exp(0.5 * tilt), p)
    )


def _about_vertical(angle: FloatArray) -> FloatArray:
    return quaternion.exp(angle[:, None] * np.array([0.0, 0.0, 1.0]))


def _and_back(record: Record, learned: EstimateResult) -> Record:
    """Make a recording that goes on backward in time from its last row to its first.

    Backward, every rate changes its sign, and with it the bias that the filter would have to learn anew:
    twice the learned bias keeps it. Likewise the magnetometer, which lagged, would lead: it is taken from
    twice the learned latency later.
    """
    time, last = record.time, record.time[-1]
    bias = learned.gyro_bias[-1]
    latency = float(learned.others["mag_latency"][-1].item())
    later = np.clip(time + 2.0 * latency, time[0], last)
    mag = np.stack([np.interp(later, time, axis) for axis in record.mag.T], axis=-1)
    # Row k holds the rate up to t_k; on the way back the interval before t_k is the one that followed it.
    gyro_back = 2.0 * bias - record.gyro[:0:-1]
    return replace(
        record,
        time=np.concatenate((time, last + (last - time[-2::-1]))),
        gyro=np.concatenate((record.gyro, gyro_back)),
        accel=np.concatenate((record.accel, record.accel[-2::-1])),
        mag=np.concatenate((record.mag, mag[-2::-1])),
        accel_valid=np.concatenate((record.accel_valid, record.accel_valid[-2::-1])),
        mag_valid=np.concatenate((record.mag_valid, record.mag_valid[-2::-1])),
        q_true=None,
        evaluate=None,
    )

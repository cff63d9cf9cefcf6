"""What may happen to the samples before a filter sees them: the twin of fmu_src/estimator/preprocessing.h.

The zero of the gyroscope and the low-pass of the accelerometer (docs/algorithms.md section 0).
"""

from __future__ import annotations

import numpy as np

from ahrs_fmu.estimators.geometry import dot, masked, norm
from ahrs_fmu.estimators.state import Array, CommonState, Condition, Mask, Parameters, Sample, select

ZERO_FORCE = 0.3
"""m/s2: mean specific force further from gravity is not rest."""
LOWPASS_STEP = 0.45
"""Of the cut-off period: after a longer step the low-pass begins anew."""


def calibrated_mag(p: Parameters, mag: Array) -> Array:
    """Field (..., 3) without hard iron and unequal gains; no measurement, which is zero, stays one."""
    measured = (mag != 0.0).any(axis=-1)
    return masked(measured, (mag - p.mag_offset) * p.mag_gain)


def gyro_zero(s: CommonState) -> Array:
    """Zero of the gyroscope (..., 3) in inner axes, rad/s; zero while it is not known."""
    return masked(s.has(Condition.HAS_GYRO_ZERO), s.gyro_zero)


def remove_gyro_zero(s: CommonState, p: Parameters, z: Sample, measured: Mask) -> tuple[Array, Mask]:
    """Rate without the gyroscope's zero, and where the zero has just become known."""
    learning = measured & ~s.has(Condition.HAS_GYRO_ZERO) & z.force_usable
    learned = _learn(s, p, z.rate, norm(z.force), learning)
    rate = select(measured, z.rate - gyro_zero(s), z.rate)
    s.gyro = select(measured, rate, s.gyro)
    return rate, learned


def _learn(s: CommonState, p: Parameters, rate: Array, force: Array, learning: Mask) -> Mask:
    """Take a sample into the means over a rest; a rest that was none is dropped and the next one tried."""
    first = s.zero_count == 0
    count = s.zero_count + 1
    before = select(first, rate, s.gyro_zero)
    mean = before + (rate - before) / count[..., None]
    spread = np.where(first, 0.0, s.gyro_spread) + dot(rate - before, rate - mean)
    excess = np.where(first, 0.0, s.force_excess)
    excess = excess + (force - p.gravity - excess) / count
    complete = learning & (count >= p.gyro_zero_samples)
    at_rest = (
        (spread <= 3.0 * (count - 1) * p.gyro_zero_std**2)
        & (np.abs(excess) <= ZERO_FORCE)
        & (dot(mean, mean) <= p.gyro_zero_limit**2)
    )
    s.gyro_zero = select(learning, mean, s.gyro_zero)
    s.gyro_spread = np.where(learning, spread, s.gyro_spread)
    s.force_excess = np.where(learning, excess, s.force_excess)
    s.zero_count = np.where(learning, np.where(complete, 0, count), s.zero_count).astype(np.int32)
    s.mark(Condition.HAS_GYRO_ZERO, complete & at_rest)
    return np.asarray(complete & at_rest)


def smooth_force(s: CommonState, p: Parameters, force: Array, usable: Mask, dt: float, active: Mask) -> Array:
    """Specific force (..., 3) behind a second-order Butterworth low-pass of cut-off `accel_cutoff`.

    It begins at rest in the first sample, and anew after a sample that is missing or a long step.
    """
    turns = p.accel_cutoff * dt
    running = usable & s.has(Condition.SMOOTHS_FORCE) & (turns <= LOWPASS_STEP)
    g = np.tan(np.pi * min(turns, LOWPASS_STEP))
    middle = (s.force_band + g * (force - s.force_low)) / (1.0 + g * (g + np.sqrt(2.0)))
    smooth = s.force_low + g * middle
    began = active & usable & ~running
    s.force_band = select(active & running, 2.0 * middle - s.force_band, masked(~began, s.force_band))
    s.force_low = select(active & running, 2.0 * smooth - s.force_low, select(began, force, s.force_low))
    s.assign(Condition.SMOOTHS_FORCE, usable, active)
    return select(running, smooth, force)

"""Noise densities as variances of one sample (docs/algorithms.md section 6).

White noise of density N has the variance N^2/T per sample; an integrated one grows by N^2 T.
"""

from __future__ import annotations

import numpy as np

from ahrs_fmu.estimators.state import Array, Parameters, Sample

HELD_NOISE = 0.1
"""rad/s/sqrt(Hz): how wrong a rate is that was not measured: an unusable sample, or too long a step."""


def sample_variance(p: Parameters, density: float) -> float:
    """Variance of white noise in one sample: of the sensor's interval, whatever the step."""
    return density**2 / float(p.sample_time)


def turn_variance(z: Sample, density: float) -> Array:
    """Variance (...) of the rotation in one step, rad2."""
    held = z.gyro_held | (z.gain_dt == 0.0)
    return (density**2 + np.where(held, HELD_NOISE**2, 0.0)) * z.dt


def motion_variance(p: Parameters, z: Sample, density: float) -> float:
    """Variance of what motion compensation leaves of a changing acceleration, (m/s2)2."""
    return density**2 * z.dt if p.motion_compensation else 0.0

"""The estimators by what can be asked of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ahrs_fmu import Estimator, Record, models

ALL = tuple(name for name in sorted(models.BY_NAME) if name != "kcf")
"""The KCF averages and calibrates, and has tests of its own."""
CORRECTING = tuple(name for name in ALL if name != "strapdown")
LEARNING_BIAS = ("gcf", "mahony", "mahony_ekf", "mekf", "ukf")
WITH_COVARIANCE = ("adaptive_ckf", "cg_ekf", "improved_ekf", "mahony_ekf", "mekf", "ukf")
BY_POINTS = ("adaptive_ckf", "ukf")
"""Their means feel the curvature of rotations within the covariance: milliradians while that is large."""
PRECISIONS = ("double", "single")


def make(name: str, **parameters: object) -> Estimator:
    return models.BY_NAME[name](**parameters)


def noisy(record: Record, seed: int = 11) -> Record:
    """Noise of a small sensor: 0.1 deg/s, 0.05 m/s2, 0.3 uT."""
    draw = np.random.default_rng(seed).normal(size=(3, len(record), 3))
    return replace(
        record,
        gyro=record.gyro + np.radians(0.1) * draw[0],
        accel=record.accel + 0.05 * draw[1],
        mag=record.mag + 3e-7 * draw[2],
    )

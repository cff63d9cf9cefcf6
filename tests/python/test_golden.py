"""Every estimator against traces computed independently of this project (docs/algorithms.md)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import Record, models
from motion import angle_between

FILES = ("me_hover", "ac_swing", "cg_hand", "gc_lin", "gc_circ")
Parameters = dict[str, object]


@dataclass(frozen=True)
class Trace:
    """A golden file: samples, noise levels per sample, and the attitude that each filter should give."""

    arrays: dict[str, np.ndarray]

    @property
    def sample_time(self) -> float:
        return float(self.arrays["sample_time"])

    @property
    def record(self) -> Record:
        n = len(self.arrays["gyro"])
        return Record(
            time=np.arange(n) * self.sample_time,
            gyro=self.arrays["gyro"],
            accel=self.arrays["accel"],
            mag=self.arrays["mag"] * 1e-6,
        )

    @property
    def setting(self) -> Parameters:
        field = self.arrays["mag_reference"] * 1e-6
        return {
            "sample_time": self.sample_time,
            "gravity": 9.8,
            "initialisation": "given",
            "q0": tuple(self.arrays["q0"]),
            "field_reference": "given",
            "field_magnitude": float(np.linalg.norm(field)),
            "field_dip": math.atan2(field[2], field[0]),
        }


def fixed(**parameters: object) -> Callable[[Trace], Parameters]:
    return lambda _: parameters


UNLIMITED = {"bias_limit": 100.0}
"""The traces know no limit of the bias, and on gc_circ it would take hold."""
COMPENSATED = {"motion_compensation": True, **UNLIMITED}


def quaternion_ekf(trace: Trace) -> Parameters:
    """Process noise 1e-2 (rad/s)2 and measurement noise 1e-4 per sample, as quaternion elements."""
    t = trace.sample_time
    return {
        "gyro_noise": math.sqrt(1e-2 * t),
        "attitude_noise": 2.0 * math.sqrt(1e-4 * t),
        "accel_distrust": 1.0,
        "initial_attitude_std": 2.0,
    }


def cg_ekf(trace: Trace) -> Parameters:
    """Process noise 2.5e-4 per second and measurement noise 1e-3 per sample, as quaternion elements."""
    return {
        "gyro_noise": 2.0 * math.sqrt(2.5e-4),
        "attitude_noise": 2.0 * math.sqrt(1e-3 * trace.sample_time),
        "initial_attitude_std": 0.2,
        "iterations": 4,
    }


def cubature(trace: Trace, variance: float, **parameters: object) -> Parameters:
    """Process noise `variance` per sample, measurement noise 1 (m/s2)2 and 0.1 rad2 per sample."""
    t = trace.sample_time
    return {
        "process_noise": "isotropic",
        "quaternion_noise": math.sqrt(variance / t),
        "accel_noise": math.sqrt(t),
        "heading_noise": math.sqrt(0.1 * t),
        "initial_attitude_std": 2.0 * math.sqrt(1e-3),
        **parameters,
    }


def sensor_noise(trace: Trace) -> Parameters:
    """The levels of the file: per sample, but that of the bias, which is a step per sample."""
    root = math.sqrt(trace.sample_time)
    level = {name: float(trace.arrays[name]) for name in trace.arrays if name.endswith("_sigma")}
    return {
        "gyro_noise": level["gyro_sigma"] * root,
        "gyro_bias_noise": level["gyro_bias_step_sigma"] / root,
        "accel_noise": level["accel_sigma"] * root,
        "mag_noise": level["mag_sigma"] * 1e-6 * root,
        "initial_attitude_std": 0.1,
        "initial_bias_std": 0.02,
        **UNLIMITED,
    }


CASES: dict[str, tuple[str, Callable[[Trace], Parameters]]] = {
    "improved_ekf": ("improved_ekf", quaternion_ekf),
    "mahony_ekf": ("mahony_ekf", lambda t: {**quaternion_ekf(t), **UNLIMITED}),
    "mahony_ekf_printed": ("mahony_ekf", lambda t: {**quaternion_ekf(t), **UNLIMITED, "bias_feed": False}),
    "cg_ekf": ("cg_ekf", cg_ekf),
    "ckf_fixed": ("adaptive_ckf", lambda t: cubature(t, 1e-4, adaptation="none")),
    "adaptive_ckf_r_only": ("adaptive_ckf", lambda t: cubature(t, 1e-7, warm_up=100)),
    "mekf": ("mekf", sensor_noise),
    "ukf_cubature": ("ukf", sensor_noise),
    "strapdown": ("strapdown", fixed()),
    "complementary": ("complementary", fixed(kp=0.58)),
    "mahony": ("mahony", fixed(kp=1.0, ki=0.1, **UNLIMITED)),
    "gcf_coupled": ("gcf", fixed(error="coupled", **UNLIMITED)),
    "gcf_decoupled": ("gcf", fixed(**UNLIMITED)),
    "gcf_decoupled_first": ("gcf", fixed(ki=0.0, **UNLIMITED)),
    "gcf_decoupled_third": ("gcf", fixed(kp=1.0, ki=0.3, kii=0.05, **UNLIMITED)),
    "gcf_decoupled_comp98": (
        "gcf",
        lambda t: {**COMPENSATED, "motion_time_constant": -t.sample_time / math.log(0.98)},
    ),
    "gcf_coupled_comp100": ("gcf", fixed(error="coupled", motion_time_constant=math.inf, **COMPENSATED)),
}
SQUARE_ROOT = {"ukf_cubature"}


@pytest.fixture(params=FILES)
def trace(request: pytest.FixtureRequest, golden_dir: Path) -> Trace:
    with np.load(golden_dir / f"{request.param}.npz") as arrays:
        return Trace({name: arrays[name] for name in arrays})


@pytest.mark.parametrize("case", CASES)
def test_the_attitude_is_that_of_the_independent_computation(case: str, trace: Trace) -> None:
    model, parameters = CASES[case]
    estimator = models.BY_NAME[model](**trace.setting, **parameters(trace))
    result = estimator.run(trace.record)
    error = angle_between(trace.arrays[case], result.q)
    assert np.max(error) < (2e-6 if case in SQUARE_ROOT else 1e-9)
    if f"{case}_bias" in trace.arrays:
        np.testing.assert_allclose(result.gyro_bias, trace.arrays[f"{case}_bias"], rtol=0.0, atol=1e-9)

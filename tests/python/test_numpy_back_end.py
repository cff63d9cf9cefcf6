"""The numpy back-end against the C core, option by option, on data that meets every rule."""

from __future__ import annotations

import numpy as np
import pytest

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.estimators.model import FILTERS, NumpyModel
from ahrs_fmu.native import NativeModel

COMMON_OPTIONS: dict[str, dict[str, object]] = {
    "default": {},
    "enu": {"frame": "enu"},
    "declination": {"declination": 0.2, "frame": "enu"},
    "given field": {"field_reference": "given", "field_magnitude": 4.9e-5, "field_dip": 0.6},
    "given attitude": {"initialisation": "given", "q0": [0.9, 0.1, -0.3, 0.2], "declination": -0.1},
    "averaged start": {"init_time": 0.5},
    "motion compensation": {"motion_compensation": True, "motion_time_constant": 0.7},
    "gating": {"accel_gating": True, "accel_gate": 0.8, "accel_gate_time": 0.5},
    "gyro zero": {"gyro_zero_samples": 20},
    "low-pass": {"accel_cutoff": 8.0, "frame": "enu", "gyro_zero_samples": 10},
    "calibrated magnetometer": {"mag_offset": [2e-6, -1e-6, 3e-6], "mag_gain": [1.1, 0.9, 1.0]},
}

OWN_OPTIONS: dict[str, dict[str, dict[str, object]]] = {
    "gcf": {
        "coupled": {"error": "coupled", "kg": 1.3, "kh": 0.7},
        "attitude": {"form": "attitude"},
        "third order": {"kp": 1.0, "ki": 0.3, "kii": 0.05},
        "vector": {"realisation": "vector"},
        "dcm": {"realisation": "dcm", "form": "attitude"},
        "euler": {"realisation": "euler"},
        "small bias limit": {"bias_limit": 0.01},
    },
    "adaptive_ckf": {
        "not adaptive": {"adaptation": "none", "process_noise": "isotropic", "quaternion_noise": 0.01},
        "safe": {"adaptation": "qr_safe", "warm_up": 20},
        "printed": {"adaptation": "printed", "process_noise": "isotropic", "measurement_variance_min": 1.0},
        "moving": {"motion_compensation": True, "motion_noise": 1.0, "forgetting": 0.98},
    },
    "mahony": {"small bias limit": {"bias_limit": 0.01}},
    "improved_ekf": {
        "noisy": {"accel_distrust": 5.0, "motion_compensation": True, "motion_noise": 2.0, "gyro_noise": 0.03}
    },
    "mahony_ekf": {"printed": {"bias_feed": False, "attitude_noise": 0.01}},
    "mekf": {
        "small bias limit": {"bias_limit": 0.01},
        "overconfident": {"accel_noise": 1e-3, "mag_noise": 1e-8, "gyro_noise": 1e-3},
        "noisy motion": {"motion_compensation": True, "motion_noise": 2.0, "gyro_bias_noise": 1e-3},
    },
    "ukf": {
        "wider points": {"alpha": 0.7, "beta": 2.0, "kappa": 1.0, "bias_limit": 0.01},
        "narrow points": {"alpha": 0.1, "accel_noise": 0.3},
    },
    "cg_ekf": {"many iterations": {"iterations": 12}, "one iteration": {"iterations": 1}},
    "kcf": {
        "spread": {"spread": True},
        "plain, six axes": {"refine": False, "use_mag": False},
        "momentary gyroscope": {"gyro_sampling": "instant", "profile": "multirotor"},
        "custom time, calibrated": {
            "profile": "custom",
            "accel_time_constant": 1.0,
            "uncalibrated_odds": 0.0,
        },
    },
}

# The common part is the same code in every filter: its options run in one of them, in all when slow.
CASES = [
    pytest.param(
        model,
        options,
        id=f"{model} {name}",
        marks=pytest.mark.slow if model != "gcf" and name in COMMON_OPTIONS and name != "default" else (),
    )
    for model in sorted(FILTERS)
    for name, options in {**COMMON_OPTIONS, **OWN_OPTIONS.get(model, {})}.items()
]


def flight(enu: bool = False, rows: int = 420) -> dict[str, np.ndarray]:
    """Rest, then motion, with every misfortune a sensor can have and irregular steps."""
    rng = np.random.default_rng(42)
    t = np.cumsum(rng.uniform(0.005, 0.015, rows))
    moves = (np.clip(t - t[50], 0.0, 0.5) / 0.5)[:, None]
    euler = np.stack((0.8 * np.sin(2 * t), 0.6 * np.sin(1.3 * t + 1), 0.5 * t), axis=-1) * moves**2
    q = quaternion.from_euler(euler)
    turn = quaternion.log(quaternion.multiply(quaternion.conjugate(q[:-1]), q[1:]))
    dt = np.diff(t, prepend=t[0])
    gyro = np.concatenate((np.zeros((1, 3)), turn / dt[1:, None])) + np.array([0.02, -0.01, 0.015])
    motion = np.stack((1.5 * np.sin(t), np.cos(3 * t), 0.5 * np.sin(5 * t)), axis=-1) * moves
    accel = quaternion.rotate(quaternion.conjugate(q), motion - [0.0, 0.0, 9.80665])
    mag = quaternion.rotate(quaternion.conjugate(q), [4e-5, 0.0, 3e-5])
    noise = rng.standard_normal((3, rows, 3))
    gyro, accel, mag = gyro + 2e-3 * noise[0], accel + 0.05 * noise[1], mag + 3e-7 * noise[2]
    accel_valid, mag_valid = np.ones(rows, dtype=np.bool_), np.ones(rows, dtype=np.bool_)
    gyro[60:64] = np.nan
    accel[80:90] = np.nan
    mag[0:5] = np.nan
    mag[100:120, 1] = np.inf
    accel[130:150] *= 0.05
    mag[160:180] = 4e-6 * accel[160:180]
    mag[200:205] = 1e-9 * mag[200:205] / 4e-5
    accel[220:260] *= 1.4
    gyro[270] = 1e5
    accel_valid[300:320] = False
    mag_valid[310:330] = False
    dt[350], dt[360], dt[370], dt[380], dt[390] = 0.8, 0.0, -0.01, np.nan, 0.4
    if enu:
        gyro, accel, mag = (v * [1.0, -1.0, -1.0] for v in (gyro, accel, mag))
    return {
        "dt": dt,
        "gyro": gyro,
        "accel": accel,
        "mag": mag,
        "accel_valid": accel_valid,
        "mag_valid": mag_valid,
    }


def both(model: str, options: dict[str, object]) -> tuple[NativeModel, NumpyModel]:
    descriptor = descriptors.load(model)
    pair = NativeModel(descriptor), NumpyModel(descriptor)
    for core in pair:
        for name, value in options.items():
            core.set(name, descriptor.numbers(descriptor.parameter(name), value))
        core.reset()
    return pair


@pytest.mark.parametrize(("model", "options"), CASES)
def test_numpy_and_c_agree_through_every_misfortune(model: str, options: dict[str, object]) -> None:
    data = flight(enu=options.get("frame") == "enu")
    dt = data.pop("dt")
    native, numpy_ = both(model, options)
    outputs = [v.name for v in native.descriptor.outputs]
    c, py = native.run(dt, data, outputs), numpy_.run(dt, data, outputs)
    for output in ("status", "gyro_held", "accel_used", "mag_used"):
        np.testing.assert_array_equal(py[output], c[output], err_msg=output)
    # Nominal or without magnetometer, without accelerometer, rate held, step rejected.
    assert len(set(c["status"].tolist())) >= 4
    turn = quaternion.log(quaternion.multiply(quaternion.conjugate(c["q"]), py["q"]))
    assert np.abs(turn).max() < 1e-9
    for output in set(outputs) - {"roll", "pitch", "yaw", "status"}:
        np.testing.assert_allclose(py[output], c[output], rtol=0, atol=1e-9, err_msg=output)
    for output in ("roll", "pitch", "yaw"):
        np.testing.assert_allclose(np.sin(py[output] - c[output]), 0.0, atol=1e-9, err_msg=output)

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from ahrs_fmu import calibration, quaternion
from ahrs_fmu.errors import CalibrationError, DesignError
from ahrs_fmu.frames import Frame

G = calibration.STANDARD_GRAVITY
BIAS = np.array([0.01, -0.02, 0.005])


def rest(samples: int = 300) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    gyro = BIAS + 1e-3 * rng.standard_normal((samples, 3))
    accel = np.array([0.0, 0.0, -G]) + 0.05 * rng.standard_normal((samples, 3))
    return gyro, accel


def test_the_gyro_bias_is_found_within_its_noise() -> None:
    gyro, accel = rest()
    bias = calibration.gyro_zero_bias(gyro, accel, noise_std=1e-3)
    np.testing.assert_allclose(bias, BIAS, atol=4e-3 / np.sqrt(200))
    np.testing.assert_array_equal(bias, gyro[:200].mean(axis=0))


def test_rotation_during_the_gyro_calibration_is_refused_with_its_size() -> None:
    gyro, accel = rest()
    gyro[:, 2] += 0.05 * np.sin(np.arange(300) / 10)
    with pytest.raises(CalibrationError, match=r"standard deviation is 0\.03\d+ rad/s, limit 0\.003 rad/s"):
        calibration.gyro_zero_bias(gyro, accel, noise_std=1e-3)


def test_acceleration_during_the_gyro_calibration_is_refused_with_its_size() -> None:
    gyro, accel = rest()
    with pytest.raises(CalibrationError, match=r"gravity by 0\.5\d* m/s2, limit 0\.3"):
        calibration.gyro_zero_bias(gyro, accel + np.array([0, 0, 0.5]), noise_std=1e-3)
    accel[:, 2] += np.where(np.arange(300) % 2, 1.0, -1.0)
    with pytest.raises(CalibrationError, match="gravity"):
        calibration.gyro_zero_bias(gyro, accel, noise_std=1e-3)


def test_a_calibration_needs_enough_finite_samples() -> None:
    gyro, accel = rest(150)
    with pytest.raises(CalibrationError, match="200 or more"):
        calibration.gyro_zero_bias(gyro, accel, noise_std=1e-3)
    gyro, accel = rest()
    gyro[7, 0] = np.nan
    with pytest.raises(CalibrationError, match="1 rows that are not finite"):
        calibration.gyro_zero_bias(gyro, accel, noise_std=1e-3)


@pytest.mark.parametrize(("frame", "level"), [(Frame.NED, -G), (Frame.ENU, G)])
def test_the_accelerometer_bias_leaves_gravity_in(frame: Frame, level: float) -> None:
    readings = np.tile([0.1, -0.2, level + 0.3], (200, 1))
    np.testing.assert_allclose(
        calibration.accel_zero_bias(readings, frame=frame), (0.1, -0.2, 0.3), atol=1e-12
    )


def ellipsoid(noise: float, fraction: float = 1.0) -> np.ndarray:
    rng = np.random.default_rng(11)
    directions = quaternion.normalise(rng.standard_normal((4000, 4)))
    field = quaternion.rotate(quaternion.conjugate(directions), [4e-5, 0, 3e-5])
    gain = np.array([1.0, 1.2, 0.8 * fraction])
    return field * gain + [3e-6, -5e-6, 8e-6] + noise * rng.standard_normal((4000, 3))


def test_min_max_recovers_hard_iron_and_makes_the_field_round() -> None:
    result = calibration.mag_min_max(ellipsoid(0.0))
    np.testing.assert_allclose(result.offset, (3e-6, -5e-6, 8e-6), atol=5e-8)
    np.testing.assert_allclose(result.gain, (1.0, 1 / 1.2, 1 / 0.8), rtol=2e-3)
    magnitude = np.linalg.norm(result.apply(ellipsoid(0.0)), axis=-1)
    np.testing.assert_allclose(magnitude, 5e-5, rtol=3e-3)


def test_min_max_recovers_hard_iron_within_the_noise() -> None:
    noise = 0.3e-6
    result = calibration.mag_min_max(ellipsoid(noise))
    np.testing.assert_allclose(result.offset, (3e-6, -5e-6, 8e-6), atol=2 * noise)


def test_min_max_ignores_rows_without_a_reading() -> None:
    field = ellipsoid(0.0)
    with_gaps = np.insert(field, 100, np.nan, axis=0)
    assert calibration.mag_min_max(with_gaps) == calibration.mag_min_max(field)


def test_min_max_refuses_poor_coverage_and_names_the_axis() -> None:
    with pytest.raises(CalibrationError, match=r"z axis with 0\.1\d*"):
        calibration.mag_min_max(ellipsoid(0.0, fraction=0.2))
    with pytest.raises(CalibrationError, match="usable rows"):
        calibration.mag_min_max(np.full((10, 3), np.nan))


@pytest.mark.parametrize(
    ("rate", "numerator", "denominator"),
    [
        (250, (0.00362168, 0.00724336, 0.00362168), (1, -1.82269493, 0.83718165)),
        (100, (0.02008337, 0.04016673, 0.02008337), (1, -1.56101808, 0.64135154)),
        (66, (0.04198009, 0.08396019, 0.04198009), (1, -1.34263644, 0.51055681)),
    ],
)
def test_the_low_pass_has_the_documented_coefficients(
    rate: int, numerator: tuple[float, ...], denominator: tuple[float, ...]
) -> None:
    b, a = calibration.butterworth_coefficients(5.0, 1 / rate)
    np.testing.assert_allclose(b, numerator, atol=5e-9)
    np.testing.assert_allclose(a, denominator, atol=5e-9)
    np.testing.assert_allclose((b, a), signal.butter(2, 5.0, fs=rate), rtol=1e-12)


def test_the_low_pass_starts_settled_and_lags_a_ramp_by_45_ms() -> None:
    constant = np.tile([1.0, -2.0, -9.8], (100, 1))
    np.testing.assert_allclose(calibration.lowpass(constant, 5.0, 0.01), constant, rtol=1e-12)
    ramp = np.arange(1000)[:, None] * 0.004 * np.ones(3)
    lag = ramp[-1] - calibration.lowpass(ramp, 5.0, 0.004)[-1]
    np.testing.assert_allclose(lag, np.sqrt(2) / (2 * np.pi * 5.0), rtol=2e-3)


def test_the_low_pass_takes_a_batch_of_records() -> None:
    batch = np.random.default_rng(1).standard_normal((4, 50, 3))
    filtered = calibration.lowpass(batch, 5.0, 0.01)
    np.testing.assert_array_equal(filtered[2], calibration.lowpass(batch[2], 5.0, 0.01))


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 50.0, 80.0])
def test_a_corner_outside_the_nyquist_band_is_refused(cutoff: float) -> None:
    with pytest.raises(DesignError, match="50 Hz"):
        calibration.butterworth_coefficients(cutoff, 0.01)

"""What the front end of every estimator does to the samples, against the same thing done outside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ahrs_fmu import Record, Status, Strapdown, calibration, models, quaternion
from ahrs_fmu.errors import ParameterError
from every_estimator import ALL, make, noisy
from motion import GRAVITY, angle_between, at_rest, tumbling

BIAS = (0.02, -0.03, 0.01)


def smoothed(record: Record, cutoff: float, **parameters: object) -> np.ndarray:
    """What the low-pass lets through, from the motion acceleration of a level attitude left alone."""
    sample_time = float(record.time[1] - record.time[0])
    level = Strapdown(sample_time=sample_time, accel_cutoff=cutoff, initialisation="given", **parameters)
    return level.run(record).motion_accel - [0.0, 0.0, GRAVITY]


@pytest.mark.parametrize("rate", [50.0, 66.0, 100.0, 250.0, 1000.0])
def test_the_low_pass_is_butterworths_at_any_sample_rate(rate: float) -> None:
    record = at_rest(4.0, 1.0 / rate)
    shaken = record.accel + np.random.default_rng(2).normal(size=(len(record), 3)) * 3.0
    got = smoothed(replace(record, accel=shaken), 5.0)
    np.testing.assert_allclose(got, calibration.lowpass(shaken, 5.0, 1.0 / rate), atol=1e-12)


def test_a_sample_that_is_missing_starts_the_low_pass_anew() -> None:
    record = at_rest(2.0, 0.01)
    accel = record.accel + np.random.default_rng(2).normal(size=(len(record), 3))
    accel[100] = np.nan
    got = smoothed(replace(record, accel=accel), 5.0)
    np.testing.assert_allclose(got[101:], calibration.lowpass(accel[101:], 5.0, 0.01), atol=1e-12)


def test_the_low_pass_keeps_its_corner_when_the_step_changes() -> None:
    rng = np.random.default_rng(3)
    time = np.concatenate(([0.0], np.cumsum(rng.choice([0.002, 0.005, 0.01, 0.02], size=20_000))))
    rest = at_rest(1.0, 0.01)
    wave = np.sin(2 * np.pi * 2.0 * time)[:, None] * [1.0, 0.0, 0.0]
    n = len(time)
    record = replace(
        rest,
        time=time,
        gyro=np.zeros((n, 3)),
        accel=wave - np.array([0.0, 0.0, GRAVITY]),
        mag=np.tile(rest.mag[0], (n, 1)),
        accel_valid=np.ones(n, dtype=bool),
        mag_valid=np.ones(n, dtype=bool),
        q_true=None,
    )
    late = time > 5.0
    amplitude = np.std(smoothed(record, 2.0)[late, 0]) / np.std(wave[late, 0])
    assert amplitude == pytest.approx(np.sqrt(0.5), rel=0.02)


def test_a_corner_beyond_the_sample_rate_is_refused() -> None:
    with pytest.raises(ParameterError, match="accel_cutoff"):
        models.GCF(accel_cutoff=50.0)


@pytest.mark.parametrize("frame", ["ned", "enu"])
@pytest.mark.parametrize("name", ALL)
def test_a_calibrated_magnetometer_is_as_good_as_one_without_errors(name: str, frame: str) -> None:
    record = noisy(tumbling(5.0, 0.01))
    gain, offset = np.array([1.0, 0.8, 1.25]), np.array([2e-5, -1e-5, 3e-5])
    clean = make(name, frame=frame).run(record)
    spoiled = record.in_frame(clean.frame)
    spoiled = replace(spoiled, mag=spoiled.mag / gain + offset)
    result = make(name, frame=frame, mag_gain=tuple(gain), mag_offset=tuple(offset)).run(spoiled)
    assert np.max(angle_between(clean.q, result.q)) < 1e-9


def test_no_measurement_stays_none_under_a_calibration() -> None:
    record = at_rest(1.0, 0.01)
    silent = replace(record, mag=np.zeros((len(record), 3)))
    result = models.GCF(mag_offset=(1e-5, 0.0, 0.0)).run(silent)
    assert set(result.status) == {Status.MAG_UNUSED}


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("name", ALL)
def test_the_zero_of_the_gyroscope_is_the_mean_over_a_rest(name: str, precision: str) -> None:
    record = noisy(at_rest(60.0, 0.01, euler=(0.1, 0.2, 0.5), gyro_bias=BIAS))
    result = make(name, gyro_zero_samples=200, precision=precision).run(record)
    mean = np.mean(record.gyro[:200], axis=0)
    np.testing.assert_allclose(result.gyro_bias[199], mean, atol=1e-9 if precision == "double" else 1e-7)
    np.testing.assert_allclose(result.rate[199], record.gyro[199] - mean, atol=1e-6)
    np.testing.assert_allclose(result.gyro_bias[-1], BIAS, atol=0.002)
    assert np.max(np.abs(result.rate[200:] + result.gyro_bias[200:] - record.gyro[200:])) < 1e-6
    assert angle_between(record.q_true[-1:], result.q[-1:])[0] < 0.1


def test_a_zero_that_is_found_replaces_the_bias_that_was_learned_meanwhile() -> None:
    record = at_rest(60.0, 0.01, gyro_bias=BIAS)
    result = models.GCF(gyro_zero_samples=400).run(record)
    assert np.linalg.norm(result.gyro_bias[398]) > 1e-3
    np.testing.assert_allclose(result.gyro_bias[399], BIAS, atol=1e-12)
    np.testing.assert_allclose(result.gyro_bias[-1], BIAS, atol=2e-3)


@pytest.mark.parametrize("motion", ["shaking", "turning", "pushed"])
def test_what_is_no_rest_is_not_averaged_and_the_next_rest_is(motion: str) -> None:
    record = at_rest(10.0, 0.01, gyro_bias=BIAS)
    moving = record.time < 4.0
    gyro, accel = record.gyro.copy(), record.accel.copy()
    if motion == "shaking":
        gyro[moving] += 0.1 * np.sin(30.0 * record.time[moving, None])
    elif motion == "turning":
        gyro[moving] += [0.0, 0.0, 0.5]
    else:
        accel[moving] += [0.0, 0.0, -0.5]
    still = models.Strapdown(gyro_zero_samples=200).run(replace(record, gyro=gyro, accel=accel))
    assert np.all(still.gyro_bias[:399] == 0.0)
    np.testing.assert_allclose(still.gyro_bias[-1], BIAS, atol=1e-12)


def test_a_rest_is_counted_over_usable_samples_only() -> None:
    record = at_rest(5.0, 0.01, gyro_bias=BIAS)
    gyro = record.gyro.copy()
    gyro[50:80] = np.nan
    result = models.Strapdown(gyro_zero_samples=200).run(replace(record, gyro=gyro))
    assert np.all(result.gyro_bias[228] == 0.0)
    np.testing.assert_allclose(result.gyro_bias[229], BIAS, atol=1e-12)


def test_zeroing_keeps_the_attitude_where_it_is() -> None:
    record = at_rest(3.0, 0.01, euler=(0.3, -0.2, 1.0), gyro_bias=BIAS)
    start = tuple(quaternion.multiply(record.q_true[0], quaternion.exp([0.0, 0.0, 0.2])))
    level = Strapdown(gyro_zero_samples=100, initialisation="given", q0=start)
    result = level.run(replace(record, gyro=record.gyro * 0.0))
    assert np.max(angle_between(np.tile(start, (len(record), 1)), result.q)) < 1e-12

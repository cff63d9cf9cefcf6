"""What holds for every estimator, whatever its equations (docs/algorithms.md section 0)."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from ahrs_fmu import EstimateResult, Frame, Record, Status, frames, quaternion
from every_estimator import (
    ALL,
    BY_POINTS,
    CORRECTING,
    LEARNING_BIAS,
    PRECISIONS,
    WITH_COVARIANCE,
    make,
    noisy,
)
from motion import angle_between, at_rest, recording
from motion import tumbling as tumble

DEG = math.pi / 180.0
tumbling = functools.cache(tumble)


def everything(result: EstimateResult) -> np.ndarray:
    columns = [result.q, result.euler, result.rate, result.gyro_bias, result.motion_accel]
    return np.column_stack(columns + ([result.attitude_std] if result.attitude_std is not None else []))


def error(record: Record, result: EstimateResult) -> np.ndarray:
    return angle_between(record.q_true, result.q)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", ALL)
def test_ideal_sensors_through_all_attitudes_leave_no_error(name: str, precision: str) -> None:
    record = tumbling(60.0, 0.01, rate=0.5)
    result = make(name, precision=precision).run(record)
    assert np.max(error(record, result)) < (1e-3 if name in BY_POINTS else 5e-5)
    assert set(result.status) <= {Status.NOMINAL} or name == "strapdown"


@pytest.mark.parametrize("name", CORRECTING)
def test_an_initial_error_is_corrected(name: str) -> None:
    record = at_rest(30.0, 0.01, euler=(0.3, -0.4, 2.0))
    start = quaternion.multiply(record.q_true[0], quaternion.exp([0.1, -0.15, 0.2]))
    options: dict[str, object] = {"field_reference": "given", "field_dip": math.asin(0.6)}
    if name in ("gcf", "mahony", "mahony_ekf"):
        options["ki"] = 0.0
    result = make(name, initialisation="given", q0=tuple(start), **options).run(record)
    assert error(record, result)[0] == pytest.approx(np.linalg.norm([0.1, -0.15, 0.2]), rel=1e-3)
    assert error(record, result)[-1] < 0.002


@pytest.mark.parametrize("name", LEARNING_BIAS)
def test_a_constant_bias_is_learned_and_leaves_no_error(name: str) -> None:
    bias = (0.01, -0.02, 0.015)
    record = at_rest(120.0, 0.01, euler=(0.3, -0.4, 2.0), gyro_bias=bias)
    result = make(name).run(record)
    np.testing.assert_allclose(result.gyro_bias[-1], bias, atol=3e-5)
    assert error(record, result)[-1] < 1e-4


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -1e300])
@pytest.mark.parametrize("name", ALL)
def test_a_burst_of_nonsense_from_each_sensor_is_forgotten(name: str, value: float, precision: str) -> None:
    record = at_rest(6.0, 0.01, euler=(0.3, 0.2, -2.0))
    spoiled = {}
    for sensor, rows in (("gyro", slice(100, 150)), ("accel", slice(200, 260)), ("mag", slice(300, 400))):
        spoiled[sensor] = getattr(record, sensor).copy()
        spoiled[sensor][rows, 1] = value
    result = make(name, precision=precision).run(replace(record, **spoiled))
    assert np.all(np.isfinite(everything(result)))
    exact = precision == "double" and name not in BY_POINTS
    assert np.max(error(record, result)) < (1e-6 if exact else 1e-3)
    assert set(result.status[100:150]) == {Status.GYRO_HELD}
    assert not np.any(result.accel_used[200:260])
    assert not np.any(result.mag_used[300:400])
    assert not np.any(result.covariance_reset)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", CORRECTING)
def test_a_burst_in_motion_is_recovered_from_as_fast_as_from_any_error(name: str, precision: str) -> None:
    record = noisy(tumbling(40.0, 0.01, rate=0.7))
    gyro = record.gyro.copy()
    gyro[1000:1050] = np.nan
    result = make(name, precision=precision).run(replace(record, gyro=gyro))
    undisturbed = make(name, precision=precision).run(record)
    assert np.all(np.isfinite(everything(result)))
    assert not np.any(result.covariance_reset)
    assert np.max(error(record, result)[1000:1100]) > 3.0 * np.max(error(record, undisturbed)[1000:1100])
    # The slowest, GCF and complementary, have a time constant of 2 s.
    assert np.mean(error(record, result)[2500:]) < np.mean(error(record, undisturbed)[2500:]) + 0.5 * DEG


@pytest.mark.parametrize("name", ALL)
def test_no_specific_force_predicts_only(name: str) -> None:
    record = at_rest(5.0, 0.01, gyro_bias=(0.01, 0.0, 0.0))
    fall = replace(record, accel=record.accel * 0.05, mag=np.full((len(record), 3), np.nan))
    result = make(name, initialisation="given").run(fall)
    assert np.all(np.isfinite(everything(result)))
    assert result.roll[-1] == pytest.approx(0.05, rel=0.02 if name in BY_POINTS else 1e-5)
    assert not np.any(result.accel_used[1:])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", CORRECTING)
def test_a_field_along_gravity_leaves_the_heading_alone_and_tilt_corrected(name: str, precision: str) -> None:
    record = at_rest(20.0, 0.01)
    parallel = replace(record, mag=np.tile([0.0, 0.0, 5e-5], (len(record), 1)))
    start = tuple(quaternion.exp([5 * DEG, 0.0, 0.0]))
    options = {"ki": 0.0} if name in ("gcf", "mahony", "mahony_ekf") else {}
    result = make(name, initialisation="given", q0=start, precision=precision, **options).run(parallel)
    assert np.all(np.isfinite(everything(result)))
    assert not np.any(result.mag_used)
    assert abs(result.roll[-1]) < 0.1 * DEG
    assert abs(result.yaw[-1]) < 1e-3


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", CORRECTING)
def test_steps_of_any_length_are_taken_as_they_are(name: str, precision: str) -> None:
    rng = np.random.default_rng(4)
    dt = rng.choice([0.002, 0.01, 0.02, 0.1, 0.4, 2.0], size=800, p=[0.3, 0.3, 0.2, 0.1, 0.05, 0.05])
    time = np.concatenate(([0.0], np.cumsum(dt)))
    turn = np.array([0.05, -0.03, 0.1])
    q = quaternion.exp(time[:, None] * turn)
    record = replace(recording(q, 1.0), time=time, gyro=np.tile(turn, (len(time), 1)))
    result = make(name, precision=precision).run(record)
    assert np.all(np.isfinite(everything(result)))
    assert not np.any(result.covariance_reset)
    # A step of 2 s turns by 0.23 rad, where the linear prediction of some filters is wrong by 0.5 mrad.
    assert np.max(error(record, result)) < (1e-2 if name in BY_POINTS else 2e-3)
    assert np.all(~result.accel_used[1:][dt > 0.5])


@pytest.mark.parametrize("name", ALL)
def test_a_turn_of_720_degrees_has_no_jump_of_sign(name: str) -> None:
    yaw = np.linspace(0.0, 4 * np.pi, 2001)
    q = quaternion.from_euler(np.stack((0 * yaw, 0 * yaw, yaw), axis=-1))
    record = recording(q, 0.01)
    result = make(name).run(record)
    assert np.max(error(record, result)) < (1e-3 if name in BY_POINTS else 1e-5)
    assert np.all(np.sum(result.q[1:] * result.q[:-1], axis=1) > 0.0)


@pytest.mark.parametrize("name", ALL)
def test_frames_and_declination_describe_the_same_attitude(name: str) -> None:
    record = noisy(tumbling(10.0, 0.01))
    ned = make(name).run(record)
    enu = make(name, frame="enu").run(record)
    assert np.max(angle_between(frames.attitude(ned.q, Frame.NED, Frame.ENU), enu.q)) < 1e-10
    np.testing.assert_allclose(enu.gyro_bias, ned.gyro_bias * [1, -1, -1], atol=1e-12)
    turned = make(name, declination=0.1).run(record)
    expected = quaternion.multiply(quaternion.exp([0.0, 0.0, 0.1]), ned.q)
    assert np.max(angle_between(expected, turned.q)) < 1e-12


@pytest.mark.parametrize("name", ALL)
def test_a_magnetometer_that_appears_later_aligns_the_heading_at_once(name: str) -> None:
    record = at_rest(4.0, 0.01, euler=(0.1, 0.2, 1.0))
    mag = record.mag.copy()
    mag[:200] = np.nan
    result = make(name).run(replace(record, mag=mag))
    assert result.yaw[199] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(result.yaw[200:], 1.0, atol=2e-3 if name in BY_POINTS else 1e-6)


@pytest.mark.parametrize("name", ALL)
def test_saving_and_restoring_continues_to_the_bit(name: str) -> None:
    record = noisy(tumbling(2.0, 0.01))
    rows = list(zip(record.gyro, record.accel, record.mag, strict=True))
    first = make(name)
    for row in rows[:100]:
        first.update(*row)
    saved = first.save()
    once = [first.update(*row).q for row in rows[100:]]
    other = make(name)
    other.restore(saved)
    np.testing.assert_array_equal(once, [other.update(*row).q for row in rows[100:]])


@pytest.mark.parametrize("name", WITH_COVARIANCE)
def test_the_covariance_is_given_out_and_grows_while_nothing_measures(name: str) -> None:
    record = noisy(at_rest(30.0, 0.01))
    blind = replace(record, accel_valid=record.time < 20.0, mag_valid=record.time < 20.0)
    result = make(name).run(blind)
    assert result.attitude_std is not None
    assert np.all(result.attitude_std > 0.0)
    assert np.all(result.attitude_std[0] >= result.attitude_std[1999])
    if name != "mahony_ekf":  # its measurement, the Mahony filter, is always there
        assert np.all(result.attitude_std[-1] > 1.2 * result.attitude_std[1999])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", WITH_COVARIANCE)
def test_an_hour_without_magnetometer_does_not_lose_the_covariance(name: str, precision: str) -> None:
    record = noisy(at_rest(3600.0, 0.1))
    mag = record.mag.copy()
    mag[100:-300] = np.nan
    result = make(name, sample_time=0.1, precision=precision).run(replace(record, mag=mag))
    assert np.all(np.isfinite(everything(result)))
    assert not np.any(result.covariance_reset)
    assert np.max(np.abs(result.euler[:, :2])) < 5 * DEG
    assert np.max(error(record, result)[-20:]) < 5 * DEG


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", CORRECTING)
@pytest.mark.parametrize("seed", range(3))
def test_random_sensors_never_lead_out_of_the_numbers(name: str, seed: int, precision: str) -> None:
    rng = np.random.default_rng(seed)
    n = 2000
    scale = 10.0 ** rng.uniform(-3, 3, size=(3, n, 1))
    draw = rng.normal(size=(3, n, 3)) * scale
    draw[:, rng.random(n) < 0.05] = 0.0
    draw[rng.random((3, n)) < 0.05] = np.nan
    record = Record(
        time=np.cumsum(10.0 ** rng.uniform(-4, 0.5, n)),
        gyro=draw[0],
        accel=draw[1] * 10.0,
        mag=draw[2] * 5e-5,
    )
    result = make(name, precision=precision).run(record)
    assert np.all(np.isfinite(everything(result)))
    np.testing.assert_allclose(np.linalg.norm(result.q, axis=1), 1.0, atol=1e-5)


@pytest.mark.parametrize("name", CORRECTING)
def test_motion_compensation_works_around_any_filter(name: str) -> None:
    time = np.arange(3001) * 0.01
    push = np.where((time > 20.0) & (time < 20.5), 3.0, 0.0)[:, None] * [1.0, 0.0, 0.0]
    record = noisy(recording(np.tile([1.0, 0.0, 0.0, 0.0], (3001, 1)), 0.01, acceleration=push))
    plain = np.max(np.abs(make(name).run(record).pitch[2000:]))
    compensated = make(name, motion_compensation=True, motion_time_constant=5.0).run(record)
    assert np.max(np.abs(compensated.pitch[2000:])) < max(0.5 * plain, 0.3 * DEG)
    assert compensated.motion_accel[2040, 0] == pytest.approx(3.0, abs=0.3)


@pytest.mark.parametrize("name", CORRECTING)
def test_a_specific_force_that_compensation_turns_along_the_field_is_survived(name: str) -> None:
    record = at_rest(1.0, 0.01)
    accel = record.accel.copy()
    accel[50] = 2 * record.accel[50]  # compensated by what came before: along gravity still
    mag = record.mag.copy()
    mag[50] = [1e-5, 0.0, 4.9e-5]
    result = make(name, motion_compensation=True).run(replace(record, accel=accel, mag=mag))
    assert np.all(np.isfinite(everything(result)))

"""The Kalman-calibrated complementary filter (docs/accuracy.md) on motion whose errors are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ahrs_fmu import KCF, Frame, Record, descriptors, quaternion
from ahrs_fmu.estimate import Status
from ahrs_fmu.native import NativeModel
from motion import FIELD, angle_between, at_rest, recording, tumbling

DEG = np.pi / 180.0
MICRO = 1e-6
RATE = 100.0
"""Hz of every recording here."""

IRON = np.array([4.0, -3.0, 2.0]) * MICRO
BIAS = np.array([0.4, -0.3, 0.5]) * DEG
LATENCY = 0.012
SCALE = np.array([[0.006, 0.003, -0.002], [-0.002, -0.005, 0.003], [0.002, -0.003, 0.004]])


def filter_(**options: object) -> KCF:
    """A filter for the recordings here."""
    return KCF(sample_time=1.0 / RATE, **options)


def noisy(record: Record, seed: int = 1) -> Record:
    """White noise as of a good consumer sensor on every axis."""
    noise = np.random.default_rng(seed).standard_normal((3, len(record), 3))
    return replace(
        record,
        gyro=record.gyro + 0.05 * DEG * noise[0],
        accel=record.accel + 0.03 * noise[1],
        mag=record.mag + 0.2 * MICRO * noise[2],
    )


@pytest.fixture(scope="module")
def turning() -> Record:
    """Two minutes of arbitrary, quick rotation after three seconds of rest, with slight noise."""
    motion = tumbling(120.0, 1.0 / RATE, rate=2.5)
    rest = np.tile(motion.q_true[:1], (300, 1))
    return noisy(recording(np.vstack((rest, motion.q_true)), 1.0 / RATE))


def spoilt(record: Record) -> Record:
    """The same motion seen by a sensor with every error that the filter learns."""
    # The rate that reads as `gyro`: gyro = rate + bias + SCALE gyro.
    gyro = np.linalg.solve(np.eye(3) - SCALE, (record.gyro + BIAS).T).T
    late = np.clip(record.time - LATENCY, 0.0, None)
    mag = np.stack([np.interp(late, record.time, axis) for axis in record.mag.T], axis=-1)
    return replace(record, gyro=gyro, mag=mag + IRON)


@pytest.fixture(scope="module")
def imperfect(turning: Record) -> Record:
    return spoilt(turning)


def spinning(seconds: float, rate: float) -> Record:
    """Turns of many revolutions about axes that wander through the body."""
    time = np.arange(round(seconds * RATE) + 1) / RATE
    waves = [np.sin(2 * np.pi * f * time + phase) for f, phase in ((0.03, 0.0), (0.05, 1.0), (0.07, 2.0))]
    omega = np.stack(waves, axis=-1)
    steps = quaternion.exp(rate / RATE * omega / np.linalg.norm(omega, axis=-1, keepdims=True))
    q = np.empty((len(time), 4))
    q[0] = quaternion.IDENTITY
    for k in range(1, len(time)):
        q[k] = quaternion.normalise(quaternion.multiply(q[k - 1], steps[k]))
    return noisy(recording(q, 1.0 / RATE))


def heading_and_tilt(record: Record, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors (N,) about the vertical and of the tilt, rad."""
    d = quaternion.multiply(q, quaternion.conjugate(record.q_true))
    return 2 * np.arctan2(np.abs(d[:, 3]), np.abs(d[:, 0])), 2 * np.arcsin(np.hypot(d[:, 1], d[:, 2]))


# ---- what it learns ----


def test_every_error_of_the_sensors_is_learned() -> None:
    imperfect = spoilt(spinning(240.0, rate=4.0))
    result = filter_().run(imperfect)
    learned = {name: values[-1] for name, values in result.others.items()}
    np.testing.assert_allclose(result.gyro_bias[-1], BIAS, atol=0.03 * DEG)
    np.testing.assert_allclose(learned["hard_iron"], IRON, atol=0.3 * MICRO)
    # A rotation of the gyroscope's axes against the others moves the estimate by a fixed angle only and makes
    # no drift to learn from: the symmetric part is what can be seen.
    scale = learned["gyro_scale"].reshape(3, 3)
    np.testing.assert_allclose(0.5 * (scale + scale.T), 0.5 * (SCALE + SCALE.T), atol=1.5e-3)
    assert np.all(np.diag(scale) / np.diag(SCALE) > 0.6)
    assert learned["mag_latency"] == pytest.approx(LATENCY, abs=1e-3)
    np.testing.assert_allclose(learned["local_field"], FIELD[[0, 2]], atol=1.0 * MICRO)
    heading, tilt = heading_and_tilt(imperfect, result.q)
    assert heading[-3000:].max() < 0.8 * DEG
    assert tilt[-3000:].max() < 0.8 * DEG


def test_the_learned_errors_are_told_in_the_axes_of_the_user(imperfect: Record) -> None:
    ned, enu = filter_().run(imperfect), filter_(frame="enu").run(imperfect.in_frame(Frame.ENU))
    flip = np.array([1.0, -1.0, -1.0])
    np.testing.assert_allclose(enu.others["hard_iron"], flip * ned.others["hard_iron"], atol=1e-15)
    np.testing.assert_allclose(
        enu.others["gyro_scale"][-1].reshape(3, 3),
        flip[:, None] * ned.others["gyro_scale"][-1].reshape(3, 3) * flip,
        atol=1e-12,
    )
    np.testing.assert_allclose(enu.rate, flip * ned.rate, atol=1e-12)


def test_the_first_sample_already_gives_an_attitude() -> None:
    record = at_rest(1.0, 1.0 / RATE, euler=(0.3, -0.4, 1.2))
    assert angle_between(record.q_true[:1], filter_().run(record).q[:1])[0] < 1e-9


@pytest.mark.parametrize("at", [2.5, 40.0])
def test_rest_shows_the_bias(at: float) -> None:
    bias = np.array([0.8, -0.6, 0.7]) * DEG
    record = at_rest(60.0, 1.0 / RATE, gyro_bias=bias)
    result = filter_().run(record)
    k = int(at * RATE)
    assert result.others["at_rest"][k]
    # Learning begins after 1.5 s of rest; its steady noise is far below the prior of 1 deg/s.
    np.testing.assert_allclose(result.gyro_bias[k], bias, atol=0.1 * DEG if at < 5.0 else 0.001 * DEG)


# ---- the uncalibrated magnetometer ----


def test_an_uncalibrated_magnetometer_is_recognised(turning: Record) -> None:
    iron = np.array([12.0, -9.0, 6.0]) * MICRO
    result = filter_(uncalibrated_odds=1.0).run(replace(turning, mag=turning.mag + iron))
    assert result.others["uncalibrated"][10 * int(RATE)] > 0.9 or result.others["uncalibrated"][-1] == 0.0
    np.testing.assert_allclose(result.others["hard_iron"][-1], iron, atol=0.5 * MICRO)
    believing = filter_(uncalibrated_odds=0.0).run(replace(turning, mag=turning.mag + iron))
    early = slice(4 * int(RATE), 20 * int(RATE))
    with_question, _ = heading_and_tilt(turning, result.q)
    without, _ = heading_and_tilt(turning, believing.q)
    assert np.mean(with_question[early]) < 0.7 * np.mean(without[early])


def test_without_odds_the_question_is_never_asked(turning: Record) -> None:
    assert not filter_(uncalibrated_odds=0.0).run(turning).others["uncalibrated"].any()


# ---- rates, gaps and missing sensors ----


def test_six_axes_ignore_the_magnetometer(turning: Record) -> None:
    shaken = replace(turning, mag=turning.mag[::-1])
    options = {"use_mag": False, "initialisation": "given", "q0": tuple(turning.q_true[0])}
    np.testing.assert_array_equal(filter_(**options).run(turning).q, filter_(**options).run(shaken).q)
    heading, tilt = heading_and_tilt(turning, filter_(**options).run(turning).q)
    assert heading.max() < 4.0 * DEG
    assert tilt.max() < 2.0 * DEG


@pytest.mark.parametrize("every", [3, 10, 50])
def test_the_magnetometer_may_come_more_rarely(imperfect: Record, every: int) -> None:
    valid = np.arange(len(imperfect)) % every == 0
    result = filter_().run(replace(imperfect, mag_valid=valid))
    heading, _ = heading_and_tilt(imperfect, result.q)
    assert heading[-3000:].max() < 1.2 * DEG


def test_irregular_sample_times_do_not_matter(imperfect: Record) -> None:
    keep = np.sort(np.random.default_rng(2).permutation(len(imperfect))[: int(0.7 * len(imperfect))])
    turn = quaternion.log(
        quaternion.multiply(quaternion.conjugate(imperfect.q_true[keep[:-1]]), imperfect.q_true[keep[1:]])
    )
    steps = np.diff(imperfect.time[keep])
    gyro = np.vstack((np.zeros(3), turn / steps[:, None])) + BIAS
    record = replace(
        imperfect,
        time=imperfect.time[keep],
        gyro=gyro,
        accel=imperfect.accel[keep],
        mag=imperfect.mag[keep],
        accel_valid=imperfect.accel_valid[keep],
        mag_valid=imperfect.mag_valid[keep],
        q_true=imperfect.q_true[keep],
    )
    heading, tilt = heading_and_tilt(record, filter_().run(record).q)
    assert heading[-2000:].max() < 1.0 * DEG
    assert tilt[-2000:].max() < 0.8 * DEG


def test_momentary_rates_at_a_low_rate_need_the_trapezoid() -> None:
    motion = tumbling(60.0, 1.0 / 400.0, rate=3.0)
    slow = slice(None, None, 10)
    record = recording(motion.q_true[slow], 1.0 / 40.0)
    momentary = replace(record, gyro=motion.gyro[slow])
    errors = [
        np.sqrt(
            np.mean(
                heading_and_tilt(record, KCF(sample_time=1 / 40, gyro_sampling=kind).run(momentary).q)[1] ** 2
            )
        )
        for kind in ("mean", "instant")
    ]
    assert errors[1] < 0.25 * errors[0]


def test_a_long_gap_is_bridged_and_north_is_found_again(turning: Record) -> None:
    # Two seconds of arbitrary rotation are missing.
    keep = np.r_[0:6000, 6200 : len(turning)]
    record = replace(
        turning,
        time=turning.time[keep],
        gyro=turning.gyro[keep],
        accel=turning.accel[keep],
        mag=turning.mag[keep],
        accel_valid=turning.accel_valid[keep],
        mag_valid=turning.mag_valid[keep],
        q_true=turning.q_true[keep],
    )
    heading, tilt = heading_and_tilt(record, filter_().run(record).q)
    assert heading[8000:].max() < 1.0 * DEG
    assert tilt[8000:].max() < 1.0 * DEG


@pytest.mark.parametrize("precision", ["double", "single"])
def test_senseless_samples_leave_nothing_behind(turning: Record, precision: str) -> None:
    draw = np.random.default_rng(4)
    sensors = {name: np.array(getattr(turning, name)) for name in ("gyro", "accel", "mag")}
    for samples in sensors.values():
        for start in draw.integers(400, 6000, 12):
            samples[start : start + draw.integers(1, 12)] = draw.choice(
                [np.nan, np.inf, -np.inf, 1e30, -1e12]
            )
    result = filter_(precision=precision).run(replace(turning, **sensors))
    for values in (result.q, result.rate, result.gyro_bias, *result.others.values()):
        assert np.isfinite(values).all()
    heading, tilt = heading_and_tilt(turning, result.q)
    assert heading[-3000:].max() < 1.0 * DEG
    assert tilt[-3000:].max() < 0.6 * DEG


def test_what_a_held_rate_has_missed_is_made_good(turning: Record) -> None:
    gyro = np.array(turning.gyro)
    gyro[3000:3015] = np.nan
    clean, held = filter_().run(turning), filter_().run(replace(turning, gyro=gyro))
    apart = angle_between(clean.q, held.q)
    assert apart[3014] > 1.0 * DEG
    # What is left is the curvature of the rate, here some rad/s3.
    assert apart[3015:3500].max() < 0.3 * apart[3014]


def test_a_fall_without_weight_does_not_end_the_learning(imperfect: Record) -> None:
    valid = np.ones(len(imperfect), dtype=np.bool_)
    valid[5000:6000] = False
    heading, tilt = heading_and_tilt(imperfect, filter_().run(replace(imperfect, accel_valid=valid)).q)
    assert tilt[5000:].max() < 1.0 * DEG
    assert heading[-3000:].max() < 0.8 * DEG


# ---- what it reports ----


@pytest.mark.parametrize("sensor", ["gyro", "mag"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_swapped_sign_is_implausible(turning: Record, sensor: str, axis: int) -> None:
    swapped = np.array(getattr(turning, sensor))
    swapped[:, axis] *= -1.0
    assert not filter_().run(turning).others["implausible"].any()
    result = filter_().run(replace(turning, **{sensor: swapped}))
    assert result.others["implausible"][-6000:].mean() > 0.9
    assert (result.status == Status.IMPLAUSIBLE).any()


def test_a_magnet_that_is_put_on_is_told_and_then_learned(turning: Record) -> None:
    iron = np.where(np.arange(len(turning))[:, None] < 6000, 0.0, [10e-6, 10e-6, -5e-6])
    result = filter_().run(replace(turning, mag=turning.mag + iron))
    told = result.others["mag_disturbed"].astype(np.bool_)
    assert not told[2000:6000].any()
    assert told[6000:6200].any()
    assert not told[-2000:].any()
    np.testing.assert_allclose(result.others["hard_iron"][-1], iron[-1], atol=1.0 * MICRO)


def test_north_is_kept_through_a_change_of_the_field_in_the_room(turning: Record) -> None:
    extra = np.zeros((len(turning), 3))
    extra[4000:9000] = [15e-6, 10e-6, 5e-6]
    disturbed = replace(
        turning, mag=turning.mag + quaternion.rotate(quaternion.conjugate(turning.q_true), extra)
    )
    result = filter_().run(disturbed)
    told = result.others["mag_disturbed"].astype(np.bool_)
    assert not told[1000:4000].any()
    assert told[5000:9000].all()
    assert not told[-1000:].any()
    heading, _ = heading_and_tilt(turning, result.q)
    # The field turns by 25 deg; the gyroscope keeps north, and the old field is recognised when it is back.
    assert heading[5000:9000].max() < 6.0 * DEG
    assert heading[-1000:].max() < 2.0 * DEG
    naive, _ = heading_and_tilt(turning, filter_(refine=False).run(disturbed).q)
    assert naive[5000:9000].max() > 2.0 * heading[5000:9000].max()


def test_the_heading_is_as_certain_as_it_is_said_to_be(imperfect: Record) -> None:
    result = filter_().run(imperfect)
    heading, _ = heading_and_tilt(imperfect, result.q)
    told = result.others["heading_std"][:, None].ravel()
    assert np.all(heading[3000:] < 4.0 * told[3000:] + 0.2 * DEG)
    assert told[-1] < told[100]


# ---- its variants ----


def test_a_profile_is_a_time_constant(turning: Record) -> None:
    for profile, seconds in (("hand", 3.5), ("multirotor", 10.0)):
        named = filter_(profile=profile).run(turning)
        custom = filter_(profile="custom", accel_time_constant=seconds).run(turning)
        np.testing.assert_array_equal(named.q, custom.q)
    assert np.abs(filter_().run(turning).q - filter_(profile="multirotor").run(turning).q).max() > 1e-6


def test_spreading_the_slow_step_changes_the_results_little(imperfect: Record) -> None:
    at_once, spread = filter_().run(imperfect), filter_(spread=True).run(imperfect)
    difference = angle_between(at_once.q, spread.q)
    assert 0.0 < difference[2000:].max() < 0.2 * DEG
    np.testing.assert_allclose(spread.others["hard_iron"][-1], IRON, atol=0.3 * MICRO)


def test_single_precision_is_as_good_as_double(imperfect: Record) -> None:
    double, single = filter_().run(imperfect), filter_(precision="single").run(imperfect)
    assert angle_between(double.q, single.q).max() < 0.01 * DEG


def test_the_state_in_single_precision_is_small() -> None:
    assert NativeModel(descriptors.load("kcf"), "single").state_size < 3000

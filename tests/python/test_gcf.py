"""The generalized complementary filter against theory (docs/algorithms.md section 5)."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import ahrs_fmu
from ahrs_fmu import Frame, descriptors, frames, quaternion
from ahrs_fmu.native import NativeModel
from motion import GRAVITY, angle_between, at_rest, recording, tumbling

REALISATIONS = ("quaternion", "vector", "dcm", "euler")
DEG = math.pi / 180.0


def started_off(axis: int, angle: float) -> tuple[float, ...]:
    """The attitude that is `angle` (rad) away from level north about a body axis."""
    return tuple(quaternion.exp(angle * np.eye(3)[axis]))


def error_about(axis: int, record: ahrs_fmu.Record, estimator: ahrs_fmu.Estimator) -> np.ndarray:
    """Error about a body axis (N,), rad; a tilt error shows in the heading as well, which this leaves out."""
    result = estimator.run(record)
    return quaternion.log(quaternion.multiply(quaternion.conjugate(record.q_true), result.q))[:, axis]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("form", ["direct", "attitude"])
def test_an_initial_error_decays_with_the_proportional_gain_on_every_axis(axis: int, form: str) -> None:
    record = at_rest(10.0, 0.01)
    gcf = ahrs_fmu.GCF(kp=0.5, ki=0.0, form=form, initialisation="given", q0=started_off(axis, 5 * DEG))
    error = error_about(axis, record, gcf)
    theory = 5 * DEG * (1 - 0.5 * 0.01) ** np.arange(len(record))
    np.testing.assert_allclose(error, theory, rtol=5e-3)
    assert error[-1] / DEG == pytest.approx(0.033, abs=0.001)


@pytest.mark.parametrize(("axis", "gain"), [("weak", 0.401), ("cross", 2.02), ("strong", 1.61)])
def test_the_coupled_error_has_the_loop_gain_of_the_two_vectors(axis: str, gain: float) -> None:
    g, h = np.array([0.0, 0.0, 1.0]), np.array([0.8, 0.0, 0.6])
    values, vectors = np.linalg.eigh(2 * np.eye(3) - np.outer(g, g) - np.outer(h, h))
    direction = vectors[:, ["weak", "strong", "cross"].index(axis)]
    record = at_rest(2.0, 0.01)
    start = tuple(quaternion.exp(1 * DEG * direction))
    gcf = ahrs_fmu.GCF(
        kp=0.5,
        ki=0.0,
        error="coupled",
        initialisation="given",
        q0=start,
        field_reference="given",
        field_dip=math.asin(0.6),
    )
    error = angle_between(record.q_true, gcf.run(record).q)
    decay = -math.log(error[-1] / error[0]) / 2.0 / 0.5
    assert decay == pytest.approx(gain, rel=0.01)
    assert decay == pytest.approx(values[["weak", "strong", "cross"].index(axis)], rel=0.015)


def test_a_constant_gyro_bias_leaves_its_error_in_the_first_order_and_none_in_the_second() -> None:
    record = at_rest(60.0, 0.02, gyro_bias=(0.1 * DEG, 0.0, 0.0))
    first = error_about(0, record, ahrs_fmu.GCF(sample_time=0.02, kp=0.58, ki=0.0))
    second = ahrs_fmu.GCF(sample_time=0.02, kp=0.58, ki=0.1).run(record)
    assert first[-1] / DEG == pytest.approx(0.1 * (1 - 0.58 * 0.02) / 0.58, abs=1e-5)
    assert angle_between(record.q_true, second.q)[-1] < 1e-6
    np.testing.assert_allclose(second.gyro_bias[-1], [0.1 * DEG, 0, 0], atol=1e-6)


@pytest.mark.parametrize(("kii", "error"), [(0.0, 0.0327), (0.05, 0.0)])
def test_only_the_third_order_removes_the_error_of_a_bias_ramp(kii: float, error: float) -> None:
    ramp = 0.01 * DEG * np.arange(200 * 50 + 1)[:, None] * 0.02 * [1.0, 0.0, 0.0]
    record = at_rest(200.0, 0.02, gyro_bias=ramp)
    gcf = ahrs_fmu.GCF(sample_time=0.02, kp=1.0, ki=0.3, kii=kii, bias_limit=1.0)
    assert error_about(0, record, gcf)[-1] / DEG == pytest.approx(error, abs=2e-4)


def test_full_motion_compensation_no_longer_observes_tilt() -> None:
    gcf = ahrs_fmu.GCF(
        sample_time=0.02,
        motion_compensation=True,
        motion_time_constant=math.inf,
        initialisation="given",
        q0=started_off(1, 5 * DEG),
        ki=0.0,
    )
    assert error_about(1, at_rest(300.0, 0.02), gcf)[-1] / DEG == pytest.approx(5.0, abs=0.0005)


def test_leaky_motion_compensation_observes_tilt_slowly() -> None:
    leak = -0.02 / math.log(0.98)
    gcf = ahrs_fmu.GCF(
        sample_time=0.02,
        motion_compensation=True,
        motion_time_constant=leak,
        initialisation="given",
        q0=started_off(1, 5 * DEG),
        ki=0.0,
    )
    assert error_about(1, at_rest(60.0, 0.02), gcf)[-1] / DEG == pytest.approx(2.745, abs=0.002)


@pytest.mark.parametrize("options", [{}, {"error": "coupled"}, {"kii": 0.01, "motion_compensation": True}])
def test_all_realisations_give_the_same_attitude(options: dict[str, object]) -> None:
    record = tumbling(60.0, 0.01)
    noise = np.random.default_rng(3).normal(size=(3, len(record), 3))
    noisy = replace(
        record,
        gyro=record.gyro + 0.01 * noise[0],
        accel=record.accel + 0.3 * noise[1],
        mag=record.mag + 1e-6 * noise[2],
    )
    away = np.abs(quaternion.to_euler(record.q_true)[:, 1]) < 80 * DEG
    results = [ahrs_fmu.GCF(realisation=name, **options).run(noisy) for name in REALISATIONS]
    for one, other in itertools.pairwise(results):
        assert np.max(angle_between(one.q, other.q)[away]) < 1e-6


def test_both_forms_settle_at_the_same_attitude_and_bias() -> None:
    record = at_rest(150.0, 0.01, euler=(0.4, -0.3, 2.0), gyro_bias=(0.002, -0.001, 0.003))
    direct, attitude = (ahrs_fmu.GCF(form=form).run(record) for form in ("direct", "attitude"))
    assert angle_between(direct.q[-1:], attitude.q[-1:])[0] < 1e-9
    np.testing.assert_allclose(direct.gyro_bias[-1], attitude.gyro_bias[-1], atol=1e-9)


@pytest.mark.parametrize("form", ["direct", "attitude"])
def test_without_magnetometer_tilt_is_right_and_yaw_integrates_the_corrected_rate(form: str) -> None:
    record = at_rest(60.0, 0.01, gyro_bias=(0.01, -0.02, 0.005))
    result = ahrs_fmu.GCF(form=form).run(replace(record, mag=np.full((len(record), 3), np.nan)))
    assert np.max(np.abs(result.euler[-1, :2])) < 1e-4
    assert result.yaw[-1] == pytest.approx(60.0 * 0.005, abs=1e-3)
    assert set(result.status) == {ahrs_fmu.Status.MAG_UNUSED}


def test_a_magnetometer_that_appears_later_aligns_the_heading_at_once() -> None:
    record = at_rest(4.0, 0.01, euler=(0.1, 0.2, 1.0))
    mag = record.mag.copy()
    mag[:200] = np.nan
    for realisation in REALISATIONS:
        result = ahrs_fmu.GCF(realisation=realisation).run(replace(record, mag=mag))
        assert result.yaw[199] == pytest.approx(0.0, abs=1e-9)
        assert result.yaw[200] == pytest.approx(1.0, abs=1e-9)


def test_a_turn_of_720_degrees_has_no_jump_of_sign() -> None:
    yaw = np.linspace(0.0, 4 * np.pi, 1001)
    q = quaternion.from_euler(np.stack((0 * yaw, 0 * yaw, yaw), axis=-1))
    record = recording(q, 0.01)
    for realisation in REALISATIONS:
        result = ahrs_fmu.GCF(realisation=realisation).run(record)
        assert np.max(angle_between(q, result.q)) < 1e-6
        assert np.all(np.sum(result.q[1:] * result.q[:-1], axis=1) > 0.0)


def test_frames_and_declination_describe_the_same_attitude() -> None:
    record = tumbling(20.0, 0.01)
    ned = ahrs_fmu.GCF().run(record)
    enu = ahrs_fmu.GCF(frame="enu").run(record)
    assert np.max(angle_between(frames.attitude(ned.q, Frame.NED, Frame.ENU), enu.q)) < 1e-12
    np.testing.assert_allclose(enu.gyro_bias, ned.gyro_bias * [1, -1, -1], atol=1e-15)
    turned = ahrs_fmu.GCF(declination=0.1).run(record)
    expected = quaternion.multiply(quaternion.exp([0.0, 0.0, 0.1]), ned.q)
    assert np.max(angle_between(expected, turned.q)) < 1e-12


@pytest.mark.parametrize("frame", ["ned", "enu"])
def test_a_given_attitude_is_in_the_frame_of_the_output(frame: str) -> None:
    q0 = quaternion.normalise([0.5, -0.3, 0.7, 0.2])
    gcf = ahrs_fmu.GCF(frame=frame, declination=0.2, initialisation="given", q0=tuple(0.9 * q0))
    estimate = gcf.update([0, 0, 0], [0, 0, 0])
    assert angle_between(q0[None], estimate.q[None])[0] < 1e-12


def test_averaging_the_start_reports_initialising_and_flags_motion() -> None:
    record = at_rest(2.0, 0.01, euler=(0.1, -0.2, 0.3))
    result = ahrs_fmu.GCF(init_time=1.0).run(record)
    assert set(result.status[:100]) == {ahrs_fmu.Status.INITIALISING}
    assert result.status[100] == ahrs_fmu.Status.NOMINAL
    assert np.max(angle_between(record.q_true, result.q)) < 1e-9
    moving = ahrs_fmu.GCF(init_time=1.0).run(replace(record, gyro=record.gyro + 0.5))
    assert set(moving.status[:100]) == {ahrs_fmu.Status.INITIALISING_IN_MOTION}


def test_nothing_usable_at_the_start_waits_for_the_first_usable_sample() -> None:
    record = at_rest(1.0, 0.01, euler=(0.1, -0.2, 0.3))
    accel = record.accel.copy()
    accel[:50] = 0.0
    result = ahrs_fmu.GCF().run(replace(record, accel=accel))
    assert set(result.status[:50]) == {ahrs_fmu.Status.INITIALISING}
    assert np.all(result.q[:50] == [1, 0, 0, 0])
    assert np.max(angle_between(record.q_true, result.q)[50:]) < 1e-9


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300, 1e20])
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("realisation", REALISATIONS)
def test_samples_that_are_not_physical_are_forgotten(value: float, precision: str, realisation: str) -> None:
    record = at_rest(3.0, 0.01, euler=(0.3, 0.2, -2.0))
    spoiled = {}
    for sensor, rows in (("gyro", slice(50, 60)), ("accel", slice(80, 90)), ("mag", slice(110, 120))):
        spoiled[sensor] = getattr(record, sensor).copy()
        spoiled[sensor][rows, 1] = value
    result = ahrs_fmu.GCF(precision=precision, realisation=realisation).run(replace(record, **spoiled))
    assert np.all(
        np.isfinite(
            np.column_stack((result.q, result.euler, result.rate, result.gyro_bias, result.motion_accel))
        )
    )
    assert np.max(angle_between(record.q_true, result.q)) < (1e-6 if precision == "double" else 1e-3)
    assert set(result.status[50:60]) == {ahrs_fmu.Status.GYRO_HELD}
    assert set(result.status[80:90]) == {ahrs_fmu.Status.ACCEL_UNUSED}
    assert set(result.status[110:120]) == {ahrs_fmu.Status.MAG_UNUSED}
    assert result.status[-1] == ahrs_fmu.Status.NOMINAL


def test_a_field_along_gravity_leaves_the_heading_alone_and_tilt_corrected() -> None:
    record = at_rest(10.0, 0.01)
    gcf = ahrs_fmu.GCF(initialisation="given", q0=started_off(0, 5 * DEG), ki=0.0)
    result = gcf.run(replace(record, mag=np.tile([0.0, 0.0, 5e-5], (len(record), 1))))
    assert set(result.status) == {ahrs_fmu.Status.MAG_UNUSED}
    assert result.roll[-1] / DEG == pytest.approx(0.033, abs=0.001)
    assert abs(result.yaw[-1]) < 1e-9


def test_free_fall_predicts_only() -> None:
    record = at_rest(5.0, 0.01, gyro_bias=(0.01, 0.0, 0.0))
    result = ahrs_fmu.GCF(initialisation="given", ki=0.0).run(replace(record, accel=record.accel * 0.05))
    assert result.roll[-1] == pytest.approx(0.05, abs=1e-9)


def test_a_step_that_is_no_step_is_rejected_and_a_gap_is_carried_over() -> None:
    gcf = ahrs_fmu.GCF()
    level = ([0.0, 0.0, 0.0], [0.0, 0.0, -GRAVITY], [4e-5, 0.0, 3e-5])
    gcf.update(*level)
    for dt in (math.nan, math.inf, -0.01):
        assert gcf.update([1.0, 0.0, 0.0], *level[1:], dt=dt).status is ahrs_fmu.Status.STEP_REJECTED
    assert gcf.update([1.0, 0.0, 0.0], *level[1:], dt=0.0).euler[0] == 0.0
    assert gcf.update([0.2, 0.0, 0.0], *level[1:], dt=2.0).euler[0] == pytest.approx(0.4, abs=1e-12)
    assert gcf.update(*level).status is ahrs_fmu.Status.NOMINAL


def test_gating_ignores_the_accelerometer_for_a_limited_time() -> None:
    record = at_rest(30.0, 0.01)
    pushed = replace(record, accel=record.accel + np.array([6.0, 0.0, 0.0]))
    options = {
        "accel_gating": True,
        "accel_gate": 1.0,
        "accel_gate_time": 10.0,
        "initialisation": "given",
        "ki": 0.0,
    }
    result = ahrs_fmu.GCF(**options).run(pushed)
    assert np.max(np.abs(result.euler[:1000])) < 1e-9
    assert not result.accel_used[500]
    assert result.accel_used[1100]
    assert abs(result.pitch[-1]) > 0.3


@pytest.mark.slow
def test_single_precision_stays_with_double_over_an_hour() -> None:
    record = tumbling(3600.0, 0.01, rate=0.3)
    double, single = (ahrs_fmu.GCF(precision=name).run(record) for name in ("double", "single"))
    assert np.max(angle_between(double.q, single.q)) / DEG < 0.01


def test_single_precision_stays_with_double_over_five_minutes() -> None:
    record = tumbling(300.0, 0.01, rate=0.3)
    for realisation in REALISATIONS[:3]:
        double, single = (
            ahrs_fmu.GCF(precision=name, realisation=realisation).run(record) for name in ("double", "single")
        )
        assert np.max(angle_between(double.q, single.q)) / DEG < 0.01


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"kp": -1.0}, "kp = -1 rad/s is refused: it must be at least 0"),
        ({"kp": math.nan}, "kp = nan"),
        ({"kp": 200.0}, "kp*sample_time < 1 does not hold"),
        ({"kii": 1.0}, "kp*ki > kii"),
        ({"realisation": "vector", "form": "attitude"}, "realisation = vector, form = attitude"),
        ({"error": "coupled", "form": "attitude"}, "error = coupled, form = attitude"),
        ({"frame": "up"}, "frame = 'up' is not one of ned, enu"),
        ({"initialisation": "given", "q0": (0.0, 0.0, 0.0, 0.0)}, "q0 has no direction"),
        ({"sample_time": 0.0}, "sample_time = 0 s"),
        ({"q0": (1.0, 0.0)}, "it takes 4"),
    ],
)
def test_a_refused_parameter_names_itself_its_value_and_the_limit(
    parameters: dict[str, object], words: str
) -> None:
    with pytest.raises(ValueError, match=words.replace("*", r"\*").replace("(", r"\(")):
        ahrs_fmu.GCF(**parameters)


def test_gains_change_in_flight_and_fixed_parameters_do_not() -> None:
    gcf = ahrs_fmu.GCF()
    gcf.set("frame", "ned")
    gcf.update([0, 0, 0], [0, 0, -GRAVITY])
    gcf.set("kp", 1.0)
    assert gcf.parameters["kp"] == 1.0
    with pytest.raises(ValueError, match="fixed"):
        gcf.set("frame", "enu")
    with pytest.raises(ValueError, match="sample_time < 1"):
        gcf.set("kp", 100.0)
    assert gcf.parameters["kp"] == 1.0


def test_the_state_is_small_enough_for_a_microcontroller() -> None:
    assert NativeModel(descriptors.load("gcf"), "single").state_size <= 200


def test_saving_and_restoring_continues_to_the_bit() -> None:
    record = tumbling(2.0, 0.01)
    rows = list(zip(record.gyro, record.accel, record.mag, strict=True))
    gcf = ahrs_fmu.GCF(kp=0.7)
    for row in rows[:100]:
        gcf.update(*row)
    saved = gcf.save()
    once = [gcf.update(*row).q for row in rows[100:]]
    other = ahrs_fmu.GCF()
    other.restore(saved)
    again = [other.update(*row).q for row in rows[100:]]
    np.testing.assert_array_equal(once, again)
    assert other.parameters["kp"] == 0.7


def test_sample_by_sample_equals_a_whole_record_to_the_bit() -> None:
    record = tumbling(2.0, 0.01)
    gcf = ahrs_fmu.GCF()
    single = [
        gcf.update(g, a, m, dt=t).q
        for g, a, m, t in zip(record.gyro, record.accel, record.mag, record.steps, strict=True)
    ]
    np.testing.assert_array_equal(single, gcf.run(record).q)

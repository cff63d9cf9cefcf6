"""Gains in plain words."""

from __future__ import annotations

import math

import pytest

from ahrs_fmu.analysis.design import SensorNoise, optimal_gains, predict_attitude_rms, predict_rms
from ahrs_fmu.analysis.explain import Explanation, explain
from ahrs_fmu.analysis.theory import Gains, LowPass
from ahrs_fmu.errors import DesignError

T = 0.02
SENSOR = SensorNoise(gyro=1e-4, bias_walk=1e-5, accel=2e-3, mag=6e-8, field=50e-6, dip=math.radians(60.0))


def meaning(told: Explanation, topic: str) -> str:
    return next(f"{f.value}: {f.meaning}" for f in told.findings if f.topic == topic)


@pytest.mark.parametrize(
    ("law", "topic", "words"),
    [
        (Gains(0.5), "damping", "first order"),
        (Gains(0.5), "gyro bias", "a gyro bias of 0.1 deg/s turns the estimate by 0.2 deg"),
        (Gains(0.1, 0.1), "damping", "low"),
        (Gains(0.5, 0.1), "damping", "good"),
        (Gains(5.0, 0.1), "damping", "high"),
        (Gains(0.5, 0.1), "gyro bias", "drifts by 1 deg/s in a minute leaves 0.16 deg"),
        (Gains(1.0, 0.3, 0.05), "gyro bias", "neither"),
        (Gains(1.0, 0.3, 0.05), "stability", "not below 1/6"),
        (Gains(0.5, 0.1), "tilt per 1 m/s2", "a steady acceleration tilts by 5.8 deg"),
        (Gains(0.5, 0.1), "predicted error", "deg heading"),
        (Gains(0.5), "predicted error", "unbounded"),
        (Gains(0.7, 0.07), "on a multirotor", "18% of a tilt: is seen where it swings with 0.41 rad/s"),
        (Gains(0.7, 0.07), "on a multirotor", "at 6 rad/s the estimate leads by 6.7 deg"),
        (LowPass(0.4, 0.7), "damping", "errors fade without ringing"),
        (LowPass(0.4, 0.7), "gyro bias", "3.5 deg per deg/s"),
        (LowPass(0.4, 0.7), "stability", "any gain"),
        (LowPass(0.4, 0.7), "predicted error", "while the bias is known"),
    ],
)
def test_every_consequence_is_said(law: Gains | LowPass, topic: str, words: str) -> None:
    assert words in meaning(explain(law, T, SENSOR), topic)


def test_predicted_errors_and_best_gains_are_those_of_the_design() -> None:
    told = explain(Gains(0.5, 0.1), T, SENSOR)
    assert told.budget == predict_attitude_rms(Gains(0.5, 0.1), SENSOR, T)
    best = optimal_gains(SENSOR.tilt)
    assert f"kp {best.kp:.3g}, ki {best.ki:.3g}" in meaning(told, "best gains at rest")


def test_of_one_axis_the_predicted_tilt_is_the_scalar_one() -> None:
    told = explain(Gains(0.5, 0.1), T, SENSOR, kind=None)
    tilt = math.degrees(predict_rms(Gains(0.5, 0.1), SENSOR.tilt, T).total)
    assert told.budget is None
    assert meaning(told, "predicted error").startswith(f"{tilt:.3g} deg tilt: RMS at rest; ")


def test_a_low_pass_behind_the_filter_takes_from_the_tilt_that_motion_causes() -> None:
    plain, lagging = (explain(Gains(1.0), T, lag=lag) for lag in (None, 2.0 * math.pi))
    assert "0.93 deg at 1 Hz" in meaning(plain, "tilt per 1 m/s2")
    assert "0.66 deg at 1 Hz" in meaning(lagging, "tilt per 1 m/s2")
    assert "6.28 rad/s" in meaning(lagging, "low-pass behind")


def test_without_a_sensor_no_error_is_predicted() -> None:
    told = explain(Gains(0.5, 0.1), T)
    assert told.budget is None
    assert "predicted error" not in [f.topic for f in told.findings]


def test_compensation_lowers_the_tilt_that_motion_causes() -> None:
    plain, compensated = (explain(Gains(0.5), T, motion_time_constant=tau) for tau in (None, 1.0))
    assert compensated.characteristics.crossover < plain.characteristics.crossover / 10.0


def test_unstable_gains_are_refused_with_the_limit() -> None:
    with pytest.raises(DesignError, match="kp T < 2"):
        explain(Gains(150.0), T)

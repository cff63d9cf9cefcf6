"""The small-signal responses of the other estimators, against the filters they amount to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ahrs_fmu import descriptors
from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.design import noise_of_samples, sampled_kalman_gains
from ahrs_fmu.analysis.equivalent import Equivalent, small_signal
from ahrs_fmu.analysis.linear_model import linearise
from ahrs_fmu.analysis.measure import FrequencyResponse, deviation, plan, stepped_sine
from ahrs_fmu.analysis.theory import Gains, LowPass, filter_of
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.stepper import Stepper, replay
from ahrs_fmu.errors import DesignError

T = 0.01
ROLL, PITCH, YAW = range(3)
OMEGA = np.geomspace(0.02, 30.0, 14)


def core(model: str, **parameters: float) -> CoreStepper:
    return CoreStepper(descriptors.load(model), {"sample_time": T, **parameters})


def nearest(model: str) -> Equivalent:
    return small_signal(core(model), T)


@pytest.mark.parametrize(
    ("model", "order", "corner", "mismatch"),
    [
        ("complementary", 1, 0.58, 1e-6),
        ("gcf", 2, 0.54, 1e-3),
        ("mahony", 2, 1.02, 1e-3),
        ("improved_ekf", 1, 5.13, 1e-3),
        ("cg_ekf", 1, 8.22, 1e-3),
        ("mekf", 2, 0.474, 1e-3),
        ("ukf", 2, 0.474, 1e-3),
    ],
)
def test_estimators_respond_like_complementary_filters_with_a_corner_of_their_own(
    model: str, order: int, corner: float, mismatch: float
) -> None:
    found = nearest(model)
    assert isinstance(found.law, Gains)
    assert found.law.order == order
    assert found.crossover == pytest.approx(corner, rel=0.02)
    assert found.lag is None
    assert found.mismatch_db < mismatch


def test_mahony_ekf_is_mahony_with_the_low_pass_of_the_kalman_filter_behind_it() -> None:
    found, alone, behind = nearest("mahony_ekf"), nearest("mahony"), nearest("improved_ekf")
    assert found.crossover == pytest.approx(alone.crossover, rel=0.03)
    assert found.lag is not None
    assert isinstance(behind.law, Gains)
    assert found.lag == pytest.approx(-math.log(1.0 - behind.law.kp * T) / T, rel=0.03)
    assert found.form == f"second order and low-pass {found.lag:.3g} rad/s"
    assert found.mismatch_db < 0.15


def test_adaptive_ckf_is_a_low_pass_of_about_six_rad_per_second_only_roughly() -> None:
    found = nearest("adaptive_ckf")
    assert found.crossover == pytest.approx(6.5, rel=0.15)
    assert 0.5 < found.mismatch_db < 3.0


TILT_TIME = {"hand": 3.5, "multirotor": 10.0}
"""Time constants of the KCF's profiles, s (docs/accuracy.md)."""


class Shaken:
    """A stepper on a vehicle that vibrates by 1.5 m/s2 up and down from sample to sample, so never rests."""

    never_fails = True

    def __init__(self, inner: Stepper) -> None:
        self.inputs, self.outputs, self.reset = inner.inputs, inner.outputs, inner.reset
        self.inner = inner

    def replay(
        self, inputs: dict[str, np.ndarray], outputs: list[str], dt: float, rows: int | None = None
    ) -> dict[str, np.ndarray]:
        assert rows is None
        accel = inputs["accel"].copy()
        accel[:, 2] += 1.5 * (-1.0) ** np.arange(len(accel))
        return replay(self.inner, {**inputs, "accel": accel}, outputs, dt)


def measured(
    stepper: Stepper, path: str, axis: int, omega: np.ndarray = OMEGA, settle: float = 300.0
) -> FrequencyResponse:
    return stepped_sine(stepper, plan(path, omega, amplitude=math.radians(1.0), settle=settle), T, axis)


def slow_butterworth(omega: np.ndarray, time_constant: float, period: float = 0.05) -> np.ndarray:
    """Mean over a slow period, low-pass and hold of the KCF (docs/algorithms.md section 6)."""
    w, z = math.sqrt(2.0) / time_constant, np.exp(1j * omega * period)
    den = 1.0 + math.sqrt(2.0) * w * period + (w * period) ** 2
    pull = (w * period) ** 2 / den
    low_pass = pull / ((1.0 - 1.0 / z) * (1.0 - 1.0 / (den * z)) + pull / z)
    one_period = np.mean(np.exp(-1j * np.outer(np.arange(round(period / T)) * T, omega)), axis=0)
    return low_pass * one_period**2


@pytest.mark.parametrize("profile", ["hand", "multirotor"])
@pytest.mark.parametrize("axis", [ROLL, PITCH])
def test_tilt_of_the_kcf_is_a_butterworth_filter_in_the_frame_of_the_gyro(profile: str, axis: int) -> None:
    response = measured(core("kcf", profile=profile), "angle", axis)
    found = deviation(response.main, slow_butterworth(OMEGA, TILT_TIME[profile]))
    assert np.max(np.abs(found.magnitude_db)) < 0.01
    assert math.degrees(np.max(np.abs(found.phase))) < 0.05


def test_nearest_filter_of_the_kcf_is_a_low_pass_with_the_corner_of_its_time_constant() -> None:
    found = nearest("kcf")
    assert isinstance(found.law, LowPass)
    assert found.form == "low-pass of second order"
    assert found.law.natural_frequency == pytest.approx(math.sqrt(2.0) / TILT_TIME["hand"], rel=0.01)
    assert found.law.damping == pytest.approx(math.sqrt(0.5), rel=0.04)
    assert found.mismatch_db < 0.15


def test_gyro_path_of_the_kcf_completes_its_tilt_path_as_long_as_no_bias_is_learned() -> None:
    response = measured(core("kcf", rest_drift_std=1.0), "rate", PITCH, settle=1000.0)
    found = deviation(response.main, 1.0 - slow_butterworth(OMEGA, TILT_TIME["hand"]))
    assert np.max(np.abs(found.magnitude_db)) < 0.01
    assert math.degrees(np.max(np.abs(found.phase))) < 0.05


def test_kcf_takes_a_slow_rate_for_bias_at_rest_and_hardly_in_motion() -> None:
    omega = OMEGA[OMEGA > 0.1]
    alone = 1.0 - slow_butterworth(omega, TILT_TIME["hand"])
    moving = measured(Shaken(core("kcf")), "rate", PITCH, omega, settle=1000.0)
    assert np.max(np.abs(deviation(moving.main, alone).magnitude_db)) < 0.15
    resting = measured(core("kcf"), "rate", PITCH, omega)
    assert deviation(resting.main, alone).magnitude_db[0] < -4.0


def test_heading_of_the_kcf_at_rest_is_the_steady_kalman_filter_of_its_noise_parameters() -> None:
    """States heading, hard iron across it and vertical bias, one step every 50 ms (docs/accuracy.md)."""
    period, horizontal = 0.05, 0.8
    walk = math.radians(0.1) ** 2 / 100.0
    p = math.radians(0.03) ** 2
    transition = np.array([[1.0, 0.0, -period], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    # The magnetometer shows heading and iron, the gyro at rest its bias.
    shows = np.array([[horizontal, 1.0, 0.0], [0.0, 0.0, 1.0]])
    process = period * np.diag([1e-3**2 + (2e-4 / horizontal) ** 2, 3e-4**2, walk])
    noise = np.diag([0.1**2, p**2 / walk + p * period]) / period
    covariance = np.diag([1.0, 0.02**2, math.radians(1.0) ** 2])
    for _ in range(20_000):
        prior = transition @ covariance @ transition.T + process
        gain = prior @ shows.T @ np.linalg.inv(shows @ prior @ shows.T + noise)
        covariance = prior - gain @ shows @ prior
    closed = transition - gain @ shows @ transition
    omega = np.geomspace(0.002, 1.0, 8)
    z = np.exp(1j * omega * period)
    expected = [np.linalg.solve(zi * np.eye(3) - closed, zi * horizontal * gain[:, 0])[0] for zi in z]
    response = measured(core("kcf"), "angle", YAW, omega, settle=1000.0)
    found = deviation(response.main, np.array(expected))
    assert np.max(np.abs(found.magnitude_db)) < 0.05
    slow = omega < 0.1  # faster, the hold over a period shows
    assert math.degrees(np.max(np.abs(found.phase[slow]))) < 0.3
    assert gain[0, 0] * horizontal / period == pytest.approx(0.0147, rel=0.01)


def test_a_strapdown_has_no_corner() -> None:
    with pytest.raises(DesignError, match="does not answer"):
        nearest("strapdown")


@pytest.mark.parametrize("axis", [0, 1])
def test_mekf_on_the_accelerometer_alone_is_the_optimal_complementary_filter(axis: int) -> None:
    """A magnetometer of 1 T/rtHz tells nothing; the steady gains are those of the Riccati equation."""
    gyro, bias_step, accel, gravity = math.radians(0.05), math.radians(0.001), 0.01, 9.8
    noise = noise_of_samples(gyro, bias_step, accel / gravity, T)
    filter_ = core(
        "mekf",
        gravity=gravity,
        gyro_noise=noise.gyro,
        gyro_bias_noise=noise.bias_walk,
        accel_noise=accel * math.sqrt(T),
        mag_noise=1.0,
    )
    optimal = sampled_kalman_gains(noise, T)
    linear = linearise(filter_, T, axes=(axis,), settle=60.0)
    _, _, _, direct = systems.matrices(linear)
    np.testing.assert_allclose(direct[:, 0] / T, [optimal.kp, -optimal.ki], rtol=0.02)
    poles = np.sort_complex(systems.poles(linear))
    np.testing.assert_allclose(poles, np.sort_complex(filter_of(optimal, T).poles), atol=1e-4)


def test_mahony_is_a_second_order_filter_that_corrects_with_the_new_bias() -> None:
    """Its one step with w - b + kp e makes the poles of a filter with kp + ki T, to first order."""
    kp, ki = 1.0, 0.1
    found = np.sort_complex(systems.poles(linearise(core("mahony", kp=kp, ki=ki), T, axes=(PITCH,))))
    expected = np.sort_complex(filter_of(Gains(kp + ki * T, ki), T).poles)
    np.testing.assert_allclose(found, expected, atol=1e-8)

"""Gains from requirements and from noise."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from ahrs_fmu.analysis.design import (
    Motion,
    Noise,
    error_against_crossover,
    gains_for,
    gains_under_motion,
    heading_angle_noise,
    kalman_gains,
    motion_band,
    noise_of_samples,
    optimal_covariance,
    optimal_gains,
    predict_rms,
    sampled_kalman_gains,
    sensitivity,
    tilt_angle_noise,
)
from ahrs_fmu.analysis.theory import Gains, characterise, filter_of
from ahrs_fmu.errors import DesignError

T = 0.02
GC_TILT = noise_of_samples(math.radians(0.05), math.radians(0.001), 0.01 / 9.8, T)
NOISES = [GC_TILT, Noise(1e-4, 1e-6, 2e-3), Noise(5e-3, 0.0, 1e-3), Noise(0.0, 1e-5, 1e-3)]


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("damping", [0.5, 0.8, 1.5])
def test_gains_for_a_crossover_and_a_damping_have_them(order: int, damping: float) -> None:
    found = characterise(filter_of(gains_for(0.5, damping, order)))
    assert found.crossover == pytest.approx(0.5, rel=1e-9)
    if order == 2 or (order == 3 and damping < 1.0):
        assert found.damping == pytest.approx(damping, rel=1e-6)


def test_a_loop_gain_is_taken_out_of_the_gains() -> None:
    assert gains_for(0.5, 0.8, loop_gain=2.0).scaled(2.0) == gains_for(0.5, 0.8)


def test_optimal_gains_of_the_published_noise_are_three_times_the_published_ones() -> None:
    gains = optimal_gains(GC_TILT)
    assert gains.kp == pytest.approx(1.563, abs=5e-4)
    assert gains.ki == pytest.approx(0.855, abs=5e-4)
    sampled = sampled_kalman_gains(GC_TILT, T)
    assert sampled.kp == pytest.approx(1.538, abs=5e-4)
    assert sampled.ki == pytest.approx(0.842, abs=5e-4)


@pytest.mark.parametrize("noise", NOISES)
def test_closed_form_and_riccati_equation_agree(noise: Noise) -> None:
    closed, riccati = optimal_gains(noise), kalman_gains(noise)
    assert closed.kp == pytest.approx(riccati.kp, rel=1e-10)
    assert closed.ki == pytest.approx(riccati.ki, rel=1e-10)


@pytest.mark.parametrize("noise", [NOISES[0], NOISES[1], NOISES[3]])
def test_covariance_of_the_optimum_is_that_of_the_riccati_equation(noise: Noise) -> None:
    _, riccati, _ = control.lqe(
        [[0.0, -1.0], [0.0, 0.0]],
        np.eye(2),
        [[1.0, 0.0]],
        np.diag([noise.gyro**2, noise.bias_walk**2]),
        [[noise.angle**2]],
    )
    closed = optimal_covariance(noise)
    np.testing.assert_allclose(closed, riccati, rtol=1e-10)
    assert math.sqrt(closed[0, 0]) == pytest.approx(predict_rms(optimal_gains(noise), noise).total, rel=1e-9)


@pytest.mark.parametrize("noise", NOISES)
def test_sampled_optimum_tends_to_the_continuous_one(noise: Noise) -> None:
    closed, sampled = optimal_gains(noise), sampled_kalman_gains(noise, 1e-5)
    assert sampled.kp == pytest.approx(closed.kp, rel=1e-3)
    assert sampled.ki == pytest.approx(closed.ki, rel=1e-3)


@pytest.mark.parametrize("noise", NOISES[:2])
def test_optimal_damping_is_at_least_that_of_a_butterworth_filter(noise: Noise) -> None:
    assert characterise(filter_of(optimal_gains(noise))).damping >= math.sqrt(0.5)


@pytest.mark.parametrize("noise", NOISES[:2])
def test_optimal_variance_is_that_of_the_riccati_equation(noise: Noise) -> None:
    expected = noise.angle * math.sqrt(noise.gyro**2 + 2.0 * noise.bias_walk * noise.angle)
    assert predict_rms(optimal_gains(noise), noise).total ** 2 == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("gains", [Gains(0.5, 0.1), Gains(1.56, 0.855), Gains(2.0, 0.05)])
def test_predicted_error_has_its_closed_form_and_solves_the_lyapunov_equation(gains: Gains) -> None:
    n, k, r = GC_TILT.gyro, GC_TILT.bias_walk, GC_TILT.angle
    closed = (n**2 + k**2 / gains.ki + r**2 * (gains.kp**2 + gains.ki)) / (2.0 * gains.kp)
    a = np.array([[-gains.kp, -1.0], [gains.ki, 0.0]])
    q = np.array(
        [
            [n**2 + (r * gains.kp) ** 2, -(r**2) * gains.kp * gains.ki],
            [-(r**2) * gains.kp * gains.ki, k**2 + (r * gains.ki) ** 2],
        ]
    )
    assert closed == pytest.approx(solve_continuous_lyapunov(a, -q)[0, 0], rel=1e-6)
    budget = predict_rms(gains, GC_TILT)
    assert budget.total**2 == pytest.approx(closed, rel=1e-9)
    assert budget.total**2 == pytest.approx(budget.gyro**2 + budget.bias_walk**2 + budget.angle**2, rel=1e-12)


def test_published_gains_have_the_published_error() -> None:
    assert math.degrees(predict_rms(Gains(0.5, 0.1), GC_TILT).total) == pytest.approx(0.0240, abs=5e-5)
    assert math.degrees(predict_rms(optimal_gains(GC_TILT), GC_TILT).total) == pytest.approx(
        0.01034, abs=5e-5
    )
    assert math.degrees(predict_rms(sampled_kalman_gains(GC_TILT, T), GC_TILT, T).total) == pytest.approx(
        0.01026, abs=5e-6
    )


def test_no_other_gains_do_better_than_the_optimal_ones() -> None:
    best = sampled_kalman_gains(GC_TILT, T)
    least = predict_rms(best, GC_TILT, T).total
    for kp, ki in ((1.05, 1.0), (0.95, 1.0), (1.0, 1.05), (1.0, 0.95)):
        assert predict_rms(Gains(kp * best.kp, ki * best.ki), GC_TILT, T).total > least


def test_the_u_curve_has_its_minimum_at_the_crossover_of_the_optimal_gains() -> None:
    best = characterise(filter_of(optimal_gains(GC_TILT)))
    curve = error_against_crossover(GC_TILT, np.geomspace(0.1, 20.0, 60), best.damping)
    assert curve.best == pytest.approx(best.crossover, rel=0.01)
    assert np.all(np.diff(curve.angle) > 0.0)
    assert np.all(np.diff(curve.gyro) < 0.0)


def test_sensitivity_is_flat_at_the_optimum_and_shares_out_the_error() -> None:
    best = sensitivity(optimal_gains(GC_TILT), GC_TILT)
    assert best.half_gains > 1.0
    assert best.double_gains > 1.0
    assert best.gyro + best.bias_walk + best.angle == pytest.approx(1.0)
    slow = sensitivity(Gains(0.5, 0.1), GC_TILT)
    assert slow.double_gains < 1.0
    louder = Noise(GC_TILT.gyro, 1.01 * GC_TILT.bias_walk, GC_TILT.angle)
    ratio = predict_rms(Gains(0.5, 0.1), louder).total / predict_rms(Gains(0.5, 0.1), GC_TILT).total
    assert 100.0 * (ratio - 1.0) == pytest.approx(slow.bias_walk, rel=0.01)


def test_motion_acceleration_lowers_the_best_gains() -> None:
    motion = motion_band(0.5, 0.2, 2.0)
    calm, moved = optimal_gains(GC_TILT), gains_under_motion(GC_TILT, motion, T)
    assert moved.kp < 0.5 * calm.kp
    assert predict_rms(moved, GC_TILT, T, motion).total < predict_rms(calm, GC_TILT, T, motion).total
    assert characterise(filter_of(moved)).damping >= 0.7 - 1e-6


def test_a_narrow_band_of_motion_tilts_by_the_response_at_its_frequency() -> None:
    motion = motion_band(1.0, 0.4999, 0.5001)
    gain = np.abs(filter_of(Gains(0.5, 0.1)).respond(math.pi)[0])
    assert predict_rms(Gains(0.5, 0.1), GC_TILT, motion=motion).motion == pytest.approx(
        gain / 9.80665, rel=1e-3
    )


def test_sensor_noise_becomes_angle_noise() -> None:
    assert tilt_angle_noise(0.0098, 9.8) == pytest.approx(1e-3)
    assert heading_angle_noise(1e-9, 50e-6, math.radians(60.0)) == pytest.approx(4e-5)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gains_for(-0.5), "crossover = -0.5"),
        (lambda: gains_for(0.5, 0.0), "damping = 0"),
        (lambda: gains_for(0.5, order=4), "order = 4"),
        (lambda: Noise(-1.0, 0.0, 1.0), "gyro noise density = -1"),
        (lambda: Noise(1.0, 0.0, 0.0), "angle noise density = 0"),
        (lambda: Noise(0.0, 0.0, 1.0), "neither noise nor bias walk"),
        (lambda: noise_of_samples(1.0, 0.0, 1.0, 0.0), "sample_time = 0"),
        (lambda: motion_band(1.0, 2.0, 1.0), "give the lower edge first"),
        (lambda: Motion(np.array([1.0, 0.5]), np.array([1.0, 1.0])), "increasing frequencies"),
        (lambda: heading_angle_noise(1e-9, 50e-6, math.radians(120.0)), "horizontal field"),
    ],
)
def test_impossible_designs_are_refused_in_one_line(make, words: str) -> None:
    with pytest.raises(DesignError) as refusal:
        make()
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)

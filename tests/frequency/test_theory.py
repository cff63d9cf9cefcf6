"""Complementary filters as linear systems, against the closed forms of docs/algorithms.md section 6."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from scipy.integrate import quad

from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.theory import (
    Gains,
    LowPass,
    bias_error,
    characterise,
    compensate,
    complementary,
    correction,
    crossover,
    describe,
    discretise,
    filter_of,
    noise_bandwidth,
    noise_power,
    ramp_error,
    settling_time,
    step_error,
    tilt_error,
)
from ahrs_fmu.errors import DesignError

T = 0.02
OMEGA = np.geomspace(0.02, 20.0, 30)
ORDERS = pytest.mark.parametrize(
    "gains", [Gains(0.5), Gains(0.5, 0.1), Gains(1.0, 0.3, 0.05)], ids=["first", "second", "third"]
)
TIMES = pytest.mark.parametrize("sample_time", [None, T], ids=["continuous", "sampled"])


@ORDERS
@TIMES
def test_the_two_responses_sum_to_one(gains: Gains, sample_time: float | None) -> None:
    g_a, g_b = filter_of(gains, sample_time).respond(OMEGA)
    np.testing.assert_allclose(g_a + g_b, 1.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("motion", [None, 1.0, math.inf])
@ORDERS
@TIMES
def test_transfer_functions_have_the_response_of_the_loop(
    gains: Gains, sample_time: float | None, motion: float | None
) -> None:
    if motion is not None and sample_time is None:
        pair = complementary(compensate(correction(gains), motion, T))
    else:
        pair = filter_of(gains, sample_time, motion)
    g_a, g_b = pair.respond(OMEGA)
    np.testing.assert_allclose(systems.response(pair.g_a, OMEGA), g_a, rtol=1e-5)
    np.testing.assert_allclose(systems.response(pair.g_b, OMEGA), g_b, rtol=1e-5)
    np.testing.assert_allclose(systems.response(pair.g_rate, OMEGA), pair.respond_rate(OMEGA), rtol=1e-5)


@pytest.mark.parametrize(
    ("gains", "expected", "digits"),
    [
        (Gains(0.58), 0.58, 12),
        (Gains(0.5, 0.1), 0.5339, 4),
        (Gains(0.15, 0.01), 0.16218, 5),
        (Gains(1.0, 0.1), 1.00494, 5),
        (Gains(2.0, 1.0), 2.0582, 4),
        (Gains(1.0, 0.3, 0.05), 0.99622, 5),
    ],
)
def test_crossover_has_its_closed_form(gains: Gains, expected: float, digits: int) -> None:
    assert round(crossover(filter_of(gains)), digits) == pytest.approx(expected, abs=1e-12)


def test_crossover_of_a_second_order_filter_satisfies_its_formula() -> None:
    kp, ki = 0.7, 0.3
    expected = math.sqrt((kp**2 + math.sqrt(kp**4 + 4.0 * ki**2)) / 2.0)
    assert crossover(filter_of(Gains(kp, ki))) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("gains", "natural_frequency", "damping", "peak"),
    [(Gains(0.5, 0.1), 0.3162, 0.791, 1.227), (Gains(0.15, 0.01), 0.1, 0.75, 1.248)],
)
def test_second_order_filters_have_the_natural_frequency_damping_and_peak_of_the_formulas(
    gains: Gains, natural_frequency: float, damping: float, peak: float
) -> None:
    found = characterise(filter_of(gains))
    assert round(found.natural_frequency, 4) == natural_frequency
    assert round(found.damping, 3) == damping
    assert round(found.peak, 3) == peak


def test_noise_bandwidths_have_their_closed_forms() -> None:
    assert noise_bandwidth(filter_of(Gains(0.58))) == pytest.approx(0.58 / 4.0, rel=1e-12)
    assert noise_bandwidth(filter_of(Gains(0.5, 0.1))) == pytest.approx(0.1750, rel=1e-12)
    assert noise_bandwidth(filter_of(Gains(1.0, 0.3, 0.05))) == pytest.approx(0.340, rel=1e-12)


@pytest.mark.parametrize("gains", [Gains(1.0, 0.3, 0.05), Gains(2.0, 0.7, 0.4), Gains(0.4, 0.2, 0.01)])
def test_third_order_has_the_noise_bandwidth_and_the_crossover_of_its_formulas(gains: Gains) -> None:
    kp, ki, kii = gains.kp, gains.ki, gains.kii
    bandwidth = (kp**2 * kii * ki + (ki**2 - 2.0 * kii * kp) * kii + kii**2 * kp) / (
        4.0 * kii * (ki * kp - kii)
    )
    assert noise_bandwidth(filter_of(gains)) == pytest.approx(bandwidth, rel=1e-10)
    x = crossover(filter_of(gains)) ** 2
    cubic = (x**3, -(kp**2) * x**2, (2.0 * kp * kii - ki**2) * x, -(kii**2))
    assert abs(sum(cubic)) < 1e-10 * max(map(abs, cubic))


@ORDERS
def test_noise_bandwidth_is_the_integral_over_frequency(gains: Gains) -> None:
    pair = filter_of(gains)

    def power(frequency: float) -> float:
        return float(np.abs(pair.respond(2.0 * math.pi * frequency)[0]) ** 2)

    integral = quad(power, 0.0, 1.0, limit=400)[0] + quad(power, 1.0, math.inf, limit=400)[0]
    assert noise_bandwidth(pair) == pytest.approx(integral, rel=1e-7)


def test_noise_bandwidth_of_the_sampled_filter_is_the_integral_to_half_the_sample_rate() -> None:
    pair = filter_of(Gains(1.0, 0.3, 0.05), T)
    # A periodic function is integrated exactly by equally spaced points.
    frequency = (np.arange(20000) + 0.5) * 0.5 / T / 20000
    integral = np.mean(np.abs(pair.respond(2.0 * math.pi * frequency)[0]) ** 2) * 0.5 / T
    assert noise_bandwidth(pair) == pytest.approx(integral, rel=1e-6)


def test_noise_power_of_an_unstable_system_is_infinite() -> None:
    assert noise_power(systems.transfer_function([1.0], [1.0, 0.0], None)) == math.inf


def test_second_order_sampled_filter_has_the_printed_polynomials() -> None:
    kp, ki = 0.5, 0.1
    a, b = kp * T, ki * T * T
    pair = filter_of(Gains(kp, ki), T)
    denominator = [1.0, -(2.0 - a - b), 1.0 - a]
    for system, numerator in (
        (pair.g_a, [a, b - a, 0.0]),
        (pair.g_b, [1.0 - a, -2.0 * (1.0 - a), 1.0 - a]),
        (pair.g_rate, [(1.0 - a) * T, -(1.0 - a) * T, 0.0]),
    ):
        z = np.exp(1j * OMEGA * T)
        expected = np.polyval(numerator, z) / np.polyval(denominator, z)
        np.testing.assert_allclose(systems.response(system, OMEGA), expected, rtol=1e-8)


@ORDERS
def test_sampled_filter_is_the_recursion_step_by_step(gains: Gains) -> None:
    rng = np.random.default_rng(3)
    angle, rate = rng.standard_normal((2, 400))
    theta = bias = double = 0.0
    estimate = np.empty(400)
    for k in range(400):
        predicted = theta + T * (rate[k] - bias)
        error = angle[k] - predicted
        double += T * gains.kii * error
        bias -= T * (gains.ki * error + double)
        theta = predicted + T * gains.kp * error
        estimate[k] = theta
    pair = filter_of(gains, T)
    _, from_angle = control.forced_response(pair.g_a, U=angle)
    _, from_rate = control.forced_response(pair.g_rate, U=rate)
    np.testing.assert_allclose(from_angle + from_rate, estimate, rtol=0, atol=1e-10)


def test_motion_compensation_is_the_recursion_step_by_step() -> None:
    gains, tau = Gains(0.5, 0.1), 0.99
    c = math.exp(-T / tau)
    angle = np.random.default_rng(4).standard_normal(400)
    theta = bias = left = 0.0
    estimate = np.empty(400)
    for k in range(400):
        predicted = theta - T * bias
        error = angle[k] - c * left - predicted
        bias -= T * gains.ki * error
        theta = predicted + T * gains.kp * error
        left = angle[k] - theta
        estimate[k] = theta
    _, found = control.forced_response(filter_of(gains, T, tau).g_a, U=angle)
    np.testing.assert_allclose(found, estimate, rtol=0, atol=1e-10)


def test_compensated_first_order_filter_forgets_a_tilt_error_slowly() -> None:
    c = 0.98
    pair = filter_of(Gains(0.5), T, -T / math.log(c))
    times, error = step_error(pair, 60.0)
    assert times[-1] == pytest.approx(60.0)
    assert 5.0 * error[-1] / error[0] == pytest.approx(2.744, abs=1e-3)


def test_full_compensation_never_corrects_tilt() -> None:
    found = characterise(filter_of(Gains(0.5), T, math.inf))
    assert not found.stable
    assert found.pole_radius == pytest.approx(1.0, abs=1e-12)


def test_continuous_compensation_is_the_lead_that_approximates_the_sampled_one() -> None:
    tau = 1.0
    continuous = complementary(compensate(correction(Gains(0.5)), tau, T))
    sampled = filter_of(Gains(0.5), T, tau)
    low = OMEGA[OMEGA < 1.0]
    np.testing.assert_allclose(np.abs(continuous.respond(low)[0]), np.abs(sampled.respond(low)[0]), rtol=0.02)


def test_sampled_filter_stays_within_a_tenth_of_a_decibel_of_the_continuous_one() -> None:
    continuous, sampled = (
        filter_of(Gains(0.5, 0.1)).respond(OMEGA)[0],
        filter_of(Gains(0.5, 0.1), T).respond(OMEGA)[0],
    )
    assert np.max(np.abs(20.0 * np.log10(np.abs(sampled / continuous)))) <= 0.095
    lead = np.degrees(np.angle(sampled / continuous) - 0.5 * OMEGA * T)
    assert np.max(np.abs(lead)) <= 0.2


def test_largest_deviations_of_the_sampled_filter_from_the_continuous_one_are_the_printed_ones() -> None:
    omega = np.geomspace(0.05, 5.0, 200)
    sampled, continuous = (filter_of(Gains(0.5, 0.1), t).respond(omega) for t in (T, None))
    worst_db = max(float(np.max(np.abs(20.0 * np.log10(np.abs(sampled[i] / continuous[i]))))) for i in (0, 1))
    assert round(worst_db, 3) == 0.095
    assert round(math.degrees(float(np.max(np.angle(sampled[0] / continuous[0])))), 2) == 2.89


def test_constant_and_growing_bias_leave_the_errors_of_the_formulas() -> None:
    assert bias_error(filter_of(Gains(0.58))) == pytest.approx(1.0 / 0.58)
    assert bias_error(filter_of(Gains(0.58), T)) == pytest.approx((1.0 - 0.58 * T) / 0.58)
    assert 0.1 * bias_error(filter_of(Gains(0.58))) == pytest.approx(0.1724, abs=5e-5)
    assert ramp_error(filter_of(Gains(0.58))) == math.inf
    assert bias_error(filter_of(Gains(1.0, 0.3))) == 0.0
    assert 0.01 * ramp_error(filter_of(Gains(1.0, 0.3))) == pytest.approx(0.0333, abs=5e-5)
    assert 0.01 * ramp_error(filter_of(Gains(1.0, 0.3), T)) == pytest.approx(0.0327, abs=5e-5)
    assert ramp_error(filter_of(Gains(1.0, 0.3, 0.05))) == 0.0


@pytest.mark.parametrize("gains", [Gains(1.0, 0.3), Gains(1.0, 0.3, 0.05)])
def test_ramp_error_is_where_the_step_by_step_response_ends(gains: Gains) -> None:
    pair = filter_of(gains, T)
    ramp = 0.01 * T * np.arange(15000)
    _, error = control.forced_response(pair.g_rate, U=ramp)
    assert error[-1] == pytest.approx(0.01 * ramp_error(pair), abs=1e-9)


def test_initial_error_decays_exponentially_at_first_order() -> None:
    times, error = step_error(filter_of(Gains(0.5)), 10.0)
    np.testing.assert_allclose(error, np.exp(-0.5 * times), atol=1e-12)
    assert settling_time(filter_of(Gains(0.5))) == pytest.approx(math.log(50.0) / 0.5, rel=5e-3)


def test_tilt_error_under_acceleration_is_the_low_pass_over_gravity() -> None:
    error = tilt_error(filter_of(Gains(0.5)), [0.0, 0.5], gravity=9.8)
    np.testing.assert_allclose(error, [1.0 / 9.8, math.sqrt(0.5) / 9.8], rtol=1e-12)
    assert characterise(filter_of(Gains(1.0))).tilt_error == pytest.approx(math.sqrt(0.5) / 9.80665)


@pytest.mark.parametrize("ki", [0.1, 400.0, 3000.0])
def test_stability_limits_of_the_sampled_second_order_filter_are_those_of_the_formula(ki: float) -> None:
    kp_limit = (4.0 - ki * T * T) / (2.0 * T)
    assert filter_of(Gains(0.999 * kp_limit, ki), T).stable
    assert not filter_of(Gains(1.001 * kp_limit, ki), T).stable


def test_gain_margin_is_where_the_poles_leave_the_unit_circle() -> None:
    gains = Gains(0.5, 0.1)
    margin = characterise(filter_of(gains, T)).gain_margin
    assert margin == pytest.approx(4.0 / (0.1 * T * T + 2.0 * 0.5 * T), rel=1e-9)
    assert characterise(filter_of(gains.scaled(margin), T)).pole_radius == pytest.approx(1.0, abs=1e-9)


def test_third_order_filter_must_not_lose_too_much_gain() -> None:
    found = characterise(filter_of(Gains(1.0, 0.3, 0.05)))
    assert found.gain_reduction_margin == pytest.approx(0.05 / 0.3, rel=1e-8)
    assert found.gain_margin == math.inf


def test_phase_margin_is_that_of_python_control() -> None:
    pair = filter_of(Gains(1.0, 0.3, 0.05))
    _, expected, _, _ = control.margin(pair.loop)
    assert math.degrees(characterise(pair).phase_margin) == pytest.approx(expected, rel=1e-6)


def test_any_correction_law_makes_a_complementary_filter() -> None:
    lead = control.tf([2.0, 1.0], [1.0, 5.0])
    for pair in (complementary(lead), complementary(control.ss(lead)), complementary(discretise(lead, T))):
        g_a, g_b = pair.respond(OMEGA)
        np.testing.assert_allclose(g_a + g_b, 1.0, atol=1e-12)
        assert pair.stable
    np.testing.assert_allclose(
        complementary(control.ss(lead)).respond(OMEGA)[0], complementary(lead).respond(OMEGA)[0], rtol=1e-10
    )


@TIMES
def test_a_low_pass_is_a_filter_without_zero(sample_time: float | None) -> None:
    wn, zeta = 0.4, 0.7
    pair = filter_of(LowPass(wn, zeta), sample_time)
    g_a, g_b = pair.respond(OMEGA)
    s = 1j * OMEGA
    expected = wn**2 / (s**2 + 2.0 * zeta * wn * s + wn**2)
    np.testing.assert_allclose(g_a, expected, rtol=1e-12 if sample_time is None else 0.25)
    np.testing.assert_allclose(g_a + g_b, 1.0, rtol=0, atol=1e-12)
    found = characterise(pair)
    assert found.natural_frequency == pytest.approx(wn, rel=1e-9 if sample_time is None else 0.01)
    assert found.damping == pytest.approx(zeta, rel=1e-9 if sample_time is None else 0.01)
    assert found.bias_error == pytest.approx(2.0 * zeta / wn, rel=1e-9)


def test_laws_are_described_with_their_units() -> None:
    assert describe(Gains(1.0, 0.3, 0.05)) == "kp = 1 rad/s, ki = 0.3 rad2/s2, kii = 0.05 rad3/s3"
    assert describe(Gains(0.5)) == "kp = 0.5 rad/s"
    assert describe(LowPass(0.4, 0.7)) == "natural frequency 0.4 rad/s, damping 0.7"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: LowPass(-0.4, 0.7), "natural frequency = -0.4"),
        (lambda: LowPass(0.4, 0.0), "damping = 0"),
        (lambda: Gains(-1.0), "kp = -1"),
        (lambda: Gains(0.0), "kp = 0"),
        (lambda: Gains(1.0, math.nan), "ki = nan"),
        (lambda: Gains(1.0, 0.3, 0.3), "kii = 0.3"),
        (lambda: Gains(1.0, 0.0, 0.3), "below kp ki = 0"),
        (lambda: filter_of(Gains(200.0), T).require_stable(), "kp T < 2"),
        (lambda: filter_of(Gains(1.0), -T), "sample_time"),
        (lambda: filter_of(Gains(1.0), None, 1.0), "sample_time"),
        (lambda: filter_of(Gains(50.0), T), "lower kp"),
        (lambda: complementary(control.tf([1.0, 0.0, 0.0], [1.0, 1.0])), "2 zeros and 1 poles"),
        (lambda: complementary(control.tf([1.0], [1.0], True)), "sample time"),
        (lambda: complementary(control.ss([[0.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.0]])), "2 inputs"),
        (lambda: discretise(control.tf([1.0], [1.0], T), T), "continuous"),
        (lambda: compensate(correction(Gains(1.0)), -1.0, T), "motion time constant"),
        (lambda: compensate(discretise(correction(Gains(1.0)), T), 1.0, 0.01), "give the same"),
    ],
)
def test_impossible_filters_are_refused_in_one_line(make, words: str) -> None:
    with pytest.raises(DesignError) as refusal:
        make()
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)

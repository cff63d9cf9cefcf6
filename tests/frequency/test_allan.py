"""Allan deviation and the noise densities fitted to it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ahrs_fmu.analysis.allan import allan_deviation, fit_allan
from ahrs_fmu.errors import DesignError

T = 0.02
WHITE, WALK = 1e-3, 2e-4


def sensor_at_rest(seconds: float, seed: int, white: float = WHITE, walk: float = WALK) -> np.ndarray:
    rng = np.random.default_rng(seed)
    n = round(seconds / T)
    bias = np.cumsum(walk * math.sqrt(T) * rng.standard_normal(n))
    return white / math.sqrt(T) * rng.standard_normal(n) + bias


def test_white_noise_falls_with_the_root_of_the_averaging_time() -> None:
    allan = allan_deviation(sensor_at_rest(3600.0, 1, walk=0.0), T, [0.02, 0.2, 2.0])
    np.testing.assert_allclose(allan.deviation * np.sqrt(allan.tau), WHITE, rtol=0.03)


def test_deviation_of_a_short_record_is_that_of_its_definition() -> None:
    x = np.random.default_rng(2).standard_normal(120)
    for m in (1, 3, 10):
        averages = np.convolve(x, np.full(m, 1.0 / m), mode="valid")
        expected = math.sqrt(np.mean((averages[m:] - averages[:-m]) ** 2) / 2.0)
        assert allan_deviation(x, T, [m * T]).deviation[0] == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_fit_recovers_white_noise_and_random_walk_of_an_hour(seed: int) -> None:
    """Gyro of 1e-3 rad/s/rtHz and 2e-4 rad/s^2/rtHz: the hour is 400 times sqrt(3) N/K = 8.7 s."""
    fit = fit_allan(allan_deviation(sensor_at_rest(3600.0, seed), T))
    assert fit.white.value == pytest.approx(WHITE, rel=0.1)
    assert fit.walk.value == pytest.approx(WALK, rel=0.1)


def test_standard_errors_are_those_seen_over_many_records() -> None:
    fits = [
        fit_allan(allan_deviation(sensor_at_rest(900.0, seed), T), with_instability=False)
        for seed in range(25)
    ]
    for values, errors in (
        ([f.white.value for f in fits], [f.white.standard_error for f in fits]),
        ([f.walk.value for f in fits], [f.walk.standard_error for f in fits]),
    ):
        assert 0.6 < np.std(values) / np.mean(errors) < 1.5
    inside = [f.walk.interval[0] <= WALK <= f.walk.interval[1] for f in fits]
    assert np.mean(inside) >= 0.85


def test_fit_recovers_the_floor_of_flicker_noise() -> None:
    rng = np.random.default_rng(8)
    n, floor = 2**18, 5e-4
    f = np.fft.rfftfreq(n, T)
    density = np.where(f > 0.0, floor**2 / (2.0 * math.pi * np.maximum(f, f[1])), 0.0)
    spectrum = np.sqrt(0.5 * density * n / T) * (
        rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    )
    flicker = np.fft.irfft(spectrum, n)
    fit = fit_allan(allan_deviation(flicker + sensor_at_rest(n * T, 3, walk=0.0), T))
    assert fit.instability.value == pytest.approx(floor, rel=0.1)
    assert fit.white.value == pytest.approx(WHITE, rel=0.1)
    np.testing.assert_allclose(
        fit.deviation(np.array([10.0])),
        math.sqrt(WHITE**2 / 10.0 + floor**2 * 2.0 * math.log(2.0) / math.pi),
        rtol=0.1,
    )


def test_a_walk_that_the_record_is_too_short_for_is_not_invented() -> None:
    fit = fit_allan(allan_deviation(sensor_at_rest(60.0, 4, walk=1e-7), T), with_instability=False)
    low, high = fit.walk.interval
    assert low == 0.0
    assert high > 1e-7


def test_an_hour_at_200_hz_keeps_every_sample() -> None:
    allan = allan_deviation(np.random.default_rng(1).standard_normal(720_000), 0.005)
    assert allan.duration == pytest.approx(3600.0)
    assert allan.tau[-1] == pytest.approx(900.0)


@pytest.mark.parametrize(
    ("signal", "tau", "words"),
    [
        (np.zeros(50), None, "50 samples"),
        (np.full(200, np.nan), None, "200 of 200 samples are not finite"),
        (np.zeros((200, 3)), None, "one signal"),
        (np.zeros(200), [3.0], "half the record"),
    ],
)
def test_unusable_records_are_refused_in_one_line(
    signal: np.ndarray, tau: list[float] | None, words: str
) -> None:
    with pytest.raises(DesignError) as refusal:
        allan_deviation(signal, T, tau)
    assert words in str(refusal.value)

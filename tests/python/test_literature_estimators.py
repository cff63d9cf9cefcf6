"""The estimators of the literature against theory (docs/algorithms.md sections 1 to 4)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ahrs_fmu import Record, descriptors, models, quaternion, scenarios
from every_estimator import PRECISIONS, make, noisy
from motion import angle_between, at_rest, tumbling

DEG = math.pi / 180.0


def steady_gain(gyro_noise: float, attitude_noise: float, sample_time: float) -> float:
    """Kalman gain of an angle that a rate of this noise predicts and an angle of that noise measures."""
    q, r = gyro_noise**2 * sample_time, attitude_noise**2 / sample_time
    prior = 0.5 * (q + math.sqrt(q * q + 4.0 * q * r))
    return prior / (prior + r)


def steady(name: str, sample_time: float) -> dict[str, float]:
    """Parameters with which the filter begins in the steady state of its default noises."""
    known = descriptors.load(name)
    n, a = (known.numbers(p, p.default)[0] for p in map(known.parameter, ("gyro_noise", "attitude_noise")))
    std = a * math.sqrt(steady_gain(n, a, sample_time) / sample_time)
    return {"gyro_noise": n, "attitude_noise": a, "initial_attitude_std": std, "sample_time": sample_time}


def test_the_strapdown_integrates_a_constant_rate_to_fourth_order() -> None:
    rate = np.array([3.0, -2.0, 4.0])
    time = np.arange(101) * 0.01
    q = quaternion.exp(time[:, None] * rate)
    rest = at_rest(1.0, 0.01)
    record = replace(rest, gyro=np.tile(rate, (101, 1)), q_true=q)
    error = angle_between(q, make("strapdown", initialisation="given").run(record).q)
    step = np.linalg.norm(rate) * 0.01
    # The sine of half the angle lacks its next term, (step/2)^5/120.
    assert error[-1] == pytest.approx(100 * step**5 / 1920, rel=0.01)


def test_the_complementary_filter_keeps_the_error_of_a_constant_bias() -> None:
    record = at_rest(60.0, 0.02, gyro_bias=(0.1 * DEG, 0.0, 0.0))
    roll = make("complementary", sample_time=0.02).run(record).roll[-1] / DEG
    assert roll == pytest.approx(0.1 * (1 - 0.58 * 0.02) / 0.58, abs=1e-5)


@pytest.mark.parametrize("sample_time", [0.004, 1 / 66, 0.02])
@pytest.mark.parametrize("name", ["improved_ekf", "cg_ekf"])
def test_a_quaternion_ekf_is_a_first_order_filter_with_the_corner_of_its_noises(
    name: str, sample_time: float
) -> None:
    settings = steady(name, sample_time)
    gain = steady_gain(settings["gyro_noise"], settings["attitude_noise"], sample_time)
    assert gain / sample_time == pytest.approx(settings["gyro_noise"] / settings["attitude_noise"], rel=0.1)
    start = tuple(quaternion.exp([1 * DEG, 0.0, 0.0]))
    field = {"field_reference": "given", "field_dip": math.asin(0.6)}
    record = at_rest(0.5, sample_time)
    result = make(name, initialisation="given", q0=start, **field, **settings).run(record)
    np.testing.assert_allclose(result.roll / DEG, (1 - gain) ** np.arange(len(record)), rtol=2e-3)


def test_the_attitude_is_trusted_less_while_the_force_is_not_gravity() -> None:
    start = tuple(quaternion.exp([1 * DEG, 0.0, 0.0]))
    record = at_rest(0.02, 0.01)
    heavy = replace(record, accel=record.accel * 1.2)
    usual, light = (
        make("improved_ekf", initialisation="given", q0=start, initial_attitude_std=1e-2).run(r).roll
        for r in (record, heavy)
    )
    assert 0.0 < 1 * DEG - light[1] < 0.5 * (1 * DEG - usual[1])


@pytest.mark.parametrize(("bias_feed", "share"), [(True, 0.0), (False, 1.0)])
def test_only_without_the_bias_feed_does_mahonys_bias_come_back(bias_feed: bool, share: float) -> None:
    bias = 0.3 * DEG
    settings = steady("mahony_ekf", 0.01)
    record = at_rest(200.0, 0.01, gyro_bias=(bias, 0.0, 0.0))
    result = make("mahony_ekf", bias_feed=bias_feed, **settings).run(record)
    gain = steady_gain(settings["gyro_noise"], settings["attitude_noise"], 0.01)
    assert result.roll[-1] / DEG == pytest.approx(share * 0.3 * 0.01 * (1 - gain) / gain, abs=1e-4)


def best_fit(force: NDArray[np.float64], field: NDArray[np.float64], dip: float) -> NDArray[np.float64]:
    """Attitude that minimises the misfit of both unit vectors, by singular values."""
    nav = np.array([[0.0, 0.0, -1.0], [math.cos(dip), 0.0, math.sin(dip)]])
    body = np.array([force / np.linalg.norm(force), field / np.linalg.norm(field)])
    u, _, vt = np.linalg.svd(nav.T @ body)
    return quaternion.from_matrix(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


@pytest.mark.parametrize(("iterations", "off", "limit"), [(100, 40 * DEG, 1e-7), (4, 3 * DEG, 2e-5)])
def test_the_conjugate_gradients_end_at_the_best_fit(iterations: int, off: float, limit: float) -> None:
    rng = np.random.default_rng(8)
    dip = math.asin(0.6)
    for _ in range(100):
        q = quaternion.normalise(rng.normal(size=4))
        back = quaternion.conjugate(q)
        force = quaternion.rotate(back, [0.0, 0.0, -9.8]) + 0.05 * rng.normal(size=3)
        field = quaternion.rotate(back, 5e-5 * np.array([0.8, 0.0, 0.6])) + 3e-7 * rng.normal(size=3)
        axis = rng.normal(size=3)
        start = quaternion.multiply(q, quaternion.exp(off * axis / np.linalg.norm(axis)))
        cg = make(
            "cg_ekf",
            iterations=iterations,
            attitude_noise=1e-9,
            initial_attitude_std=10.0,
            initialisation="given",
            q0=tuple(start),
            field_reference="given",
            field_dip=dip,
        )
        cg.update([0.0, 0.0, 0.0], force, field)
        found = cg.update([0.0, 0.0, 0.0], force, field).q
        assert angle_between(best_fit(force, field, dip), found) < limit


def gc_static(seed: int, precision: str = "double", **parameters: object) -> tuple[Record, dict[str, object]]:
    simulation = scenarios.simulate("gc/static", seed)
    scenario = simulation.scenario
    noise, root = scenario.filter_noise, math.sqrt(scenario.sample_time)
    return simulation.record, {
        "sample_time": scenario.sample_time,
        "gravity": scenario.gravity,
        "field_reference": "given",
        "field_dip": math.asin(0.6),
        "gyro_noise": noise.gyro_std * root,
        "gyro_bias_noise": noise.gyro_bias_walk,
        "accel_noise": noise.accel_std * root,
        "mag_noise": noise.mag_std * root,
        "precision": precision,
        **parameters,
    }


@pytest.mark.parametrize("name", ["mekf", "ukf"])
def test_the_filter_is_as_sure_of_tilt_as_the_steady_kalman_filter_of_one_axis(name: str) -> None:
    record, settings = gc_static(1)
    blind = replace(record, mag_valid=np.zeros(len(record), dtype=bool))
    n, k = float(settings["gyro_noise"]), float(settings["gyro_bias_noise"])  # type: ignore[arg-type]
    r = float(settings["accel_noise"]) / 9.8  # type: ignore[arg-type]
    std = make(name, **settings).run(blind).attitude_std
    assert std is not None
    np.testing.assert_allclose(std[-1, :2], math.sqrt(r * math.sqrt(n * n + 2 * k * r)), rtol=0.03)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", ["mekf", "ukf"])
def test_the_error_is_as_large_as_the_covariance_says(name: str, precision: str) -> None:
    ratios = []
    for seed in range(1, 5):
        record, settings = gc_static(seed, precision)
        result = make(name, **settings).run(record)
        error = quaternion.log(quaternion.multiply(quaternion.conjugate(record.q_true), result.q))
        assert result.attitude_std is not None
        ratios.append(np.mean((error[1000:] / result.attitude_std[1000:]) ** 2, axis=0))
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.35)


def test_the_unscented_filter_with_equal_weights_agrees_with_the_extended_one() -> None:
    record = noisy(tumbling(60.0, 0.01))
    mekf, ukf = (make(name).run(record) for name in ("mekf", "ukf"))
    late = record.time > 20.0
    assert np.max(angle_between(mekf.q, ukf.q)[late]) < 0.02 * DEG


def cubature(name: str, seed: int, **parameters: object) -> np.ndarray:
    """Samples at which the filter reset itself, with the source's noise levels."""
    simulation = scenarios.simulate(name, seed)
    scenario = simulation.scenario
    t = scenario.sample_time
    result = models.AdaptiveCKF(
        sample_time=t,
        gravity=scenario.gravity,
        process_noise="isotropic",
        quaternion_noise=math.sqrt(1e-4 / t),
        accel_noise=math.sqrt(t),
        heading_noise=math.sqrt(0.1 * t),
        initialisation="given",
        q0=tuple(simulation.q0),
        **parameters,
    ).run(simulation.record)
    assert np.all(np.isfinite(result.q))
    return np.flatnonzero(result.covariance_reset)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_textbook_estimate_of_the_process_noise_fails_where_it_should(seed: int) -> None:
    assert cubature("me/static", seed, adaptation="textbook", warm_up=0)[0] == 5
    assert cubature("gc/circ", seed, adaptation="textbook")[0] == pytest.approx(1346, abs=10)
    assert cubature("gc/lin", seed, adaptation="textbook")[0] == pytest.approx(4831, abs=50)
    assert len(cubature("ac/fixed-x", seed, adaptation="textbook")) == 0


@pytest.mark.parametrize("seed", [1, 2])
def test_the_misprinted_estimate_fails_in_the_swing_and_not_at_rest(seed: int) -> None:
    assert len(cubature("gc/static", seed, adaptation="printed", warm_up=0)) == 0
    assert cubature("ac/swing", seed, adaptation="printed", warm_up=0)[0] == pytest.approx(2657, abs=400)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("adaptation", ["none", "r_only", "qr_safe"])
@pytest.mark.parametrize("name", ["gc/circ", "ac/swing", "cg/hand"])
def test_the_other_estimates_never_fail(name: str, adaptation: str, precision: str) -> None:
    assert len(cubature(name, 1, adaptation=adaptation, precision=precision)) == 0


def test_the_measurement_noise_is_found_whatever_it_was_thought_to_be() -> None:
    record = noisy(at_rest(60.0, 0.01))
    low, high = (make("adaptive_ckf", accel_noise=n).run(record) for n in (0.02, 0.5))
    assert low.attitude_std is not None
    assert high.attitude_std is not None
    assert high.attitude_std[50, 0] > 2.0 * low.attitude_std[50, 0]
    np.testing.assert_allclose(low.attitude_std[-1, :2], high.attitude_std[-1, :2], rtol=0.02)

"""The loop gain matrix: which axis the error sees, and what leaks from tilt into heading."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from ahrs_fmu import quaternion
from ahrs_fmu.analysis.coupling import coupled_filter, error_model, gains_on_axes, scalar_error
from ahrs_fmu.analysis.design import SensorNoise, predict_attitude_rms, predict_rms
from ahrs_fmu.analysis.theory import Gains, complementary, discretise, filter_of
from ahrs_fmu.errors import DesignError

T = 0.02
DIP = math.radians(36.87)
OMEGA = np.geomspace(0.02, 20.0, 12)
TILTED = quaternion.from_euler(np.radians([20.0, -35.0, 70.0]))
ORDERS = [Gains(0.5), Gains(0.5, 0.1), Gains(1.0, 0.3, 0.05)]


def gc_static(mag: float = 0.1e-6) -> SensorNoise:
    """Noise of the published static experiment, as densities."""
    root = math.sqrt(T)
    return SensorNoise(
        gyro=math.radians(0.05) * root,
        bias_walk=math.radians(0.001) / root,
        accel=0.01 * root,
        mag=mag * root,
        field=50e-6,
        dip=DIP,
        gravity=9.8,
    )


def test_cross_products_of_both_vectors_see_the_axes_with_different_gain() -> None:
    gains = np.linalg.eigvalsh(error_model("coupled", DIP).gain)
    np.testing.assert_allclose(gains, [1.0 - math.sin(DIP), 1.0 + math.sin(DIP), 2.0], atol=1e-12)
    np.testing.assert_allclose(gains, [0.4, 1.6, 2.0], atol=1e-5)


@pytest.mark.parametrize("kind", ["coupled", "decoupled", "attitude"])
def test_loop_gain_is_the_derivative_of_the_filters_error(kind: str) -> None:
    north, east, down = quaternion.to_matrix(TILTED)
    field = math.cos(DIP) * north + math.sin(DIP) * down

    def error(turn: np.ndarray) -> np.ndarray:
        """Return the error of a filter that is at TILTED while the sensors are turned further by `turn`."""
        c = quaternion.to_matrix(quaternion.multiply(TILTED, quaternion.exp(turn)))
        accel, mag = -c[2], c.T @ [math.cos(DIP), 0.0, math.sin(DIP)]
        if kind == "coupled":
            return np.cross(accel, -down) + np.cross(mag, field)
        if kind == "attitude":
            d = -accel
            e = np.cross(d, mag) / np.linalg.norm(np.cross(d, mag))
            measured = quaternion.from_matrix(np.stack((np.cross(e, d), e, d)))
            return quaternion.log(quaternion.multiply(quaternion.conjugate(TILTED), measured))
        level = np.array([north, east, down]) @ mag
        return np.cross(accel, -down) - down * level[1] / math.hypot(level[0], level[1])

    step = 1e-6
    derivative = np.stack([(error(step * v) - error(-step * v)) / (2.0 * step) for v in np.eye(3)], axis=-1)
    np.testing.assert_allclose(error_model(kind, DIP, TILTED).gain, derivative, atol=1e-9)


@pytest.mark.parametrize("kind", ["coupled", "decoupled", "attitude"])
def test_noise_enters_the_error_as_its_derivative_says(kind: str) -> None:
    north, east, down = quaternion.to_matrix(TILTED)
    field = math.cos(DIP) * north + math.sin(DIP) * down

    def error(accel_noise: np.ndarray, mag_noise: np.ndarray) -> np.ndarray:
        accel, mag = -9.8 * down + accel_noise, field + mag_noise
        accel = accel / np.linalg.norm(accel)
        if kind == "coupled":
            return np.cross(accel, -down) + np.cross(mag / np.linalg.norm(mag), field)
        if kind == "attitude":
            d = -accel
            e = np.cross(d, mag) / np.linalg.norm(np.cross(d, mag))
            measured = quaternion.from_matrix(np.stack((np.cross(e, d), e, d)))
            return quaternion.log(quaternion.multiply(quaternion.conjugate(TILTED), measured))
        level = np.array([north, east, down]) @ mag
        return np.cross(accel, -down) - down * level[1] / math.hypot(level[0], level[1])

    model, step, none = error_model(kind, DIP, TILTED, gravity=9.8), 1e-6, np.zeros(3)
    from_accel = [(error(step * v, none) - error(-step * v, none)) / (2.0 * step) for v in np.eye(3)]
    from_mag = [(error(none, step * v) - error(none, -step * v)) / (2.0 * step) for v in np.eye(3)]
    np.testing.assert_allclose(model.accel_noise, np.stack(from_accel, axis=-1), atol=1e-9)
    np.testing.assert_allclose(model.mag_noise, np.stack(from_mag, axis=-1), atol=1e-9)


@pytest.mark.parametrize("gains", ORDERS)
@pytest.mark.parametrize(("sample_time", "motion"), [(None, None), (T, None), (T, 1.0)])
def test_one_axis_of_unit_gain_is_the_scalar_theory(
    gains: Gains, sample_time: float | None, motion: float | None
) -> None:
    g_a, g_b = gains_on_axes(gains, sample_time, scalar_error(), motion).respond(OMEGA)
    expected = filter_of(gains, sample_time, motion).respond(OMEGA)
    np.testing.assert_allclose(g_a[0, 0], expected[0], rtol=1e-7)
    np.testing.assert_allclose(g_b[0, 0], expected[1], rtol=1e-7)


@pytest.mark.parametrize("sample_time", [None, T])
def test_any_law_closes_the_loop_on_all_axes(sample_time: float | None) -> None:
    law = control.tf([2.0, 1.0], [1.0, 5.0])
    h = law if sample_time is None else discretise(law, sample_time)
    g_a, g_b = coupled_filter(h, error_model("coupled", DIP)).respond(OMEGA)
    expected = complementary(2.0 * h).respond(OMEGA)
    np.testing.assert_allclose(g_a[1, 1], expected[0], rtol=1e-9)
    np.testing.assert_allclose(g_b[1, 1], expected[1], rtol=1e-9)


@pytest.mark.parametrize("gains", ORDERS)
@pytest.mark.parametrize("sample_time", [None, T])
def test_axes_of_the_coupled_error_respond_like_filters_with_the_eigenvalue_as_gain(
    gains: Gains, sample_time: float | None
) -> None:
    error = error_model("coupled", DIP)
    values, vectors = np.linalg.eigh(error.gain)
    g_a, g_b = gains_on_axes(gains, sample_time, error).respond(OMEGA)
    each = [filter_of(gains.scaled(float(v)), sample_time).respond(OMEGA) for v in values]
    for found, modes in ((g_a, [a for a, _ in each]), (g_b, [b for _, b in each])):
        np.testing.assert_allclose(found, np.einsum("ik,kw,jk->ijw", vectors, modes, vectors), atol=1e-7)


def test_pitch_has_twice_the_gain_and_roll_and_heading_are_coupled() -> None:
    g_a, _ = gains_on_axes(Gains(0.5, 0.1), T, error_model("coupled", DIP)).respond(OMEGA)
    np.testing.assert_allclose(g_a[1, 1], filter_of(Gains(1.0, 0.2), T).respond(OMEGA)[0], rtol=1e-7)
    assert np.max(np.abs(g_a[[0, 1, 1, 2], [1, 0, 2, 1]])) < 1e-12
    assert np.max(np.abs(g_a[0, 2])) > 0.1


def test_roll_and_heading_of_the_coupled_error_are_decibels_off_the_nominal_response() -> None:
    omega = np.geomspace(0.02, 50.0, 400)
    g_a, g_b = gains_on_axes(Gains(0.5, 0.1), T, error_model("coupled", DIP)).respond(omega)
    nominal_a, nominal_b = filter_of(Gains(0.5, 0.1), T).respond(omega)
    assert round(20.0 * math.log10(np.max(np.abs(g_a[0, 0] / nominal_a))), 1) == 2.7
    at_a_tenth = float(np.interp(0.1, omega, 20.0 * np.log10(np.abs(g_b[2, 2] / nominal_b))))
    assert round(at_a_tenth, 1) == 7.7


def test_coupled_error_is_stable_up_to_half_the_gains_of_the_decoupled_one() -> None:
    ki = 400.0
    kp_limit = (4.0 - 2.0 * ki * T * T) / (4.0 * T)
    for factor, stable in ((0.999, True), (1.001, False)):
        poles = gains_on_axes(Gains(factor * kp_limit, ki), T, error_model("coupled", DIP)).poles
        assert (np.max(np.abs(poles)) < 1.0) == stable


@pytest.mark.parametrize("gains", ORDERS)
@pytest.mark.parametrize("sample_time", [None, T])
@pytest.mark.parametrize("kind", ["coupled", "decoupled", "attitude"])
def test_every_axis_of_every_error_shares_one_complementary_split(
    gains: Gains, sample_time: float | None, kind: str
) -> None:
    g_a, g_b = gains_on_axes(gains, sample_time, error_model(kind, DIP, TILTED)).respond(OMEGA)
    np.testing.assert_allclose(g_a + g_b, np.eye(3)[..., None] * np.ones(OMEGA.size), rtol=0, atol=1e-12)


def test_rotation_about_the_only_vector_follows_the_gyro_alone() -> None:
    g_a, g_b = gains_on_axes(Gains(0.5), T, error_model("coupled", DIP, mag_weight=0.0)).respond(OMEGA)
    np.testing.assert_allclose(g_a[2, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(g_b[2, 2], 1.0, rtol=1e-9)


@pytest.mark.parametrize("gains", [Gains(0.5, 0.1), Gains(1.0, 0.3, 0.05), Gains(1.56, 0.855)])
@pytest.mark.parametrize("sample_time", [None, T])
def test_covariance_of_one_axis_is_the_scalar_prediction(gains: Gains, sample_time: float | None) -> None:
    noise = gc_static().tilt
    variance = gains_on_axes(gains, sample_time, scalar_error()).covariance(
        noise.gyro, noise.bias_walk, noise.angle, 0.0
    )
    assert math.sqrt(variance[0, 0]) == pytest.approx(predict_rms(gains, noise, sample_time).total, rel=1e-6)


def test_heading_is_worse_than_its_own_formula_by_the_tilt_that_leaks_in() -> None:
    gains = Gains(0.5, 0.1)
    alone = predict_rms(gains, gc_static().heading)
    coupled = predict_attitude_rms(gains, gc_static(), T)
    assert math.degrees(alone.total) == pytest.approx(0.0263, abs=5e-5)
    assert math.degrees(coupled.heading) == pytest.approx(0.0328, rel=0.02)
    assert math.degrees(coupled.roll) == pytest.approx(0.0240, rel=0.02)
    assert coupled.roll == pytest.approx(coupled.pitch, rel=1e-9)


def test_a_bias_walk_on_a_first_order_filter_has_no_steady_error() -> None:
    assert predict_attitude_rms(Gains(0.5), gc_static(), T).roll == math.inf
    assert predict_rms(Gains(0.5), gc_static().tilt, T).total == math.inf


def test_a_vertical_field_and_an_unknown_error_are_refused() -> None:
    with pytest.raises(DesignError, match="vertical field"):
        error_model("decoupled", math.radians(90.0))
    with pytest.raises(DesignError, match="use decoupled, coupled or attitude"):
        error_model("euler", DIP)  # type: ignore[arg-type]
    with pytest.raises(DesignError, match="from sample to sample"):
        gains_on_axes(Gains(0.5), None, scalar_error(), 1.0)

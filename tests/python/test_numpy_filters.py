"""Equations of the numpy filters against independent ways to the same result."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.estimators import adaptive_ckf, cg_ekf, geometry, increments, matrices, ukf
from ahrs_fmu.estimators.model import NumpyModel
from ahrs_fmu.estimators.state import Sample
from motion import at_rest

RUNS = 500
RNG = np.random.default_rng(20)
ATTITUDES = quaternion.normalise(RNG.standard_normal((RUNS, 4)))
DIP = np.arctan2(3.0, 4.0)


def sample(force: np.ndarray, mag: np.ndarray) -> Sample:
    yes, no = np.ones(len(force), dtype=np.bool_), np.zeros(len(force), dtype=np.bool_)
    field = np.tile(5e-5 * np.array([np.cos(DIP), np.sin(DIP)]), (len(force), 1))
    return Sample(0 * force, force, force, mag, no, yes, yes, yes, no, no, yes, field, 0.01, 0.01)


def noisy_sample(noise: float) -> Sample:
    """Directions of gravity and field at `ATTITUDES`, disturbed."""
    back = quaternion.conjugate(ATTITUDES)
    force = quaternion.rotate(back, [0.0, 0.0, -9.8]) + 9.8 * noise * RNG.standard_normal((RUNS, 3))
    mag = quaternion.rotate(back, [4e-5, 0.0, 3e-5]) + 5e-5 * noise * RNG.standard_normal((RUNS, 3))
    return sample(force, mag)


def wahba(z: Sample) -> np.ndarray:
    """Attitude of least squared misfit of both directions, by singular values."""
    nav = np.array([[0.0, 0.0, -1.0], [np.cos(DIP), 0.0, np.sin(DIP)]])
    measured = np.stack((geometry.unit(z.accel), geometry.unit(z.mag)), axis=-2)
    u, _, vt = np.linalg.svd(np.einsum("ki,...kj->...ij", nav, measured))
    proper = np.zeros((RUNS, 3, 3))
    proper[:, [0, 1], [0, 1]] = 1.0
    proper[:, 2, 2] = np.linalg.det(u) * np.linalg.det(vt)
    return quaternion.from_matrix(u @ proper @ vt)


def angle(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.linalg.norm(quaternion.log(quaternion.multiply(quaternion.conjugate(p), q)), axis=-1)


def near_start(q: np.ndarray, spread: float) -> np.ndarray:
    return quaternion.multiply(q, quaternion.exp(spread * RNG.standard_normal((len(q), 3))))


def test_conjugate_gradients_find_the_solution_of_wahbas_problem() -> None:
    z = noisy_sample(0.05)
    found = cg_ekf.conjugate_gradient(200, near_start(ATTITUDES, 0.3), z)
    assert angle(found, wahba(z)).max() < 1e-7


def test_four_conjugate_gradients_are_enough_from_three_degrees_away() -> None:
    z = noisy_sample(0.0)
    found = cg_ekf.conjugate_gradient(4, near_start(ATTITUDES, np.radians(3.0) / 2.0), z)
    assert np.median(angle(found, ATTITUDES)) < 2e-5


def test_the_joint_attitude_is_exact_for_every_attitude() -> None:
    z = noisy_sample(0.0)
    assert angle(geometry.attitude_of(z.accel, z.mag), ATTITUDES).max() < 2e-15


def numerical(function: object, q: np.ndarray, h: float = 1e-6) -> np.ndarray:
    columns = [(function(q + h * e) - function(q - h * e)) / (2 * h) for e in np.eye(4)]  # type: ignore[operator]
    return np.stack(columns, axis=-1)


def test_the_jacobian_of_the_directions_is_their_derivative() -> None:
    one, reference = np.ones(RUNS), np.tile([np.cos(DIP), np.sin(DIP)], (RUNS, 1))

    def directions(q: np.ndarray) -> np.ndarray:
        return cg_ekf.quadratic(one, reference, q, q)

    jacobian = cg_ekf.jacobian_of(one, reference, ATTITUDES)
    np.testing.assert_allclose(jacobian, numerical(directions, ATTITUDES), atol=1e-9)
    back = quaternion.conjugate(ATTITUDES)
    expected = [quaternion.rotate(back, v) for v in ([0, 0, -1], [np.cos(DIP), 0, np.sin(DIP)])]
    np.testing.assert_allclose(directions(ATTITUDES), np.concatenate(expected, axis=-1), atol=1e-14)


def test_the_jacobian_of_force_and_heading_is_their_derivative() -> None:
    p = SimpleNamespace(gravity=9.8)
    level = np.abs(geometry.down_of(ATTITUDES)[:, 0]) < 0.98
    q = ATTITUDES[level]
    heading = adaptive_ckf.heading_of(q)
    derivative = numerical(lambda x: adaptive_ckf.expected(p, x, heading), q)
    np.testing.assert_allclose(adaptive_ckf.jacobian(p, q), derivative, rtol=1e-6, atol=1e-6)


def test_the_line_search_finds_the_least_of_the_quartic() -> None:
    e0, e1, e2 = RNG.standard_normal((3, RUNS, 6)) * np.array([1.0, 3.0, 0.2])[:, None, None]
    length = cg_ekf.line_minimum(e0, e1, e2)

    def value(k: np.ndarray) -> np.ndarray:
        return np.sum((e0 + k[:, None] * e1 + k[:, None] ** 2 * e2) ** 2, axis=-1)

    for step in (-1e-4, 1e-4):
        assert (value(length) <= value(length + step)).all()


@pytest.mark.parametrize(("order", "error"), [(1, 1e-4), (2, 5e-5), (4, 2e-8)])
def test_increments_turn_by_their_angle_to_their_order(order: int, error: float) -> None:
    d = 0.1 * geometry.unit(RNG.standard_normal((RUNS, 3)))
    turned = quaternion.normalise(increments.increment(d, order))
    assert angle(turned, quaternion.exp(d)).max() < error
    np.testing.assert_allclose(increments.increment(30.0 * d, order), quaternion.exp(30.0 * d), atol=1e-15)


def test_the_right_matrix_multiplies_from_the_right() -> None:
    r = RNG.standard_normal((RUNS, 4))
    product = matrices.apply(increments.right_matrix(r), ATTITUDES)
    np.testing.assert_allclose(product, quaternion.multiply(ATTITUDES, r), atol=1e-14)


def test_cholesky_factors_are_those_of_lapack_and_nan_where_there_is_none() -> None:
    a = RNG.standard_normal((RUNS, 6, 6))
    good = a @ matrices.transposed(a) + 0.1 * np.eye(6)
    np.testing.assert_allclose(matrices.cholesky(good), np.linalg.cholesky(good), rtol=1e-9, atol=1e-12)
    with np.errstate(invalid="ignore"):
        assert not matrices.all_finite(matrices.cholesky(-good)).any()


def test_eigenvalues_are_brought_between_their_limits() -> None:
    a = matrices.symmetric(RNG.standard_normal((RUNS, 4, 4)))
    values = np.linalg.eigvalsh(matrices.bounded(a, 0.1, 1.0))
    np.testing.assert_allclose(values, np.clip(np.linalg.eigvalsh(a), 0.1, 1.0), atol=1e-12)


@pytest.mark.parametrize(("alpha", "beta", "kappa"), [(1.0, 0.0, 0.0), (0.1, 2.0, 1.0)])
def test_sigma_points_carry_the_covariance_they_are_made_of(alpha: float, beta: float, kappa: float) -> None:
    spread, mean_weights, weights = ukf.sigma_weights(SimpleNamespace(alpha=alpha, beta=beta, kappa=kappa))
    a = RNG.standard_normal((RUNS, 6, 6))
    covariance = a @ matrices.transposed(a) + np.eye(6)
    points = ukf.sigma_points(spread, covariance)
    np.testing.assert_allclose(mean_weights.sum(), 1.0, rtol=1e-12)
    np.testing.assert_allclose(ukf.mean_of(mean_weights, points), 0.0, atol=1e-12)
    np.testing.assert_allclose(ukf.moment(weights, points, points), covariance, rtol=1e-9, atol=1e-9)


def test_a_tilt_error_decays_with_the_decoupled_gain() -> None:
    """5 deg fall to 5 exp(-kp t)."""
    record = at_rest(4.0, 0.01, (np.radians(5.0), 0.0, 0.0))
    descriptor = descriptors.load("gcf")
    model = NumpyModel(descriptor)
    settings = {"initialisation": "given", "ki": 0.0, "kp": 0.5}
    for name, value in settings.items():
        model.set(name, descriptor.numbers(descriptor.parameter(name), value))
    columns = {"gyro": record.gyro, "accel": record.accel, "mag": record.mag}
    roll = np.degrees(model.run(record.steps, columns, ("roll",))["roll"])
    np.testing.assert_allclose(5.0 - roll[-1], 5.0 * np.exp(-0.5 * 4.0), rtol=0.01)

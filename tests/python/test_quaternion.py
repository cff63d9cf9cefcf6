from __future__ import annotations

import numpy as np
import pytest

from ahrs_fmu import frames, quaternion
from ahrs_fmu.frames import Frame


@pytest.fixture
def random_attitudes() -> np.ndarray:
    return quaternion.normalise(np.random.default_rng(1).normal(size=(500, 4)))


def same_rotation(p: np.ndarray, q: np.ndarray) -> float:
    return float(
        np.max(np.linalg.norm(quaternion.log(quaternion.multiply(quaternion.conjugate(p), q)), axis=-1))
    )


def test_rotating_a_vector_equals_its_matrix(random_attitudes: np.ndarray) -> None:
    v = np.random.default_rng(2).normal(size=(500, 3))
    by_matrix = np.einsum("nij,nj->ni", quaternion.to_matrix(random_attitudes), v)
    np.testing.assert_allclose(quaternion.rotate(random_attitudes, v), by_matrix, atol=1e-14)


def test_matrix_and_euler_angles_return_the_same_rotation(random_attitudes: np.ndarray) -> None:
    assert (
        same_rotation(random_attitudes, quaternion.from_matrix(quaternion.to_matrix(random_attitudes))) < 1e-7
    )
    assert (
        same_rotation(random_attitudes, quaternion.from_euler(quaternion.to_euler(random_attitudes))) < 1e-7
    )


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.1, 3.0])
def test_log_inverts_exp(size: float) -> None:
    v = np.random.default_rng(3).normal(size=(50, 3))
    v *= size / np.linalg.norm(v, axis=-1, keepdims=True)
    np.testing.assert_allclose(quaternion.log(quaternion.exp(v)), v, atol=1e-14)


def test_frames_keep_the_physical_direction(random_attitudes: np.ndarray) -> None:
    v_frd = np.random.default_rng(4).normal(size=(500, 3))
    ned = quaternion.rotate(random_attitudes, v_frd)
    enu = quaternion.rotate(
        frames.attitude(random_attitudes, Frame.NED, Frame.ENU),
        frames.body_vector(v_frd, Frame.NED, Frame.ENU),
    )
    np.testing.assert_allclose(enu, ned[:, [1, 0, 2]] * [1, 1, -1], atol=1e-14)

from __future__ import annotations

import numpy as np
import pytest

from ahrs_fmu import frames, quaternion
from ahrs_fmu.errors import RecordError
from ahrs_fmu.frames import Frame
from ahrs_fmu.metrics import attitude_error, wrap


@pytest.fixture
def truth() -> np.ndarray:
    return quaternion.normalise(np.random.default_rng(1).normal(size=(200, 4)))


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.5, 3.0])
def test_a_turn_about_the_vertical_is_heading_only(truth: np.ndarray, angle: float) -> None:
    error = attitude_error(quaternion.multiply(quaternion.exp([0.0, 0.0, -angle]), truth), truth)
    np.testing.assert_allclose(error.heading, angle, rtol=1e-6)
    np.testing.assert_allclose(error.total, angle, rtol=1e-6)
    assert error.inclination.max() < 1e-15 * 10


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.5, 3.0])
def test_a_turn_about_a_horizontal_axis_is_inclination_only(truth: np.ndarray, angle: float) -> None:
    error = attitude_error(quaternion.multiply(quaternion.exp([0.6 * angle, 0.8 * angle, 0.0]), truth), truth)
    np.testing.assert_allclose(error.inclination, angle, rtol=1e-6)
    np.testing.assert_allclose(error.total, angle, rtol=1e-6)
    assert error.heading.max() < 1e-14


def test_heading_and_inclination_compose_to_the_total(truth: np.ndarray) -> None:
    estimate = quaternion.normalise(np.random.default_rng(2).normal(size=(200, 4)))
    error = attitude_error(estimate, truth)
    # The error is a turn about the vertical followed by a tilt, whose half angles multiply.
    np.testing.assert_allclose(
        np.cos(error.total / 2), np.cos(error.heading / 2) * np.cos(error.inclination / 2), atol=1e-14
    )


def test_the_sign_of_a_quaternion_and_the_frame_do_not_matter(truth: np.ndarray) -> None:
    estimate = quaternion.multiply(quaternion.exp([0.1, -0.2, 0.3]), truth)
    ned = attitude_error(-estimate, truth)
    enu = attitude_error(
        frames.attitude(estimate, Frame.NED, Frame.ENU), frames.attitude(truth, Frame.NED, Frame.ENU)
    )
    for name in ("total", "heading", "inclination"):
        np.testing.assert_allclose(getattr(ned, name), getattr(enu, name), atol=1e-14)


def test_yaw_errors_are_wrapped() -> None:
    estimate, true = quaternion.from_euler(np.radians([[0, 0, 179.0], [0, 0, -179.0]]))
    error = attitude_error([estimate], [true])
    np.testing.assert_allclose(np.degrees(error.euler[0, 2]), -2.0)
    assert wrap(-np.pi) == np.pi


def test_rms_counts_what_is_known_and_evaluated_only() -> None:
    true = np.tile(quaternion.IDENTITY, (4, 1))
    true[0] = np.nan
    estimate = quaternion.exp([[0, 0, 1.0], [0, 0, 0.3], [0, 0, 0.4], [0, 0, 2.0]])
    rms = attitude_error(estimate, true).rms(np.array([True, True, True, False]))
    assert rms.heading == pytest.approx(np.sqrt((0.3**2 + 0.4**2) / 2))
    assert rms.degrees()["yaw"] == pytest.approx(np.degrees(rms.yaw))


def test_a_lost_estimate_is_not_overlooked() -> None:
    true = np.tile(quaternion.IDENTITY, (3, 1))
    estimate = true.copy()
    estimate[1] = np.nan
    assert np.isnan(attitude_error(estimate, true).rms().total)


def test_nothing_to_compare_with_is_an_error() -> None:
    lost = np.full((3, 4), np.nan)
    with pytest.raises(RecordError, match="nothing to compare"):
        attitude_error(np.tile(quaternion.IDENTITY, (3, 1)), lost).rms()

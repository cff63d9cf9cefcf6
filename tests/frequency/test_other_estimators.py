"""The small-signal responses of the other estimators, against the filters they amount to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ahrs_fmu import descriptors
from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.design import noise_of_samples, sampled_kalman_gains
from ahrs_fmu.analysis.equivalent import Equivalent, equivalent
from ahrs_fmu.analysis.linear_model import linearise
from ahrs_fmu.analysis.measure import plan, stepped_sine
from ahrs_fmu.analysis.theory import Gains, filter_of
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.errors import DesignError

T = 0.01
PITCH = 1
OMEGA = np.geomspace(0.02, 30.0, 14)


def core(model: str, **parameters: float) -> CoreStepper:
    return CoreStepper(descriptors.load(model), {"sample_time": T, **parameters})


def nearest(model: str, axis: int = PITCH) -> Equivalent:
    schedule = plan("angle", OMEGA, amplitude=math.radians(1.0))
    return equivalent(stepped_sine(core(model), schedule, T, axis), T)


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
    assert found.gains.order == order
    assert found.crossover == pytest.approx(corner, rel=0.02)
    assert found.lag is None
    assert found.mismatch_db < mismatch


def test_mahony_ekf_is_mahony_with_the_low_pass_of_the_kalman_filter_behind_it() -> None:
    found, alone, behind = nearest("mahony_ekf"), nearest("mahony"), nearest("improved_ekf")
    assert found.crossover == pytest.approx(alone.crossover, rel=0.03)
    assert found.lag is not None
    assert found.lag == pytest.approx(-math.log(1.0 - behind.gains.kp * T) / T, rel=0.03)
    assert found.mismatch_db < 0.15


def test_adaptive_ckf_is_a_low_pass_of_about_six_rad_per_second_only_roughly() -> None:
    found = nearest("adaptive_ckf")
    assert found.crossover == pytest.approx(6.5, rel=0.15)
    assert 0.5 < found.mismatch_db < 3.0


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

"""Responses measured by stepping, against the exact theory of the sampled filter."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

import numpy as np
import pytest

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.coupling import error_model, gains_on_axes
from ahrs_fmu.analysis.equivalent import equivalent
from ahrs_fmu.analysis.linear_model import linearise
from ahrs_fmu.analysis.measure import (
    OperatingPoint,
    deviation,
    harmonics,
    multisine,
    plan,
    shared_stepped_sine,
    stepped_sine,
)
from ahrs_fmu.analysis.theory import Gains, crossover, filter_of
from ahrs_fmu.cosim import opening
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.stepper import Port
from ahrs_fmu.errors import DesignError

T = 0.02
OMEGA = np.geomspace(0.02, 20.0, 30)
FEW = np.geomspace(0.02, 20.0, 7)
FIRST, SECOND, THIRD = Gains(0.5), Gains(0.5, 0.1), Gains(1.0, 0.3, 0.05)
TILTED = OperatingPoint(attitude=quaternion.from_euler(np.radians([25.0, -30.0, 130.0])))


def parameters_of(gains: Gains) -> dict[str, object]:
    return {"kp": gains.kp, "ki": gains.ki, "kii": gains.kii, "sample_time": T}


def gcf(gains: Gains, more: Mapping[str, object] | None = None) -> CoreStepper:
    return CoreStepper(descriptors.load("gcf"), {**parameters_of(gains), **(more or {})})


def worst(measured: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Return the largest deviation in dB and in degrees."""
    found = deviation(measured, expected)
    return float(np.max(np.abs(found.magnitude_db))), math.degrees(float(np.max(np.abs(found.phase))))


@pytest.mark.parametrize(
    ("gains", "path", "axis", "realisation"),
    [
        (FIRST, "angle", 0, "quaternion"),
        (SECOND, "angle", 1, "quaternion"),
        (THIRD, "angle", 2, "vector"),
        (FIRST, "rate", 2, "dcm"),
        (SECOND, "rate", 0, "euler"),
        (THIRD, "rate", 1, "quaternion"),
    ],
)
def test_decoupled_filter_has_the_response_of_the_theory(
    gains: Gains, path: str, axis: int, realisation: str
) -> None:
    expected = filter_of(gains, T)
    response = stepped_sine(gcf(gains, {"realisation": realisation}), plan(path, OMEGA, expected), T, axis)
    decibels, degrees = worst(response.main, expected.respond(OMEGA)[path == "rate"])
    assert decibels < 0.01
    assert degrees < 0.05
    assert np.all(response.coherence > 0.9999)


@pytest.mark.slow
@pytest.mark.parametrize("realisation", ["quaternion", "vector", "dcm", "euler"])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("path", ["angle", "rate"])
@pytest.mark.parametrize("gains", [FIRST, SECOND, THIRD])
def test_every_order_axis_and_realisation_has_the_response_of_the_theory(
    gains: Gains, path: str, axis: int, realisation: str
) -> None:
    expected = filter_of(gains, T)
    response = stepped_sine(gcf(gains, {"realisation": realisation}), plan(path, OMEGA, expected), T, axis)
    decibels, degrees = worst(response.main, expected.respond(OMEGA)[path == "rate"])
    assert decibels < 0.01
    assert degrees < 0.05


@pytest.mark.slow
def test_the_numpy_class_has_the_response_of_the_theory() -> None:
    expected = filter_of(SECOND, T)
    numpy_class = CoreStepper(descriptors.load("gcf"), parameters_of(SECOND), back_end="numpy")
    schedule = plan("angle", [2.0, 10.0], expected, settle=30.0)
    response = stepped_sine(numpy_class, schedule, T, 1)
    decibels, degrees = worst(response.main, expected.respond(schedule.omega)[0])
    assert decibels < 0.01
    assert degrees < 0.05


@pytest.mark.parametrize(
    ("amplitude", "decibels", "degrees"), [(1.0, 0.0005, 0.0015), (5.0, 0.0085, 0.0325), (20.0, 0.1345, 0.51)]
)
def test_deviation_from_theory_grows_with_the_square_of_the_angle(
    amplitude: float, decibels: float, degrees: float
) -> None:
    """Largest over all axes and 0.05 to 5 rad/s, as in section 6 of docs/algorithms.md."""
    expected, omega = filter_of(SECOND, T), np.geomspace(0.05, 5.0, 15)
    found = []
    for axis in range(3):
        response = stepped_sine(gcf(SECOND), plan("angle", omega, expected, math.radians(amplitude)), T, axis)
        found.append(worst(response.main, expected.respond(omega)[0]))
    largest = np.max(found, axis=0)
    assert np.all(largest < [decibels, degrees])
    assert np.all(largest > 0.5 * np.array([decibels, degrees]))


def test_response_does_not_depend_on_where_the_vehicle_points() -> None:
    expected = filter_of(SECOND, T)
    response = stepped_sine(gcf(SECOND), plan("angle", FEW, expected, math.radians(1.0)), T, 0, TILTED)
    error = error_model("decoupled", TILTED.dip, TILTED.attitude)
    g_a, _ = gains_on_axes(SECOND, T, error).respond(FEW)
    np.testing.assert_allclose(response.gain, g_a[:, 0].T, atol=3e-4)


def test_error_between_attitudes_has_unit_gain_without_leaks() -> None:
    expected = filter_of(SECOND, T)
    response = stepped_sine(gcf(SECOND, {"form": "attitude"}), plan("angle", FEW, expected), T, 0)
    assert worst(response.main, expected.respond(FEW)[0])[0] < 0.01
    assert np.max(np.abs(response.gain[:, 1:])) < 1e-6


@pytest.mark.parametrize("path", ["angle", "rate"])
def test_coupled_pitch_has_twice_the_gain(path: str) -> None:
    expected = filter_of(SECOND.scaled(2.0), T)
    response = stepped_sine(gcf(SECOND, {"error": "coupled"}), plan(path, OMEGA, expected), T, 1)
    decibels, degrees = worst(response.main, expected.respond(OMEGA)[path == "rate"])
    assert decibels < 0.01
    assert degrees < 0.05


@pytest.mark.parametrize("axis", [0, 2])
def test_coupled_roll_and_heading_follow_the_loop_gain_matrix(axis: int) -> None:
    g_a, _ = gains_on_axes(SECOND, T, error_model("coupled", OperatingPoint().dip)).respond(FEW)
    schedule = plan("angle", FEW, filter_of(SECOND.scaled(0.4), T), math.radians(1.0))
    response = stepped_sine(gcf(SECOND, {"error": "coupled"}), schedule, T, axis)
    np.testing.assert_allclose(response.gain, g_a[:, axis].T, atol=2e-4)


def test_motion_compensation_has_the_response_of_the_theory() -> None:
    tau = 2.0
    expected = filter_of(SECOND, T, tau)
    compensated = gcf(SECOND, {"motion_compensation": True, "motion_time_constant": tau})
    omega = FEW[FEW > 0.1]
    response = stepped_sine(compensated, plan("angle", omega, expected, math.radians(1.0)), T, 1)
    decibels, degrees = worst(response.main, expected.respond(omega)[0])
    assert decibels < 0.02
    assert degrees < 0.1


@pytest.mark.parametrize("path", ["angle", "rate"])
def test_a_sum_of_sines_gives_the_same_response_in_one_run(path: str) -> None:
    expected = filter_of(THIRD, T)
    schedule = plan(path, OMEGA, expected, math.radians(1.0))
    response = multisine(gcf(THIRD), schedule, T, 1)
    decibels, degrees = worst(response.main, expected.respond(OMEGA)[path == "rate"])
    assert decibels < 0.02
    assert degrees < 0.1


@pytest.mark.parametrize(("points", "found"), [(30, 30), (4, 4), (2000, 1000)])
def test_harmonics_are_spread_over_the_band(points: int, found: int) -> None:
    omega = harmonics(0.02, 20.0, points)
    assert omega.size == found
    assert omega[0] == 0.02
    assert omega[-1] == pytest.approx(20.0)
    np.testing.assert_allclose(omega / 0.02, np.round(omega / 0.02), rtol=1e-12)


def test_a_sum_of_harmonics_takes_one_period_of_the_lowest() -> None:
    expected = filter_of(SECOND, T)
    omega = harmonics(0.1, 20.0, 30)
    schedule = plan("angle", omega, expected, math.radians(1.0))
    response = multisine(gcf(SECOND), schedule, T, 1)
    assert response.steps * T == pytest.approx(2.0 * math.pi / 0.1 + schedule.settle, abs=2 * T)
    decibels, degrees = worst(response.main, expected.respond(omega)[0])
    assert decibels < 0.02
    assert degrees < 0.1


def test_error_bars_grow_when_the_signal_is_disturbed() -> None:
    expected = filter_of(SECOND, T)
    small, large = (
        stepped_sine(gcf(SECOND), plan("angle", FEW, expected, math.radians(angle), settle=120.0), T, 0)
        for angle in (5.0, 40.0)
    )
    assert np.all(large.error_db > 5.0 * small.error_db)
    assert np.all(large.coherence < small.coherence)
    assert np.all(np.degrees(large.error_phase) > 0.0)


@pytest.mark.slow
def test_workers_share_the_frequencies_and_give_the_same_numbers() -> None:
    expected = filter_of(SECOND, T)
    schedule = plan("angle", [0.5, 5.0], expected)
    done: list[int] = []
    alone = stepped_sine(gcf(SECOND), schedule, T, 1)
    everywhere = partial(opening.core, "gcf", parameters_of(SECOND))
    (shared,) = shared_stepped_sine(everywhere, [schedule], T, 1, progress=done.append)
    np.testing.assert_array_equal(alone.gain, shared.gain)
    assert done == [1, 1]


@pytest.mark.parametrize("gains", [FIRST, SECOND])
def test_equivalent_gains_of_the_filter_are_its_own(gains: Gains) -> None:
    for path in ("angle", "rate"):
        response = multisine(gcf(gains), plan(path, FEW, filter_of(gains, T), math.radians(1.0)), T, 2)
        nearest = equivalent(response, T)
        assert isinstance(nearest.law, Gains)
        assert nearest.law.order == gains.order
        assert nearest.law.kp == pytest.approx(gains.kp, rel=1e-3)
        assert nearest.law.ki == pytest.approx(gains.ki, rel=1e-3)
        assert nearest.lag is None
        assert nearest.mismatch_db < 0.02
        assert nearest.crossover == pytest.approx(crossover(filter_of(gains, T)), rel=1e-3)


@pytest.mark.parametrize("gains", [FIRST, SECOND, THIRD])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_linear_model_has_the_poles_of_the_theory(gains: Gains, axis: int) -> None:
    model = linearise(gcf(gains), T, axes=(axis,))
    found = np.sort_complex(systems.poles(model))
    np.testing.assert_allclose(found, np.sort_complex(filter_of(gains, T).poles), rtol=0, atol=1e-6)


def test_linear_model_has_the_response_of_the_theory_on_all_axes() -> None:
    model = linearise(gcf(SECOND, {"error": "coupled"}), T)
    g_a, _ = gains_on_axes(SECOND, T, error_model("coupled", OperatingPoint().dip)).respond(FEW)
    np.testing.assert_allclose(systems.response(model, FEW)[:3, :3], g_a, atol=1e-5)


def test_gains_of_the_filter_stand_in_the_direct_part_of_its_linear_model() -> None:
    _, _, _, direct = systems.matrices(linearise(gcf(SECOND), T, axes=(1,)))
    np.testing.assert_allclose(direct[:, 0], [SECOND.kp * T, -SECOND.ki * T], rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: plan("angle", [-1.0, 1.0]), "frequency = -1 rad/s"),
        (lambda: plan("angle", []), "give positive, finite frequencies"),
        (lambda: plan("angle", [200.0], filter_of(SECOND, T)), "half the sample rate, 157.08 rad/s"),
        (lambda: plan("angle", [1.0], amplitude=math.radians(80.0)), "amplitude = 80 deg"),
        (lambda: plan("angle", [1.0], periods=0), "periods = 0"),
        (lambda: stepped_sine(gcf(SECOND), plan("angle", [200.0]), T), "half the sample rate"),
        (lambda: stepped_sine(gcf(SECOND), plan("angle", [1.0]), T, 3), "axis = 3"),
        (lambda: plan("angle", [1.0], filter_of(Gains(120.0), T)), "unstable"),
    ],
)
def test_impossible_measurements_are_refused_in_one_line(make, words: str) -> None:
    with pytest.raises(DesignError) as refusal:
        make()
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_what_is_no_attitude_estimator_is_refused_by_the_names_it_lacks() -> None:
    class Gyroscope(CoreStepper):
        inputs = MappingProxyType({"gyro": Port()})
        outputs = MappingProxyType({"rate": Port()})

    with pytest.raises(DesignError, match="no variable accel, mag, q"):
        stepped_sine(Gyroscope(descriptors.load("gcf")), plan("angle", [1.0]), T)

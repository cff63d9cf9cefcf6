"""The frequency response of the shipped FMUs, against theory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.coupling import error_model, gains_on_axes
from ahrs_fmu.analysis.equivalent import small_signal
from ahrs_fmu.analysis.linear_model import linearise
from ahrs_fmu.analysis.measure import (
    OperatingPoint,
    deviation,
    multisine,
    plan,
    shared_stepped_sine,
    stepped_sine,
)
from ahrs_fmu.analysis.theory import Gains, LowPass, filter_of
from ahrs_fmu.cosim import opening
from ahrs_fmu.cosim.fmu import Fmu, FmuStepper
from ahrs_fmu.errors import DesignError
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.variant import Fmi

T = 0.02
OMEGA = np.geomspace(0.02, 20.0, 30)
FIRST, SECOND, THIRD = Gains(0.5), Gains(0.5, 0.1), Gains(1.0, 0.3, 0.05)
EVERYTHING = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fmus")


@pytest.fixture(scope="module")
def gcf_file(folder: Path) -> Callable[[Fmi], Path]:
    return lambda fmi: build_fmu("gcf", fmi=fmi, output=folder)


@pytest.fixture(scope="module")
def gcf_fmu(gcf_file: Callable[[Fmi], Path]) -> Iterator[Fmu]:
    with Fmu(gcf_file("3")) as fmu:
        yield fmu


def gcf(fmu: Fmu, gains: Gains, realisation: str = "quaternion", error: str = "decoupled") -> FmuStepper:
    return fmu.instantiate(parameters(gains) | {"realisation": realisation, "error": error})


def parameters(gains: Gains) -> dict[str, float | str]:
    return {"kp": gains.kp, "ki": gains.ki, "kii": gains.kii, "sample_time": T}


def assert_response(
    stepper: FmuStepper, gains: Gains, path: str, axis: int, omega: np.ndarray = OMEGA
) -> None:
    expected = filter_of(gains, T)
    response = stepped_sine(stepper, plan(path, omega, expected), T, axis)
    found = deviation(response.main, expected.respond(omega)[path == "rate"])
    assert np.max(np.abs(found.magnitude_db)) < 0.01
    assert math.degrees(np.max(np.abs(found.phase))) < 0.05


@pytest.mark.parametrize(("gains", "path", "axis"), [(SECOND, "angle", 0), (THIRD, "rate", 2)])
def test_fmu_has_the_response_of_the_theory(gcf_fmu: Fmu, gains: Gains, path: str, axis: int) -> None:
    assert_response(gcf(gcf_fmu, gains), gains, path, axis, OMEGA[::4])


@EVERYTHING
@pytest.mark.parametrize("realisation", ["quaternion", "vector", "dcm", "euler"])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("path", ["angle", "rate"])
@pytest.mark.parametrize("gains", [FIRST, SECOND, THIRD])
def test_fmu_has_the_response_of_the_theory_at_every_order_axis_and_realisation(
    gcf_fmu: Fmu, gains: Gains, path: str, axis: int, realisation: str
) -> None:
    assert_response(gcf(gcf_fmu, gains, realisation), gains, path, axis)


@EVERYTHING
@pytest.mark.parametrize("path", ["angle", "rate"])
def test_coupled_pitch_of_the_fmu_has_twice_the_gain(gcf_fmu: Fmu, path: str) -> None:
    assert_response(gcf(gcf_fmu, SECOND, error="coupled"), SECOND.scaled(2.0), path, 1)


@EVERYTHING
def test_coupled_roll_of_the_fmu_follows_the_loop_gain_matrix(gcf_fmu: Fmu) -> None:
    omega = OMEGA[::4]
    g_a, _ = gains_on_axes(SECOND, T, error_model("coupled", OperatingPoint().dip)).respond(omega)
    schedule = plan("angle", omega, filter_of(SECOND.scaled(0.4), T), math.radians(1.0))
    response = stepped_sine(gcf(gcf_fmu, SECOND, error="coupled"), schedule, T, 0)
    np.testing.assert_allclose(response.gain, g_a[:, 0].T, atol=2e-4)


@pytest.mark.parametrize(
    ("fmi", "omega"),
    [
        ("3", [2.0, 10.0]),
        pytest.param("2", OMEGA[9::4], marks=EVERYTHING),
        pytest.param("3", OMEGA, marks=EVERYTHING),
    ],
)
def test_an_fmu_of_the_python_back_end_has_the_response_of_the_theory(
    folder: Path, fmi: Fmi, omega: np.ndarray
) -> None:
    gains = Gains(2.0, 1.0)  # that soon forget how they began
    with Fmu(build_fmu("gcf", fmi=fmi, backend="python", output=folder / "python")) as fmu:
        assert_response(fmu.instantiate(parameters(gains)), gains, "angle", 1, omega)


def test_the_kcf_fmu_is_a_low_pass_of_second_order(folder: Path) -> None:
    with Fmu(build_fmu("kcf", fmi="3", output=folder)) as fmu:
        found = small_signal(fmu.instantiate({"sample_time": T}), T)
    assert isinstance(found.law, LowPass)
    assert found.law.natural_frequency == pytest.approx(math.sqrt(2.0) / 3.5, rel=0.015)


@EVERYTHING
@pytest.mark.parametrize("fmi", ["2", "3-scalar"])
def test_other_fmi_versions_have_the_same_response(gcf_file: Callable[[Fmi], Path], fmi: Fmi) -> None:
    with Fmu(gcf_file(fmi)) as fmu:
        assert_response(fmu.instantiate(parameters(SECOND)), SECOND, "angle", 1, OMEGA[::4])


def test_a_sum_of_sines_measures_the_fmu_in_one_run(gcf_fmu: Fmu) -> None:
    expected, omega = filter_of(SECOND, T), OMEGA[6::3]
    response = multisine(gcf(gcf_fmu, SECOND), plan("angle", omega, expected, math.radians(1.0)), T, 2)
    found = deviation(response.main, expected.respond(omega)[0])
    assert np.max(np.abs(found.magnitude_db)) < 0.01
    assert math.degrees(np.max(np.abs(found.phase))) < 0.05


@EVERYTHING
def test_processes_open_the_fmu_and_share_the_frequencies(gcf_file: Callable[[Fmi], Path]) -> None:
    expected = filter_of(SECOND, T)
    schedule = plan("angle", [1.0, 10.0], expected)
    opened = partial(opening.fmu, gcf_file("3"), parameters(SECOND))
    (response,) = shared_stepped_sine(opened, [schedule], T)
    assert np.max(np.abs(deviation(response.main, expected.respond(schedule.omega)[0]).magnitude_db)) < 0.01


@EVERYTHING
def test_linear_model_of_an_fmu_of_the_python_back_end_has_the_same_poles(folder: Path) -> None:
    with Fmu(build_fmu("gcf", fmi="3", backend="python", output=folder / "python")) as fmu:
        model = linearise(gcf(fmu, SECOND), T, axes=(1,), settle=10.0)
    found = np.sort_complex(systems.poles(model))
    np.testing.assert_allclose(found, np.sort_complex(filter_of(SECOND, T).poles), rtol=0, atol=1e-6)


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("gains", [FIRST, SECOND, THIRD])
def test_linear_model_of_the_fmu_has_the_poles_of_the_theory(
    gcf_file: Callable[[Fmi], Path], fmi: Fmi, gains: Gains
) -> None:
    with Fmu(gcf_file(fmi)) as fmu:
        model = linearise(gcf(fmu, gains), T, axes=(1,), settle=10.0)
    found = np.sort_complex(systems.poles(model))
    np.testing.assert_allclose(found, np.sort_complex(filter_of(gains, T).poles), rtol=0, atol=1e-6)


def test_an_fmu_without_the_expected_variables_is_refused(gcf_fmu: Fmu) -> None:
    stepper = gcf(gcf_fmu, SECOND)
    renamed = SimpleNamespace(
        inputs={n.upper(): p for n, p in stepper.inputs.items()}, outputs=stepper.outputs
    )
    with pytest.raises(DesignError, match="no variable gyro, accel, mag: a response is measured on"):
        stepped_sine(renamed, plan("angle", [1.0]), T)

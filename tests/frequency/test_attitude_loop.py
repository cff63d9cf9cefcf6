"""Loop gain of the quadrotor on each estimator: linear theory against the disturbed loop."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ahrs_fmu import descriptors
from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.attitude_loop import ROLL, roll_loop
from ahrs_fmu.analysis.linear_model import linearise
from ahrs_fmu.analysis.measure import OperatingPoint
from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.loop_gain import LoopGain, margins, with_margins

STEP = 0.004
SIGNAL = "controller.rotor_speed_command"
HOVER = Path(__file__).parents[1] / "closed_loop" / "scenarios" / "hover.cosim.toml"
TRUTH = ["quadrotor.q -> controller.q", "quadrotor.rate -> controller.rate"]
NEAR = np.geomspace(8.0, 80.0, 9)
POINT = OperatingPoint(dip=1.1)
# One that adapts is another filter once it has settled; what it is then has been fixed here.
MODELS = {
    "strapdown": {},
    "complementary": {},
    "gcf": {},
    "mahony": {},
    "mahony_ekf": {},
    "improved_ekf": {},
    "cg_ekf": {},
    "adaptive_ckf": {"adaptation": "none"},
    "mekf": {},
    "ukf": {},
    "kcf": {},
}


def measured(table: Mapping[str, Any], model: str = "gcf", **parameters: object) -> LoopGain:
    """Loop gain about its crossover, of the loop that runs."""
    file = scenario.from_table(table, HOVER)
    changes = {"components.estimator": {"model": model, "parameters": parameters}}
    with Instances() as instances:
        return margins(running.assemble(file.case(changes), instances, Path()), SIGNAL, ROLL, NEAR)


def predicted(frequency: np.ndarray, model: str | None, **parameters: object) -> LoopGain:
    """Margins by theory."""
    estimator = None
    if model is not None:
        stepper = CoreStepper(descriptors.load(model), {"sample_time": STEP, **parameters})
        estimator = linearise(stepper, STEP, axes=(0,), point=POINT, separate=True)
    return with_margins(frequency, systems.response(roll_loop(STEP, estimator), frequency))


FAST = ("gcf", "mahony_ekf", "improved_ekf", "mekf")


def hover(**own: object) -> dict[str, Any]:
    """A scenario on top of the silent hover."""
    return {"template": HOVER.name, **own}


def test_on_the_truth_theory_and_measurement_agree() -> None:
    found = measured(hover(connections=TRUTH))
    expected = predicted(found.frequency, None)
    np.testing.assert_allclose(found.response, expected.response, rtol=0.01)
    assert np.degrees(found.phase_margin - expected.phase_margin) == pytest.approx(0.0, abs=0.1)
    assert found.crossover == pytest.approx(expected.crossover, rel=1e-3)
    # Of the page of the vehicle: 62 deg of the rotors, less the attitude loop and half a sample.
    assert np.degrees(expected.phase_margin) == pytest.approx(37.8, abs=0.1)


@pytest.mark.parametrize(
    "model", [name if name in FAST else pytest.param(name, marks=pytest.mark.slow) for name in MODELS]
)
def test_the_margin_that_an_estimator_costs_is_the_predicted_one(model: str) -> None:
    found = measured(hover(), model, **MODELS[model])
    expected = predicted(found.frequency, model, **MODELS[model])
    # A filter whose slow steps come less often than the samples is no linear filter at the single frequency.
    tolerance = 0.1 if model == "kcf" else 0.05
    np.testing.assert_allclose(found.response, expected.response, rtol=tolerance)
    assert np.degrees(found.phase_margin - expected.phase_margin) == pytest.approx(0.0, abs=0.3)
    assert found.crossover == pytest.approx(expected.crossover, rel=0.01)


def test_the_cost_is_half_a_sample_and_the_low_pass_of_the_gyro() -> None:
    """A slow filter passes the gyro on, late by T/2 for its averaging and p T/(1-p) for its low-pass."""
    frequency = np.geomspace(2.0, 200.0, 100)
    truth, gcf = predicted(frequency, None), predicted(frequency, "gcf", kp=0.15, ki=0.005)
    p = np.exp(-2.0 * np.pi * 92.0 * STEP)
    delay = 0.5 * STEP + STEP * p / (1.0 - p)
    # The rate carries most of the gain at the crossover, the attitude, which is not late, the rest.
    at = truth.crossover
    share = 1.0 / abs(1.0 + 6.0 / (1j * at)) ** 2
    assert truth.phase_margin - gcf.phase_margin == pytest.approx(at * delay * share, rel=0.1)


def test_noise_does_not_move_the_measured_margin() -> None:
    quiet = measured(hover())
    noisy = measured({"template": "quadrotor-attitude", "duration": 20.0})
    assert np.degrees(noisy.phase_margin - quiet.phase_margin) == pytest.approx(0.0, abs=0.5)
    assert noisy.crossover == pytest.approx(quiet.crossover, rel=0.01)


def test_the_loop_of_another_vehicle_moves_as_theory_says() -> None:
    """Slower rotors: the prediction takes the parameters of all components."""
    slow = {"rotor_time_constant": 0.06}
    found = measured(hover(connections=TRUTH, components={"quadrotor": {"parameters": slow}}))
    loop = roll_loop(STEP, vehicle=slow)
    expected = with_margins(found.frequency, systems.response(loop, found.frequency))
    assert np.degrees(found.phase_margin - expected.phase_margin) == pytest.approx(0.0, abs=0.1)
    assert found.phase_margin < np.radians(25.0)

"""The models of the loop as FMUs: the same bits as the C code, and states that come back."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest
from numpy.typing import NDArray

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.native import NativeModel
from loop_fmus import LoopFmus

Array = NDArray[np.float64]

MODELS = ("quadrotor", "imu", "attitude_controller")
TICK = 0.004
ROWS = 300


def inputs_of(model: str) -> dict[str, Array]:
    """Inputs that move, seeded."""
    random = np.random.default_rng(7)
    q = quaternion.normalise(
        np.array([1.0, 0.0, 0.0, 0.0]) + 0.1 * random.standard_normal((ROWS, 4)).cumsum(axis=0)
    )
    v = random.standard_normal((ROWS, 3))
    speed = 434.27 + 10.0 * random.standard_normal((ROWS, 4))
    return {
        "quadrotor": {"rotor_speed_command": speed, "wind": v},
        "imu": {"q": q, "rate": v, "specific_force": v - [0.0, 0.0, 9.8], "rotor_speed": speed},
        "attitude_controller": {"q_ref": q[::-1].copy(), "rate_ref": v, "angular_acceleration_ref": 2.0 * v,
                                "thrust": 9.0 + v[:, 0], "q": q, "rate": 0.3 * v},
    }[model]  # fmt: skip


def outputs_of(model: str) -> list[str]:
    return [output.name for output in descriptors.load(model).outputs]


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("model", MODELS)
def test_an_fmu_gives_the_bits_of_the_c_code(model: str, fmi: str, loop_fmu: LoopFmus) -> None:
    inputs, outputs = inputs_of(model), outputs_of(model)
    core = NativeModel(descriptors.load(model)).run(np.full(ROWS, TICK), inputs, outputs)
    with closing(loop_fmu(model, fmi).instantiate()) as stepper:
        ours = stepper.replay(inputs, outputs, TICK)
    assert {
        name for name in outputs if not np.array_equal(np.asarray(core[name], dtype=float), ours[name])
    } == set()
    assert all(
        np.ptp(ours[name].astype(float), axis=0).max() > 0.0 for name in outputs if not name.endswith("valid")
    )


@pytest.mark.parametrize("model", MODELS)
def test_a_saved_state_comes_back_to_the_bit(model: str, loop_fmu: LoopFmus) -> None:
    inputs, outputs = inputs_of(model), outputs_of(model)
    half = {name: column[: ROWS // 2] for name, column in inputs.items()}
    rest = {name: column[ROWS // 2 :] for name, column in inputs.items()}
    with closing(loop_fmu(model, "3").instantiate()) as stepper:
        stepper.replay(half, outputs, TICK)
        kept = stepper.save()
        first = stepper.replay(rest, outputs, TICK)
        stepper.restore(kept)
        second = stepper.replay(rest, outputs, TICK)
    assert all(np.array_equal(first[name], second[name]) for name in outputs)


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_the_quadrotor_starts_where_its_parameters_say(fmi: str, loop_fmu: LoopFmus) -> None:
    start = {"initial_position": [1.0, 2.0, -30.0], "initial_velocity": [3.0, 0.0, -1.0]}
    with closing(loop_fmu("quadrotor", fmi).instantiate(start)) as stepper:
        stepper.initialise()
        assert stepper.get("position").tolist() == start["initial_position"]
        assert stepper.get("velocity").tolist() == start["initial_velocity"]
        assert stepper.get("specific_force")[2] < -9.0

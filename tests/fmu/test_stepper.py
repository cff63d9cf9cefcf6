"""FMUs behind the Stepper protocol."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import Frame, Record
from ahrs_fmu.cosim import stepper as protocol
from ahrs_fmu.cosim.fmu import Fmu, FmuStepper, SavedState, replay_record
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.errors import FmuError, ParameterError
from ahrs_fmu.estimator import Estimator


@pytest.fixture(scope="module")
def flight() -> Record:
    return demo_flight(duration=8.0)


@pytest.fixture(params=["2", "3", "3-scalar"])
def fmu(request: pytest.FixtureRequest, fmu_file: Callable[..., Path]) -> Iterator[Fmu]:
    with Fmu(fmu_file(request.param)) as opened:
        yield opened


@pytest.fixture
def stepper(fmu: Fmu) -> FmuStepper:
    return fmu.instantiate()


def test_inputs_and_outputs_have_units_and_shapes(stepper: FmuStepper) -> None:
    assert stepper.inputs["gyro"] == protocol.Port("rad/s", (3,))
    assert stepper.inputs["mag_valid"].shape == ()
    assert stepper.outputs["q"].shape == (4,)
    assert stepper.outputs["roll"].unit == "rad"


def test_a_recording_gives_the_bits_of_the_core(fmu: Fmu, flight: Record) -> None:
    enu = flight.in_frame(Frame.ENU)
    parameters = {"kp": 1.5, "frame": "enu", "declination": 0.1}
    outputs = replay_record(fmu.instantiate(parameters), enu)
    expected = Estimator("gcf", parameters).run(enu)
    np.testing.assert_array_equal(outputs["q"], expected.q)
    np.testing.assert_array_equal(outputs["gyro_bias"], expected.gyro_bias)
    np.testing.assert_array_equal(outputs["status"], expected.status)
    np.testing.assert_array_equal(outputs["accel_used"] != 0.0, expected.accel_used)


def test_replay_of_the_protocol_equals_single_steps(fmu: Fmu, flight: Record) -> None:
    inputs = {"gyro": flight.gyro, "accel": flight.accel, "mag": flight.mag}
    whole = protocol.replay(fmu.instantiate(), inputs, ["q", "roll"], 0.01)
    one = fmu.instantiate()
    for k in range(50):
        for name, values in inputs.items():
            one.set(name, values[k])
        one.step(0.01)
    np.testing.assert_array_equal(whole["q"][49], one.get("q"))
    assert whole["roll"][49] == one.get("roll")


def test_reset_and_restart_equal_a_fresh_instance(fmu: Fmu, flight: Record) -> None:
    short = flight.rows(0, 200)
    stepper = fmu.instantiate({"kp": 2.0})
    first = replay_record(stepper, short)["q"]
    stepper.reset()
    np.testing.assert_array_equal(replay_record(stepper, short)["q"], first)
    stepper.restart({})
    np.testing.assert_array_equal(
        replay_record(stepper, short)["q"], replay_record(fmu.instantiate(), short)["q"]
    )


def test_save_and_restore_repeat_the_future_with_its_time(stepper: FmuStepper) -> None:
    stepper.set("accel", [0.0, 0.0, -9.8])
    stepper.set("gyro", [0.1, 0.2, 0.3])
    for _ in range(10):
        stepper.step(0.01)
    saved = stepper.save()
    stepper.step(0.05)
    later, time = stepper.get("q"), stepper.time
    stepper.restore(saved)
    assert stepper.time == pytest.approx(0.1)
    stepper.step(0.05)
    np.testing.assert_array_equal(stepper.get("q"), later)
    assert stepper.time == time


def test_time_is_a_multiple_of_the_step_and_does_not_drift(stepper: FmuStepper) -> None:
    for _ in range(1000):
        stepper.step(0.001)
    assert stepper.time == 1.0


def test_a_tunable_parameter_changes_during_the_run(stepper: FmuStepper) -> None:
    stepper.step(0.01)
    stepper.set("kp", 2.0)
    assert stepper.get("kp") == 2.0


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda s: s.set("kp", -1.0), "kp = -1"),
        (lambda s: s.set("sample_time", 0.02), "sample_time is fixed"),
        (lambda s: s.step(float("nan")), "DoStep"),
        (lambda s: s.restore(SavedState(s.save().data[:-3], 0.0, 0, 0.0)), "too short"),
    ],
)
def test_a_refused_call_tells_what_the_fmu_logged(
    act: Callable[[FmuStepper], object], message: str, stepper: FmuStepper
) -> None:
    stepper.step(0.01)
    with pytest.raises(FmuError, match=rf"GCF.fmu: .*{message}"):
        act(stepper)


def test_each_instance_has_its_own_log(fmu: Fmu) -> None:
    first, second = fmu.instantiate(), fmu.instantiate()
    second.close()
    with pytest.raises(FmuError, match="kp = -1"):
        first.set("kp", -1.0)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"kpp": 1.0}, "no parameter 'kpp'; it has kp among "),
        ({"gyro": 1.0}, "no parameter 'gyro'"),
        ({"kp": "fast"}, "must be a number"),
        ({"frame": "nwu"}, "one of ned, enu"),
        ({"q0": [1.0, 0.0]}, r"q0 has shape \(2,\); expected \(4,\)"),
        ({"accel_gating": 0.5}, "whole number"),
    ],
)
def test_wrong_parameters_are_refused_by_name(parameters: dict[str, object], message: str, fmu: Fmu) -> None:
    with pytest.raises(ParameterError, match=message):
        fmu.instantiate(parameters)


def test_a_parameter_out_of_range_is_the_fmus_to_refuse(fmu: Fmu) -> None:
    with pytest.raises(FmuError, match="kp = -1"):
        fmu.instantiate({"kp": -1.0})


def test_what_is_no_fmu_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.fmu"
    path.write_text("nothing")
    with pytest.raises(FmuError, match=r"no\.fmu: is not an FMU"):
        Fmu(path)
    with pytest.raises(FileNotFoundError):
        Fmu(tmp_path / "none.fmu")

"""Components stepped together: order, delays, units, recording, errors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import descriptors
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.stepper import Array, Port, Stepper
from ahrs_fmu.cosim.system import System
from ahrs_fmu.cosim.taps import Memoryless
from ahrs_fmu.errors import FmuError, ScenarioError, SimulationError
from loop_fmus import LoopFmus
from quadrotor_loop import CONNECTIONS, START_VALUES

STEP = 0.004
DRIVES = {"controller.q_ref": [1.0, 0.0, 0.0, 0.0], "controller.thrust": 9.81}
MODELS = {"quadrotor": "quadrotor", "imu": "imu", "estimator": "gcf", "controller": "attitude_controller"}
SIGNALS = ("quadrotor.q", "estimator.q", "quadrotor.position")


class Ramp:
    """Counts its steps and adds up its input."""

    inputs: Mapping[str, Port] = {"rate": Port("deg/s")}
    outputs: Mapping[str, Port] = {"angle": Port("rad"), "rate": Port("rad/s")}

    def __init__(self, fails_after: int = 1_000_000) -> None:
        self.state = {"angle": 0.0, "rate": 1.0}
        self.given = 0.0
        self.left = fails_after

    def set(self, name: str, value: object) -> None:
        assert name in self.inputs
        self.given = float(np.asarray(value))

    def get(self, name: str) -> Array:
        return np.asarray(self.state[name])

    def step(self, dt: float) -> None:
        self.left -= 1
        if self.left < 0:
            raise FmuError("the log of the component")
        self.state = {"angle": self.state["angle"] + self.given * dt, "rate": self.state["rate"] + 1.0}

    def save(self) -> object:
        return dict(self.state), self.given

    def restore(self, state: object) -> None:
        values, self.given = state  # type: ignore[misc]
        self.state = dict(values)

    def reset(self) -> None:
        self.__init__()  # type: ignore[misc]


def core(model: str) -> CoreStepper:
    return CoreStepper(descriptors.load(model), {"sample_time": STEP})


def loop(components: Mapping[str, Stepper], **options: object) -> System:
    return System(components, CONNECTIONS, step=STEP, drives=DRIVES, start_values=START_VALUES, **options)  # type: ignore[arg-type]


def cores() -> dict[str, Stepper]:
    return {name: core(model) for name, model in MODELS.items()}


def test_the_order_is_that_of_the_data_flow_and_the_delay_is_reported() -> None:
    shuffled = {name: core(MODELS[name]) for name in ("quadrotor", "controller", "estimator", "imu")}
    system = loop(shuffled)
    assert system.order == ["quadrotor", "imu", "estimator", "controller"]
    assert [str(connection) for connection in system.delayed] == [CONNECTIONS[-1]]
    assert len(loop(cores(), method="jacobi").delayed) == len(CONNECTIONS)


def test_the_loop_holds_its_attitude_on_the_estimate() -> None:
    recording = loop(cores()).run(10.0, SIGNALS)
    tilt = np.degrees(2.0 * np.hypot(recording["quadrotor.q"][:, 1], recording["quadrotor.q"][:, 2]))
    assert len(recording) == 2500
    assert np.max(tilt) < 5.0
    assert recording.time[-1] == pytest.approx(10.0, abs=1e-9)


@pytest.mark.parametrize("versions", [("2", "2", "2", "2"), ("3", "3", "3", "3"), ("2", "3", None, "3")])
def test_fmus_give_the_trajectory_of_the_c_code_to_the_bit(
    versions: tuple[str | None, ...], loop_fmu: LoopFmus
) -> None:
    expected = loop(cores()).run(1.0, SIGNALS)
    mixed: dict[str, Stepper] = {}
    for (name, model), version in zip(MODELS.items(), versions, strict=True):
        mixed[name] = (
            core(model) if version is None else loop_fmu(model, version).instantiate({"sample_time": STEP})
        )  # type: ignore[arg-type]
    found = loop(mixed).run(1.0, SIGNALS)
    for name in SIGNALS:
        np.testing.assert_array_equal(found[name], expected[name])


@pytest.mark.parametrize("estimator", ["gcf", "mekf"])
def test_a_numpy_estimator_flies_the_trajectory_of_the_c_code(estimator: str) -> None:
    found = []
    for back_end in ("c", "numpy"):
        components = cores()
        components["estimator"] = CoreStepper(
            descriptors.load(estimator), {"sample_time": STEP}, back_end=back_end
        )
        found.append(loop(components).run(4.0, SIGNALS))
    for name in SIGNALS:
        np.testing.assert_allclose(found[1][name], found[0][name], rtol=0.0, atol=1e-9)


def test_saving_and_restoring_the_whole_continues_to_the_bit() -> None:
    system = loop(cores())
    system.run(0.5, SIGNALS)
    saved = system.save()
    once = system.run(0.5, SIGNALS)
    system.restore(saved)
    again = system.run(0.5, SIGNALS)
    for name in SIGNALS:
        np.testing.assert_array_equal(once[name], again[name])
    np.testing.assert_array_equal(once.time, again.time)


def test_units_are_converted_and_jacobi_is_one_step_late() -> None:
    both: dict[str, Stepper] = {"first": Ramp(), "second": Ramp()}
    connections = ("first.rate -> second.rate",)
    found = {}
    for method in ("gauss-seidel", "jacobi"):
        for component in both.values():
            component.reset()
        system = System(both, connections, step=1.0, drives={"first.rate": lambda t: t}, method=method)  # type: ignore[arg-type]
        found[method] = system.run(3.0, ["second.angle"])["second.angle"]
    in_degrees = np.degrees(1.0)
    np.testing.assert_allclose(found["gauss-seidel"], np.cumsum([2, 3, 4]) * in_degrees)
    np.testing.assert_allclose(found["jacobi"], np.cumsum([1, 2, 3]) * in_degrees)


def test_a_tap_changes_a_signal_for_everybody() -> None:
    both: dict[str, Stepper] = {"first": Ramp(), "second": Ramp()}
    system = System(
        both,
        ("first.rate -> second.rate",),
        step=1.0,
        start_values=("first.rate",),
        taps={"first.rate": [Memoryless(lambda time, values: np.where(time[:, None] > 1.0, 0.0, values))]},
    )
    recording = system.run(3.0, ["first.rate", "second.angle"])
    np.testing.assert_allclose(recording["first.rate"], [2.0, 0.0, 0.0])
    np.testing.assert_allclose(recording["second.angle"], np.degrees([2.0, 2.0, 2.0]))


def test_a_component_that_fails_stops_the_run_and_keeps_what_was_recorded() -> None:
    system = System({"ramp": Ramp(fails_after=3)}, (), step=0.5, start_values=("ramp.rate",))
    with pytest.raises(
        SimulationError, match=r"ramp failed in the step to 2 s: the log of the component"
    ) as raised:
        system.run(5.0, ["ramp.rate"])
    np.testing.assert_allclose(raised.value.recording["ramp.rate"], [2.0, 3.0, 4.0])  # type: ignore[index]


@pytest.mark.parametrize(
    ("connections", "words"),
    [
        (("first.rate > second.rate",), "not of the form"),
        (("third.rate -> second.rate",), "there is no component 'third'; there are first, second"),
        (("first.speed -> second.rate",), "first has no such output; it has angle, rate"),
        (("first.angle -> second.rate",), "'rad' does not measure what 'deg/s' measures"),
        (("first.rate -> second.rate", "second.rate -> second.rate"), "second.rate is driven twice"),
        ((), "nothing drives first.rate, second.rate"),
    ],
)
def test_a_wrong_diagram_is_refused_by_name(connections: tuple[str, ...], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        System({"first": Ramp(), "second": Ramp()}, connections, step=1.0)


def test_a_recording_becomes_a_table_with_units(tmp_path: Path) -> None:
    recording = loop(cores()).run(0.02, SIGNALS)
    recording.write_csv(tmp_path / "run.csv")
    header, *rows = (tmp_path / "run.csv").read_text().splitlines()
    assert header.startswith("time [s],quadrotor.q[1],")
    assert "quadrotor.position[3] [m]" in header
    assert len(rows) == 5
    read = np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(read[:, 1:5], recording["quadrotor.q"])


def test_a_recording_becomes_a_table_of_pandas_and_of_xarray() -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    recording = loop(cores()).run(0.02, SIGNALS)
    frame = recording.to_pandas()
    assert frame.index.name == "time [s]"
    np.testing.assert_array_equal(frame["quadrotor.position[2] [m]"], recording["quadrotor.position"][:, 1])
    data = recording.to_xarray()
    assert data["quadrotor.position"].attrs["units"] == "m"
    np.testing.assert_array_equal(data["estimator.q"], recording["estimator.q"])

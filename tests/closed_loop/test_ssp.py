"""Systems as SSP packages: there and back, in two other importers, and what is refused."""

from __future__ import annotations

import re
import sys
import tomllib
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import Parameter, ParameterSet, read_ssd
from lxml import etree

from ahrs_fmu import descriptors
from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.faults import Memoryless
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.playback import Playback
from ahrs_fmu.cosim.ssp import read_ssp, write_ssp
from ahrs_fmu.cosim.stepper import Array, Port, Stepper
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import ScenarioError
from loop_fmus import LoopFmus

PAGE = Path(__file__).resolve().parents[2] / "docs" / "ssp.md"
STEP = 0.004
MODELS = {"quadrotor": "quadrotor", "imu": "imu", "estimator": "gcf", "controller": "attitude_controller"}
TEMPLATE = tomllib.loads(
    resources.files("ahrs_fmu.cosim").joinpath("templates/quadrotor-attitude.toml").read_text()
)
CONNECTIONS = [text for text in TEMPLATE["connections"] if not text.startswith(("wind.", "manoeuvre."))]
# One parameter of every type, and an array.
PARAMETERS: Mapping[str, Mapping[str, object]] = {
    "quadrotor": {"ground": True, "initial_position": [0.0, 0.0, -2.0], "initial_velocity": [0.0, 0.5, 0.0]},
    "imu": {"seed": 7},
    "estimator": {"initialisation": "given", "kp": 1.5},
    "controller": {},
}
SIGNALS = (
    "quadrotor.q",
    "quadrotor.position",
    "estimator.q",
    "estimator.status",
    "imu.gyro",
    "imu.accel_valid",
)
FILES = ("SystemStructure.ssd", "resources/estimator.ssv")


def core(name: str, model: str) -> CoreStepper:
    return CoreStepper(descriptors.load(model), {"sample_time": STEP} | PARAMETERS[name])


def cores() -> dict[str, Stepper]:
    return {name: core(name, model) for name, model in MODELS.items()}


def loop(components: Mapping[str, Stepper], **options: object) -> System:
    given: dict[str, object] = {
        "drives": {"controller.q_ref": [1.0, 0.0, 0.0, 0.0], "controller.thrust": 9.81},
        "start_values": ("quadrotor.wind", "controller.rate_ref", "controller.angular_acceleration_ref"),
    }
    return System(components, CONNECTIONS, step=STEP, **given | options)  # type: ignore[arg-type]


def thrust(time: float) -> float:
    """Nothing in the first step, then more and less, the same for all times that round to one step."""
    row = round(time / STEP)
    return 9.81 + 0.5 * np.sin(0.1 * row) if row > 1 else 0.0


def assert_same_run(found: System, expected: System, duration: float = 1.0) -> None:
    one, other = found.run(duration, SIGNALS), expected.run(duration, SIGNALS)
    for name in SIGNALS:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ssp") / "loop.ssp"
    write_ssp(loop(cores()), path, stop_time=10.0)
    return path


def edited(package: Path, folder: Path, edits: Mapping[str, str], drop: str = "") -> Path:
    """A copy of a package with other text in its XML files, and without one file."""
    path = folder / "edited.ssp"
    changed = set()
    with zipfile.ZipFile(package) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name.endswith((".ssd", ".ssv")):
                for before, after in edits.items():
                    changed |= {before} if before.encode() in data else set()
                    data = data.replace(before.encode(), after.encode(), 1)
            if name != drop:
                new.writestr(name, data)
    assert changed == set(edits)
    return path


# There and back


@pytest.mark.parametrize("versions", [("2", "2", "2", "2"), ("3", "3-scalar", None, "2")])
def test_a_system_that_was_written_and_read_gives_the_same_bits(
    versions: tuple[str | None, ...], loop_fmu: LoopFmus, tmp_path: Path
) -> None:
    components: dict[str, Stepper] = {}
    for (name, model), version in zip(MODELS.items(), versions, strict=True):
        parameters = {"sample_time": STEP} | PARAMETERS[name]
        components[name] = (
            core(name, model) if version is None else loop_fmu(model, version).instantiate(parameters)  # type: ignore[arg-type]
        )
    write_ssp(loop(components), tmp_path / "loop.ssp")
    with read_ssp(tmp_path / "loop.ssp") as system:
        assert {stepper.fmu.version for stepper in system.components.values()} == {2}  # type: ignore[attr-defined]
        assert_same_run(system, loop(cores()))


def test_step_method_and_order_survive(tmp_path: Path) -> None:
    order = ["imu", "controller", "quadrotor", "estimator"]  # not what the data flow gives
    for method in ("gauss-seidel", "jacobi"):
        expected = loop(cores(), order=order, method=method)
        write_ssp(expected, tmp_path / "loop.ssp")
        with read_ssp(tmp_path / "loop.ssp") as system:
            assert (system.step_size, system.method, system.order) == (STEP, method, order)
            assert_same_run(system, expected, 0.2)


def test_a_package_written_again_is_the_same_file(package: Path, tmp_path: Path) -> None:
    with read_ssp(package) as system:
        system.run(0.1, SIGNALS)
        write_ssp(system, tmp_path / "loop.ssp", stop_time=10.0)
    assert (tmp_path / "loop.ssp").read_bytes() == package.read_bytes()


def test_a_numpy_model_becomes_an_fmu_with_the_python_back_end(tmp_path: Path) -> None:
    components = cores()
    parameters = {"sample_time": STEP} | PARAMETERS["estimator"]
    for name in ("ours", "theirs"):
        components["estimator"] = CoreStepper(descriptors.load("gcf"), parameters, back_end="numpy")
        if name == "ours":
            write_ssp(loop(components), tmp_path / "loop.ssp")
    with read_ssp(tmp_path / "loop.ssp") as system:
        assert_same_run(system, loop(components), 0.2)


def test_parameters_changed_and_inputs_set_after_the_start_are_written(tmp_path: Path) -> None:
    components = cores()
    components["quadrotor"].set("wind", [1.0, 0.0, 0.0])
    write_ssp(loop(components), tmp_path / "loop.ssp")
    with read_ssp(tmp_path / "loop.ssp") as system:
        np.testing.assert_array_equal(system.drives["quadrotor.wind"], [1.0, 0.0, 0.0])


def test_an_input_driven_by_a_function_of_time_becomes_an_input_of_the_package(tmp_path: Path) -> None:
    system = loop(cores(), drives={"controller.q_ref": lambda _: [1.0, 0, 0, 0], "controller.thrust": thrust})
    write_ssp(system, tmp_path / "loop.ssp")
    inputs = {"controller_q_ref": [1.0, 0.0, 0.0, 0.0], "controller_thrust": thrust}
    with read_ssp(tmp_path / "loop.ssp", inputs=inputs) as found:
        assert_same_run(found, system)
    for given, words in (
        ({}, r"nothing drives 'controller_q_ref', an input of the package: pass inputs={'controller_q_ref'"),
        ({"thrust": 1.0}, "the package has no input 'thrust'; it has controller_q_ref, controller_thrust"),
    ):
        with pytest.raises(ScenarioError, match=words), read_ssp(tmp_path / "loop.ssp", inputs=given):
            pass


SMOOTHER = """
from ahrs_fmu.component import Component, Input, Output, Parameter


class Smoother(Component):
    'First-order low-pass of the rate.'

    crossover = Parameter(50.0, unit="rad/s")
    rate = Input(size=3, unit="rad/s")
    smooth = Output(size=3, unit="rad/s")

    def initialise(self):
        self.smooth = self.rate + 1.0

    def update(self, dt):
        self.smooth = self.smooth + self.crossover * dt * (self.rate - self.smooth)
"""
SCENARIO = """
template = "quadrotor-attitude"
duration = 0.4
connections = ["smoother.smooth -> controller.rate", "estimator.rate -> smoother.rate"]

[components.smoother]
class = "smoother.py:Smoother"
parameters.crossover = 80.0

[manoeuvre]
roll_deg.trapezoids = [[0.1, 0.2, 0.05, 10]]

[wind]
mean = [1.0, 0.0, 0.0]
"""


def test_a_scenario_becomes_a_package_whose_inputs_are_manoeuvre_and_wind(tmp_path: Path) -> None:
    (tmp_path / "smoother.py").write_text(SMOOTHER)
    (case,) = scenario.parse(SCENARIO, tmp_path / "flight.cosim.toml").cases()
    with Instances(tmp_path) as instances:
        system = running.assemble(case, instances, tmp_path)
        write_ssp(system, tmp_path / "flight.ssp")
        given = (
            "manoeuvre.q_ref",
            "manoeuvre.rate_ref",
            "manoeuvre.angular_acceleration_ref",
            "manoeuvre.thrust",
        )
        signals = ("quadrotor.q", "smoother.smooth", "wind.velocity", *given)
        expected = system.run(0.4, signals)
    inputs = {
        name.replace(".", "_"): lambda time, column=expected[name]: column[round(time / STEP) - 1]
        for name in ("wind.velocity", *given)
    }
    with read_ssp(tmp_path / "flight.ssp", inputs=inputs) as found:
        again = found.run(0.4, signals[:2])
    for name in signals[:2]:
        np.testing.assert_array_equal(again[name], expected[name])


# What is in the file


def test_the_files_are_valid_by_the_schemas_of_the_standard(tmp_path: Path) -> None:
    schemas = Path(sys.modules["fmpy.ssp.ssd"].__file__ or "").parent / "schema"
    write_ssp(
        loop(cores(), drives={"controller.q_ref": [1.0, 0, 0, 0], "controller.thrust": thrust}),
        tmp_path / "a.ssp",
    )
    with zipfile.ZipFile(tmp_path / "a.ssp") as archive:
        texts = {name: archive.read(name) for name in archive.namelist() if name.endswith((".ssd", ".ssv"))}
    assert len(texts) == 5
    for name, text in texts.items():
        kind = "Description" if name.endswith(".ssd") else "ParameterValues"
        schema = etree.XMLSchema(file=str(schemas / f"SystemStructure{kind}.xsd"))
        schema.assertValid(etree.fromstring(text))


def test_types_units_and_enumerations_are_declared(package: Path) -> None:
    with zipfile.ZipFile(package) as archive:
        texts = {
            name: archive.read(name).decode()
            for name in archive.namelist()
            if name.endswith((".ssd", ".ssv"))
        }
    for name, pattern in (
        ("SystemStructure.ssd", r'<ssd:Connector name="gyro\[1\]" kind="input">\s*<ssc:Real unit="rad/s" />'),
        ("SystemStructure.ssd", r'<ssd:Connector name="accel_valid" kind="output">\s*<ssc:Boolean />'),
        ("SystemStructure.ssd", r'"status" kind="output">\s*<ssc:Enumeration name="status_type" />'),
        (
            "SystemStructure.ssd",
            r'<ssc:Enumeration name="status_type">\s*<ssc:Item name="nominal" value="0" />',
        ),
        ("SystemStructure.ssd", r'<ssc:Unit name="T">\s*<ssc:BaseUnit kg="1" s="-2" A="-1" />'),
        ("SystemStructure.ssd", r'<ssd:DefaultExperiment startTime="0.0" stopTime="10.0">'),
        ("resources/imu.ssv", r'name="seed">\s*<ssv:Integer value="7" />'),
        ("resources/quadrotor.ssv", r'name="ground">\s*<ssv:Boolean value="true" />'),
        ("resources/quadrotor.ssv", r'name="initial_velocity\[2\]">\s*<ssv:Real value="0.5" unit="m/s" />'),
        ("resources/estimator.ssv", r'name="initialisation">\s*<ssv:Enumeration value="given" />'),
        ("resources/estimator.ssv", r'<ssc:Unit name="s">\s*<ssc:BaseUnit s="1" />'),
    ):
        assert re.search(pattern, texts[name]), pattern
    assert "mass" not in texts["resources/quadrotor.ssv"], "a default is written"
    assert 'name="wind' not in texts["SystemStructure.ssd"], "an input without a connection has a connector"


def test_equal_fmus_are_stored_once(tmp_path: Path) -> None:
    both: dict[str, Stepper] = {name: CoreStepper(descriptors.load("gcf")) for name in ("first", "second")}
    start_values = [f"{name}.{v}" for name, stepper in both.items() for v in stepper.inputs]
    write_ssp(System(both, (), step=0.01, start_values=start_values), tmp_path / "two.ssp")
    with zipfile.ZipFile(tmp_path / "two.ssp") as archive:
        assert archive.namelist() == ["SystemStructure.ssd", "resources/GCF.fmu"]
    with read_ssp(tmp_path / "two.ssp") as system:
        assert system.run(0.1, ["first.q", "second.q"])["second.q"].shape == (10, 4)


# Other importers


class StartsLikeFmpy:
    """A component initialised before its inputs are known, with outputs of zero until its first step."""

    def __init__(self, stepper: Stepper, values: Mapping[str, object]) -> None:
        for name, value in values.items():
            stepper.set(name, value)  # type: ignore[arg-type]
        stepper.initialise()  # type: ignore[attr-defined]
        self._stepper = stepper
        self._has_stepped = False

    def __getattr__(self, name: str) -> object:
        return getattr(self._stepper, name)

    def get(self, name: str) -> Array:
        return self._stepper.get(name) * float(self._has_stepped)

    def step(self, dt: float) -> None:
        self._stepper.step(dt)
        self._has_stepped = True


def fmpy_parameters(package: Path) -> ParameterSet:
    """The parameters of a package as FMPy's importer takes them; it does not take them by itself."""
    numbers = {"true": 1, "false": 0, "given": 1}
    return ParameterSet(
        parameters=[
            Parameter(name=f"{component.name}.{p.name}", value=numbers.get(p.value, p.value))
            for component in read_ssd(package).system.elements
            for binding in component.parameterBindings
            for p in binding.parameterValues[0].parameters
        ]
    )


def column(result: Array, name: str, shape: tuple[int, ...]) -> Array:
    return np.stack([result[f"{name}[{i + 1}]"] for i in range(shape[0])], axis=1) if shape else result[name]


def test_the_ssp_importer_of_fmpy_gives_the_same_bits(tmp_path: Path) -> None:
    written = loop(cores(), drives={"controller.q_ref": [1.0, 0.0, 0.0, 0.0], "controller.thrust": thrust})
    write_ssp(written, tmp_path / "loop.ssp")
    # A step of FMPy uses the value of the input at the beginning of the step before.
    result = simulate_ssp(
        str(tmp_path / "loop.ssp"),
        stop_time=1.0,
        step_size=STEP,
        parameter_set=fmpy_parameters(tmp_path / "loop.ssp"),
        input={"controller_thrust": lambda time: thrust(time + 2 * STEP)},
    )
    with read_ssp(tmp_path / "loop.ssp", inputs={"controller_thrust": thrust}) as read:
        constants = {name: drive for name, drive in read.drives.items() if not callable(drive)}
        components = {
            name: StartsLikeFmpy(
                stepper,
                {key.partition(".")[2]: v for key, v in constants.items() if key.startswith(f"{name}.")},
            )
            for name, stepper in read.components.items()
        }
        expected = loop(components, drives=read.drives, method="jacobi").run(1.0, SIGNALS)  # type: ignore[arg-type]
    assert len(result) >= len(expected) == 250
    assert np.ptp(expected["quadrotor.position"][:, 1]) > 0.1
    for name in SIGNALS:
        found = column(result, name, expected[name].shape[1:])[:250]
        np.testing.assert_array_equal(found, expected[name], err_msg=name)


def test_libcosim_gives_the_same_bits(tmp_path: Path) -> None:
    pytest.importorskip("libcosimpy", reason="the Open Simulation Platform is not installed")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    # It knows no enumerations, neither as parameters nor as outputs.
    parameters = {"sample_time": STEP, "kp": 1.5}
    components = cores() | {"estimator": CoreStepper(descriptors.load("gcf"), parameters)}
    write_ssp(loop(components), tmp_path / "loop.ssp", outputs="connected")
    execution = CosimExecution.from_ssp_file(ssp_path=str(tmp_path / "loop.ssp"), step_size=round(STEP * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    assert execution.step(step_count=250)
    with read_ssp(tmp_path / "loop.ssp", method="jacobi") as system:
        system.run(1.0, [])
        for component, output in (("quadrotor", "q"), ("imu", "gyro"), ("controller", "rotor_speed_command")):
            slave = execution.slave_index_from_instance_name(component)
            references = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
            expected = system.components[component].get(output)
            wanted = [references[f"{output}[{i + 1}]"] for i in range(len(expected))]
            found = observer.last_real_values(slave_index=slave, variable_references=wanted)
            np.testing.assert_array_equal(found, expected, err_msg=f"{component}.{output}")


def test_the_page_runs_and_its_figures_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    names: dict[str, object] = {}
    for block in re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        exec(block, names)
    fmpy = column(names["result"], "estimator.q", (4,))[:2500]  # type: ignore[arg-type]
    with read_ssp("loop.ssp", method="jacobi") as system:
        ours = system.run(10.0, ["estimator.q"])["estimator.q"]
    apart = np.degrees(2.0 * np.arccos(np.minimum(np.abs(np.sum(fmpy * ours, axis=1)), 1.0)))
    largest, late = re.search(
        r"by up to ([\d.]+)° in the first second.* and by ([\d.]+)°", text, re.DOTALL
    ).groups()  # type: ignore[union-attr]
    assert np.max(apart) == pytest.approx(float(largest), abs=0.05)
    assert np.max(apart[-250:]) == pytest.approx(float(late), abs=0.005)


# Packages of other tools

FOREIGN = """<?xml version="1.0" encoding="UTF-8"?>
<d:SystemStructureDescription version="1.0" name="other"
    xmlns:d="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:c="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:v="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
  <d:System name="root">
    <d:Connectors>
      {commands}
      <d:Connector name="out" kind="output"/>
    </d:Connectors>
    <d:ParameterBindings>
      <d:ParameterBinding prefix="sensor.">
        <d:ParameterValues>
          <v:ParameterSet version="1.0" name="p"><v:Parameters>
            <v:Parameter name="seed"><v:Integer value="7"/></v:Parameter>
            <v:Parameter name="sede"><v:Integer value="7"/></v:Parameter>
          </v:Parameters></v:ParameterSet>
        </d:ParameterValues>
      </d:ParameterBinding>
      <d:ParameterBinding source="resources/all.ssv"/>
    </d:ParameterBindings>
    <d:Elements>
      <d:Component name="sensor" source="resources/my%20imu.fmu">
        <d:Connectors>{inputs}<d:Connector name="gyro[1]" kind="output"><c:Real/></d:Connector></d:Connectors>
        <d:ParameterBindings>
          <d:ParameterBinding>
            <d:ParameterValues>
              <v:ParameterSet version="1.0" name="p"><v:Parameters>
                <v:Parameter name="sample_time"><v:Real value="4" unit="ms"/></v:Parameter>
                <v:Parameter name="seed"><v:Integer value="3"/></v:Parameter>
              </v:Parameters></v:ParameterSet>
            </d:ParameterValues>
          </d:ParameterBinding>
        </d:ParameterBindings>
      </d:Component>
      <d:Component name="plant" source="./resources/plant.fmu">
        <d:Connectors>{outputs}</d:Connectors>
      </d:Component>
    </d:Elements>
    <d:Connections>
      {connections}
      <d:Connection startElement="sensor" startConnector="gyro[1]" endConnector="out"/>
    </d:Connections>
  </d:System>
</d:SystemStructureDescription>
"""
VALUES = """<ParameterSet version="1.0" name="all" xmlns="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
  <Parameters>
    <Parameter name="plant.initial_velocity[2]"><Integer value="2"/></Parameter>
    {commands}
  </Parameters>
</ParameterSet>
"""


@pytest.fixture
def foreign(loop_fmu: LoopFmus, tmp_path: Path) -> Path:
    """A package as another tool may write it: inline values, a prefix, no types, ends the other way round."""
    sizes = {"q": 4, "rate": 3, "specific_force": 3, "rotor_speed": 4}
    elements = [f"{name}[{i + 1}]" for name, size in sizes.items() for i in range(size)]
    commands = [f"rotor_speed_command[{i}]" for i in range(1, 5)]
    text = FOREIGN.format(
        commands="".join(f'<d:Connector name="speed[{i}]" kind="input"/>' for i in range(1, 5)),
        inputs="".join(f'<d:Connector name="{e}" kind="input"/>' for e in elements),
        outputs="".join(f'<d:Connector name="{e}" kind="output"/>' for e in elements)
        + "".join(f'<d:Connector name="{e}" kind="input"/>' for e in commands),
        connections="".join(
            f'<d:Connection startElement="sensor" startConnector="{e}"'
            f' endElement="plant" endConnector="{e}"/>'
            for e in elements
        )
        + "".join(
            f'<d:Connection startConnector="speed[{i}]"'
            f' endElement="plant" endConnector="rotor_speed_command[{i}]"/>'
            for i in range(1, 5)
        ),
    )
    values = VALUES.format(
        commands="".join(
            f'<Parameter name="speed[{i}]"><Real value="43{i}.5"/></Parameter>' for i in range(1, 5)
        )
    )
    with zipfile.ZipFile(tmp_path / "other.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        archive.writestr("resources/all.ssv", values)
        archive.write(loop_fmu("imu", "2").path, "resources/my imu.fmu")
        archive.write(loop_fmu("quadrotor", "2").path, "resources/plant.fmu")
    return tmp_path / "other.ssp"


def test_a_package_of_another_tool_runs(foreign: Path) -> None:
    parts: dict[str, Stepper] = {
        "plant": CoreStepper(
            descriptors.load("quadrotor"), {"sample_time": STEP, "initial_velocity": [0, 2.0, 0]}
        ),
        "sensor": CoreStepper(descriptors.load("imu"), {"sample_time": STEP, "seed": 7}),
    }
    expected = System(
        parts,
        [f"plant.{name} -> sensor.{name}" for name in ("q", "rate", "specific_force", "rotor_speed")],
        step=STEP,
        drives={"plant.rotor_speed_command": [431.5, 432.5, 433.5, 434.5]},
        start_values=["plant.wind"],
    ).run(0.4, ["sensor.gyro", "plant.position"])
    read_ssd(foreign)  # valid by the schema
    warning = "name nothing in the system are ignored: sensor.sede"
    with pytest.warns(UserWarning, match=warning), read_ssp(foreign, step=STEP) as system:
        found = system.run(0.4, ["sensor.gyro", "plant.position"])
    for name in found.signals:
        np.testing.assert_array_equal(found[name], expected[name])


@pytest.mark.filterwarnings("ignore:parameters that name nothing")
def test_a_package_without_a_step_asks_for_one(foreign: Path) -> None:
    with (
        pytest.raises(ScenarioError, match=r"other.ssp: there is no communication step in the package: pass"),
        read_ssp(foreign),
    ):
        pass


# What is refused


class Spring:
    """A stepper that no FMU stands behind."""

    inputs: Mapping[str, Port] = {}
    outputs: Mapping[str, Port] = {"force": Port("N")}


def test_a_component_without_an_fmi_2_twin_is_refused_by_name(
    loop_fmu: LoopFmus, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    system = System({"spring": Spring()}, (), step=1.0)  # type: ignore[dict-item]
    with pytest.raises(ScenarioError, match=r"spring: a Spring cannot go into an SSP package.*put an FMU or"):
        write_ssp(system, tmp_path / "a.ssp")
    fmu = loop_fmu("gcf", "3")
    gcf = fmu.instantiate()
    start_values = [f"gcf.{name}" for name in gcf.inputs]
    monkeypatch.setattr(fmu.description, "guid", "{another version}")
    with pytest.raises(ScenarioError, match=r"gcf: GCF.fmu is FMI 3 and not built by this version of ahrs"):
        write_ssp(System({"gcf": gcf}, (), step=0.01, start_values=start_values), tmp_path / "a.ssp")
    assert not (tmp_path / "a.ssp").exists()


def test_names_and_taps_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    gcf = CoreStepper(descriptors.load("gcf"))
    start_values = [f"my gcf.{name}" for name in gcf.inputs]
    with pytest.raises(ScenarioError, match=r"component 'my gcf': a name in a package has letters, digits"):
        write_ssp(System({"my gcf": gcf}, (), step=0.01, start_values=start_values), tmp_path / "a.ssp")
    one = np.zeros((2, 3))
    parts: dict[str, Stepper] = {
        "a": Playback({"b_c": one}, {"b_c": "rad/s"}, 0.01),
        "a_b": Playback({"c": one}, {"c": "m/s2"}, 0.01),
        "gcf": gcf,
    }
    start_values = ["gcf.mag", "gcf.accel_valid", "gcf.mag_valid"]
    clash = System(parts, ["a.b_c -> gcf.gyro", "a_b.c -> gcf.accel"], step=0.01, start_values=start_values)
    with pytest.raises(ScenarioError, match=r"a_b.c and a.b_c would both be 'a_b_c': rename a component"):
        write_ssp(clash, tmp_path / "a.ssp")
    tapped = loop(cores(), taps={"imu.gyro": [Memoryless(lambda _, values: values)]})
    with pytest.raises(
        ScenarioError, match=r"imu.gyro has a tap, which an SSP package cannot hold: leave it out"
    ):
        write_ssp(tapped, tmp_path / "a.ssp")


FIRST = 'startElement="imu" startConnector="gyro[1]" endElement="estimator" endConnector="gyro[1]" />'
SECOND = FIRST.replace("[1]", "[2]")
BROKEN: Mapping[str, tuple[Mapping[str, str], str]] = {
    "malformed": ({"</ssd:Elements>": ""}, r"SystemStructure.ssd: is malformed: mismatched tag: line \d+"),
    "another format": (
        {"SSP1/SystemStructureDescription": "SSP9/System"},
        r"its root element is \{http://ssp-standard.org/SSP9/System\}Sys.*; SSP 1.0 has",
    ),
    "version": ({'version="1.0"': 'version="2.0"'}, "version 2.0 is not supported; only SSP 1.0 is"),
    "file": (
        {"resources/IMU.fmu": "resources/Imu.fmu"},
        r"component 'imu': resources/Imu.fmu is missing; there are .*IMU.fmu",
    ),
    "kind of component": (
        {"x-fmu-sharedlibrary": "x-ssp-package"},
        "component 'quadrotor': type application/x-ssp-package is",
    ),
    "model exchange": (
        {'"CoSimulation"': '"ModelExchange"'},
        "component 'quadrotor': model exchange is not supported",
    ),
    "twice": (
        {'<ssd:Component name="imu"': '<ssd:Component name="quadrotor"'},
        "two components have the name 'quadrotor'",
    ),
    "dot": ({'<ssd:Component name="imu"': '<ssd:Component name="a.b"'}, "component 'a.b': a name with a dot"),
    "nested": (
        {"<ssd:Elements>": '<ssd:Elements><ssd:System name="inner"/>'},
        "'inner': nested systems are not supported",
    ),
    "no name": ({'<ssd:Component name="imu"': "<ssd:Component"}, "Component lacks the attribute 'name'"),
    "variable": (
        {'name="gyro[1]" kind="output"': 'name="gyro[7]" kind="output"'},
        r"imu.gyro\[7\]: the FMU has no such variable; similar are gyro\[",
    ),
    "kind": (
        {'name="gyro[1]" kind="output"': 'name="gyro[1]" kind="input"'},
        "its kind is input; the FMU's variable is output",
    ),
    "type": ({"<ssc:Boolean />": "<ssc:Integer />"}, "its type is Integer; the FMU's variable is Boolean"),
    "unit": (
        {'<ssc:Real unit="rad/s" />': '<ssc:Real unit="deg/s" />'},
        "its unit is 'deg/s'; the FMU's variable is in 'rad/s'",
    ),
    "component": (
        {FIRST: FIRST.replace("imu", "mpu")},
        "there is no component 'mpu'; there are quadrotor, imu, estimator, contr",
    ),
    "connector": (
        {FIRST: FIRST.replace("gyro[1]", "gyro[9]", 1)},
        r"component 'imu' has no connector 'gyro\[9\]'; similar are gyro\[",
    ),
    "two outputs": (
        {FIRST: FIRST.replace('"estimator" endConnector="gyro[1]"', '"imu" endConnector="gyro[2]"')},
        "both ends give a value; it takes an output and an input",
    ),
    "driven twice": ({SECOND: FIRST}, r"estimator.gyro\[1\] is connected to imu.gyro\[1\] already"),
    "crossed": (
        {FIRST: FIRST.replace("[1]", "[2]", 1), SECOND: SECOND.replace("[2]", "[1]", 1)},
        r"estimator.gyro is connected to imu.gyro\[2\], imu.gyro\[1\], imu.gyro\[3\]: only all elements",
    ),
    "partly": (
        {f"<ssd:Connection {FIRST}": ""},
        r"estimator.gyro is connected to imu.gyro\[2\], imu.gyro\[3\]: only all",
    ),
    "factor": (
        {FIRST: FIRST.replace(" />", '><ssc:LinearTransformation factor="2.0" /></ssd:Connection>')},
        r"connection imu.gyro\[1\] -> estimator.gyro\[1\]: LinearTransformation is not supported",
    ),
    "mapping": (
        {'source="resources/estimator.ssv" />': "><ssd:ParameterMapping /></ssd:ParameterBinding>"},
        "parameter binding of 'estimator': a ParameterMapping is not supported",
    ),
    "parameter file": ({"resources/imu.ssv": "resources/mpu.ssv"}, "resources/mpu.ssv is missing"),
    "number": ({'value="1.5"': 'value="fast"'}, "resources/estimator.ssv: parameter 'kp': 'fast' is no Real"),
    "refused by the FMU": (
        {'value="1.5"': 'value="-1.0"'},
        r"component 'estimator': GCF.fmu: .*kp = -1 is outside \[0, 1000\]",
    ),
    "item": (
        {'value="given"': 'value="guessed"'},
        "'estimator.initialisation' = 'guessed' is not one of sensors, given",
    ),
    "type of parameter": (
        {'<ssv:Integer value="7"': '<ssv:Real value="7"'},
        "parameter 'imu.seed' is Real; the FMU's variable is Integer",
    ),
    "unit of parameter": (
        {'unit="s"': 'unit="m"'},
        "parameter 'quadrotor.initial_velocity|'m' does not measure what 's' measures",
    ),
    "method": (
        {'method="gauss-seidel"': 'method="newton"'},
        "method 'newton' is not one of gauss-seidel, jacobi",
    ),
    "step": ({'step="0.004"': 'step="soon"'}, "step = 'soon' is not a number"),
}


@contextmanager
def refused(words: str) -> Iterator[None]:
    with pytest.raises(ScenarioError) as raised:
        yield
    message = str(raised.value)
    assert re.search(words, message), message
    assert message.startswith("edited.ssp: ")
    assert "\n" not in message


@pytest.mark.parametrize("case", BROKEN)
def test_a_wrong_package_is_refused_by_name(case: str, package: Path, tmp_path: Path) -> None:
    edits, words = BROKEN[case]
    with refused(words), read_ssp(edited(package, tmp_path, edits)):
        pass


def test_what_is_no_package_is_refused(package: Path, tmp_path: Path) -> None:
    without = edited(package, tmp_path, {}, drop="SystemStructure.ssd")
    with refused("SystemStructure.ssd is missing; there are resources/quadrotor.ssv"), read_ssp(without):
        pass
    (tmp_path / "edited.ssp").write_text("no archive")
    with refused("is not an SSP package: it is no ZIP archive"), read_ssp(tmp_path / "edited.ssp"):
        pass
    with pytest.raises(FileNotFoundError), read_ssp(tmp_path / "nowhere.ssp"):
        pass

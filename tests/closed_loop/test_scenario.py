"""Scenario files: templates, cases, refusals, and the systems they make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import quaternion
from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.excitation import Manoeuvre, Wind
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.scenario import ScenarioFile
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.toolchain import host_platform
from ahrs_fmu.trajectories import Profile

LOOP = """
template = "quadrotor-attitude"
duration = 1.0
[components.estimator]
parameters.initialisation = "given"
[manoeuvre]
roll_deg.trapezoids = [[0.2, 0.8, 0.2, 10]]
[[expect]]
signal = "attitude_error.total"
measure = "max"
at_most = "2 deg"
"""
OPEN = """
template = "estimation"
duration = 20.0
seeds = [1, 2]
[motion]
experiment = "ac/swing"
[vary]
"components.estimator.model" = ["gcf", "mahony"]
[[expect]]
signal = "attitude_error.total"
measure = "rms"
at_most = "10 deg"
"""


def parsed(text: str, folder: Path = Path()) -> ScenarioFile:
    return scenario.parse(text, folder / "test.cosim.toml")


def outcome(file: ScenarioFile, instances: Instances, **changes: object) -> running.Outcome:
    return running.run(file.case(changes), instances, file.path.parent)


def test_a_loop_of_a_few_lines_flies_and_is_judged() -> None:
    with Instances() as instances:
        found = outcome(parsed(LOOP), instances)
    assert found.passed
    assert len(found.recording) == 250
    roll = found.recording["tracking_error.roll"]
    assert np.degrees(np.abs(roll)).max() < 3.0
    assert {"estimator.status", "quadrotor.position", "gyro_bias_error"} <= found.recording.signals.keys()


def test_every_combination_of_values_and_seeds_is_a_case() -> None:
    labels = [case.label for case in parsed(OPEN).cases()]
    assert labels == [f"estimator={model}-seed={seed}" for model in ("gcf", "mahony") for seed in (1, 2)]
    one = list(parsed(OPEN).cases({"components.estimator.model": "mekf"}, [7]))
    assert [case.label for case in one] == ["estimator=mekf-seed=7"]


def test_a_chain_gives_stepwise_and_as_a_whole_the_same_bits() -> None:
    file = parsed(
        OPEN + '[faults.noise]\nsignal = "imu.gyro"\nkind = "noise"\nstd = "1 deg/s"\nstart = 3.0\n'
    )
    with Instances() as instances:
        case = file.case()
        wanted = running.signals_of(case.scenario)
        whole = running.assemble(case, instances, Path()).run(20.0, wanted)
        system = running.assemble(case, instances, Path())
        stepwise: dict[str, list[object]] = {name: [] for name in wanted}
        for _ in range(200):
            recorded = system.run(0.1, wanted)
            for name in wanted:
                stepwise[name].append(recorded[name])
        one = running.assemble(case, instances, Path())
        for component in one.components.values():
            component.never_fails = False  # type: ignore[attr-defined]
        single = one.run(20.0, wanted)
    for name in wanted:
        np.testing.assert_array_equal(whole[name], np.concatenate(stepwise[name]))  # type: ignore[arg-type]
        np.testing.assert_array_equal(whole[name], single[name])


def test_components_of_other_rates_than_the_loop_hold_between_their_samples_as_their_fmus_do() -> None:
    rates = {
        "components.estimator.parameters.sample_time": 0.01,
        "components.imu.parameters.sample_time": 0.001,
    }
    with Instances() as instances:
        core, fmu = (
            running.assemble(file.case(rates), instances, Path()).run(1.0, ["estimator.q", "quadrotor.q"])
            for file in (parsed(LOOP), parsed(LOOP).computed_by("fmu3"))
        )
    for name in core.signals:
        np.testing.assert_array_equal(core[name], fmu[name])
    held = (np.diff(core["estimator.q"], axis=0) == 0.0).all(axis=1)
    assert held.sum() == pytest.approx(250 - 100, abs=1)


def test_a_seed_decides_the_sensor_and_the_wind() -> None:
    file = parsed(LOOP.replace("[manoeuvre]", "[wind]\nturbulence = 1.0\n[manoeuvre]"))
    with Instances() as instances:
        first, again, other = (
            running.run(file.case(seed=seed), instances, Path()).recording["quadrotor.position"]
            for seed in (1, 1, 2)
        )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-4


def test_a_named_sensor_gives_the_imu_its_errors() -> None:
    assert parsed(OPEN).case().scenario.sensor_parameters() == {}
    named = parsed('sensor = "adis16405"\n' + OPEN).case().scenario.sensor_parameters()
    assert named["gyro_noise_density"] == 6.17e-4
    assert named["gyro_bandwidth"] == 330.0
    assert named["mag_bandwidth"] == 0.0
    with Instances() as instances:
        assert len(outcome(parsed('sensor = "adis16405"\n' + OPEN), instances).recording) == 2000


def test_a_connection_replaces_that_of_the_template_to_the_same_input() -> None:
    text = 'connections = ["quadrotor.q -> controller.q", "quadrotor.rate -> controller.rate"]\n' + LOOP
    connections = parsed(text).case().scenario.connections
    assert "estimator.q -> controller.q" not in connections
    assert "estimator.rate -> controller.rate" not in connections
    assert len(connections) == len(parsed(LOOP).case().scenario.connections)


def test_a_users_class_is_a_component(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from ahrs_fmu.component import Component, Input, Output\n"
        "class Doubler(Component):\n"
        "    gyro = Input(size=3, default=[0, 0, 0], unit='rad/s')\n"
        "    twice = Output(size=3, default=[0, 0, 0], unit='rad/s')\n"
        "    def update(self, dt):\n"
        "        self.twice = 2.0 * self.gyro\n"
    )
    text = (
        'connections = ["imu.gyro -> doubler.gyro"]\nrecord = ["doubler.twice", "imu.gyro"]\n'
        + OPEN
        + '[components.doubler]\nclass = "mine.py:Doubler"\n'
    )
    with Instances() as instances:
        recording = outcome(parsed(text, tmp_path), instances).recording
    np.testing.assert_array_equal(recording["doubler.twice"], 2.0 * recording["imu.gyro"])


def test_a_class_that_raises_stops_the_run_and_what_was_recorded_is_kept(tmp_path: Path) -> None:
    (tmp_path / "failing.py").write_text(
        "from ahrs_fmu.component import Component, Output\n"
        "class Clock(Component):\n"
        "    count = Output(default=0.0)\n"
        "    def update(self, dt):\n"
        "        self.count += 1.0\n"
        "        if self.count > 5.0:\n"
        "            raise RuntimeError('spring broken')\n"
    )
    text = (
        'duration = 1.0\nstep = 0.1\nrecord = ["clock.count"]\n'
        '[components.clock]\nclass = "failing.py:Clock"\n'
    )
    with Instances() as instances:
        found = outcome(parsed(text, tmp_path), instances)
    assert "clock failed in the step to 0.6 s" in found.failure
    assert "RuntimeError: spring broken" in found.failure
    assert not found.passed
    np.testing.assert_array_equal(found.recording["clock.count"], [1.0, 2.0, 3.0, 4.0, 5.0])


def test_an_fmu_takes_the_place_of_the_templates_model_and_needs_a_binary_for_this_machine(
    tmp_path: Path,
) -> None:
    other = "x86_64-windows" if host_platform() != "x86_64-windows" else "x86_64-linux"
    build_fmu("gcf", fmi="3", platforms=[other], output=tmp_path)
    text = OPEN.replace("[vary]", "[components.estimator]\nfmu = 'fmi3/GCF.fmu'\n[other]")
    text = text.split("[other]")[0]
    with pytest.raises(
        ScenarioError, match=f"components.estimator: GCF.fmu: has no binary for .* only for {other}"
    ):
        run_all(text, tmp_path)
    build_fmu("gcf", fmi="3", output=tmp_path)
    run_all(text, tmp_path)


def test_an_fmu_instance_is_used_again_by_the_next_run() -> None:
    file = parsed(LOOP).computed_by("fmu3")
    with Instances() as instances:
        first = running.assemble(file.case(), instances, Path())
        one = first.run(0.2, ["quadrotor.q"])["quadrotor.q"]
        second = running.assemble(file.case(), instances, Path())
        two = second.run(0.2, ["quadrotor.q"])["quadrotor.q"]
    assert second.components["estimator"] is first.components["estimator"]
    np.testing.assert_array_equal(one, two)


def test_the_manoeuvre_gives_rates_and_accelerations_of_its_attitude() -> None:
    roll, turn = Profile(trapezoids=((1.0, 5.0, 1.0, 20.0),)), Profile(trapezoids=((0.5, 6.0, 1.0, 0.5),))
    step, rows = 0.001, 6000
    played = Manoeuvre(roll_deg=roll, yaw_rate=turn).playback(step, rows)
    names = ["q_ref", "rate_ref", "angular_acceleration_ref", "thrust"]
    found = played.replay({}, names, step, rows)
    q, rate = found["q_ref"], found["rate_ref"]
    between = 0.5 * (rate[1:] + rate[:-1])
    turned = quaternion.log(quaternion.multiply(quaternion.conjugate(q[:-1]), q[1:])) / step
    assert np.abs(turned - between).max() < 1e-3
    slope = np.gradient(rate, step, axis=0)
    assert np.abs(slope - found["angular_acceleration_ref"])[2:-2].max() < 1e-2
    tilt = np.cos(np.radians(roll(step * np.arange(1, rows + 1))))
    np.testing.assert_allclose(found["thrust"], 9.80665 / tilt)


def test_turbulence_has_the_spread_and_memory_it_is_given() -> None:
    wind = Wind(mean=(5.0, 0.0, 0.0), turbulence=2.0, turbulence_time=1.0)
    velocity = wind.playback(0.05, 40_000, seed=3).replay({}, ["velocity"], 0.05, 40_000)["velocity"]
    assert np.abs(velocity.mean(axis=0) - [5.0, 0.0, 0.0]).max() < 0.3
    np.testing.assert_allclose(velocity.std(axis=0), 2.0, rtol=0.05)
    centred = velocity[:, 1]
    after_one_second = np.mean(centred[:-20] * centred[20:]) / np.var(centred)
    assert after_one_second == pytest.approx(np.exp(-1.0), abs=0.06)


BEFORE = "[manoeuvre]"
BIAS = "[faults.f]\nkind = 'bias'\n"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("quadrotor-attitude", "plane", "template = 'plane' is unknown; there are estimation, quadrotor-"),
        ("duration = 1.0", "duration = -1.0", "duration: Expected `float` > 0.0"),
        ("duration = 1.0", "durations = 1.0", "unknown field `durations`"),
        ("duration = 1.0", "duration = ", "this is no TOML"),
        ("attitude_error.total", "attitude_error.totl", "'attitude_error.totl' was not recorded"),
        ("attitude_error.total", "estimator.qq", "estimator has no such output"),
        (BEFORE, "[components.imu]\nmodel = 'gyro'", "components.imu: there is no model 'gyro'"),
        (BEFORE, "[components.imu]\nparameters.sed = 1", "components.imu: IMU has no parameter 'sed'"),
        (
            BEFORE,
            "[components.imu]\nmodel = 'imu'\nfmu = 'a.fmu'",
            "components.imu: .*exactly one of model, fmu, class",
        ),
        (BEFORE, "[components.x]\nfmu = 'x.fmu'", "components.x: .*x.fmu: No such file"),
        (BEFORE, "[components.x]\nclass = 'x.py'", "components.x: .*not of the form FILE:CLASS"),
        (
            BEFORE,
            BIAS + "signal = 'imu.gyr'\namount = 1",
            "faults.f: signal = 'imu.gyr': imu has no such output",
        ),
        (BEFORE, BIAS + "signal = 'imu.gyro'", "faults.f: .*missing required field `amount`"),
        (BEFORE, BIAS + "signal = 'imu.gyro'\namount = '1 uT'", "faults.f: .*'uT' does not measure"),
        (BEFORE, "[vary]\n'components.imu.model' = ['imu', 'x']", "there is no model 'x'"),
        (BEFORE, "[vary]\n'duration.x' = [1]", "'duration' is no table"),
        ("[[expect]]", "connections = ['imu.gyro -> pilot.gyro']\n[[expect]]", "unknown field `connections`"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line_that_names_file_and_key(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    text = LOOP.replace(old, f"{new}\n[manoeuvre]" if old == BEFORE else new)
    with pytest.raises(ScenarioError, match=f"test.cosim.toml: .*{words}") as raised:
        run_all(text, tmp_path)
    assert "\n" not in str(raised.value)


def run_all(text: str, folder: Path) -> None:
    with Instances() as instances:
        for case in parsed(text, folder).cases():
            running.run(case, instances, folder)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        scenario.read(tmp_path / "none.cosim.toml")


def test_a_table_that_varies_is_laid_over_the_file_and_named_by_its_source(tmp_path: Path) -> None:
    varied = (
        '[vary]\n"components.estimator" = [{ model = "gcf", parameters = { kp = 0.3 } }, { model = "kcf" }]\n'
    )
    (tmp_path / "loop.cosim.toml").write_text(LOOP + varied)
    cases = list(scenario.read(tmp_path / "loop.cosim.toml").cases())
    assert [case.label for case in cases] == ["estimator=gcf-seed=1", "estimator=kcf-seed=1"]
    assert cases[0].scenario.components["estimator"].parameters == {"initialisation": "given", "kp": 0.3}
    assert cases[1].scenario.components["estimator"].parameters == {"initialisation": "given"}


def test_cases_that_cannot_be_told_apart_are_refused(tmp_path: Path) -> None:
    twice = (
        '[vary]\n"components.estimator" = [{ model = "gcf" }, { model = "gcf", parameters = { kp = 0.3 } }]\n'
    )
    (tmp_path / "loop.cosim.toml").write_text(LOOP + twice)
    with pytest.raises(ScenarioError, match=r"vary: two cases are called estimator=gcf-seed=1"):
        scenario.read(tmp_path / "loop.cosim.toml")


def test_a_scenario_is_the_template_of_another(tmp_path: Path) -> None:
    (tmp_path / "open.cosim.toml").write_text(OPEN)
    (tmp_path / "longer.cosim.toml").write_text('template = "open.cosim.toml"\nduration = 30.0\n')
    (case,) = scenario.read(tmp_path / "longer.cosim.toml").cases()
    assert case.scenario.duration == 30.0
    assert case.scenario.expect[0].at_most == "10 deg"
    (tmp_path / "lost.cosim.toml").write_text('template = "none.cosim.toml"\n')
    with pytest.raises(ScenarioError, match=r"lost.cosim.toml: template = 'none.cosim.toml': there is no"):
        scenario.read(tmp_path / "lost.cosim.toml")

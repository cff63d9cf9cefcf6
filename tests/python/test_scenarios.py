from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from ahrs_fmu import quaternion, scenarios, sensors, trajectories
from ahrs_fmu.errors import ScenarioError

DEG = np.pi / 180.0
ALL = scenarios.names()

# Golden inputs that share a scenario's motion: how many samples later the scenario does the same.
SHARED_MOTION = {
    "me_hover": ("me/hover", 0),
    "ac_swing": ("ac/swing", 0),
    "cg_hand": ("cg/hand", 600),
    "gc_lin": ("gc/lin", 0),
    "gc_circ": ("gc/circ", 0),
}


def angle(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.linalg.norm(quaternion.log(quaternion.multiply(quaternion.conjugate(p), q)), axis=-1)


@pytest.mark.parametrize(("trace", "scenario"), SHARED_MOTION.items())
def test_the_true_motion_is_the_golden_one(golden_dir: Path, trace: str, scenario: tuple[str, int]) -> None:
    golden = np.load(golden_dir / f"{trace}.npz")
    name, shift = scenario
    definition = scenarios.describe(name)
    assert definition.sample_time == pytest.approx(float(golden["sample_time"]), rel=1e-12)
    q = scenarios.truth(definition).q[shift : shift + golden["q_true"].shape[0]]
    assert angle(golden["q_true"], q).max() < 1e-11


@pytest.mark.parametrize(("trace", "scenario"), SHARED_MOTION.items())
def test_the_golden_readings_are_the_truth_with_the_sensors_errors(
    golden_dir: Path, trace: str, scenario: tuple[str, int]
) -> None:
    golden = np.load(golden_dir / f"{trace}.npz")
    name, shift = scenario
    definition = scenarios.describe(name)
    truth = scenarios.truth(definition)
    rows = slice(shift, shift + golden["q_true"].shape[0])
    sensor = sensors.load(definition.sensor)
    for reading, true, triad in (
        (golden["gyro"], truth.gyro[rows], sensor.gyro),
        (golden["accel"], truth.accel[rows], sensor.accel),
        (golden["mag"] * 1e-6, truth.mag[rows], sensor.mag),
    ):
        error = reading - true
        # Differences of neighbours hold the white noise twice and nothing of the bias.
        white = np.diff(error, axis=0).std() / np.sqrt(2.0)
        assert white == pytest.approx(triad.white_std(definition.sample_time), rel=0.03)
        if triad.bias_walk == 0.0:
            limit = 4.0 * white / np.sqrt(error.shape[0])
            np.testing.assert_allclose(error.mean(axis=0), triad.bias, atol=limit)


@pytest.mark.parametrize("name", ALL)
def test_truth_is_consistent_with_itself(name: str) -> None:
    definition = scenarios.describe(name)
    truth = scenarios.truth(definition)
    turned = [truth.q[0]]
    for rate in truth.gyro[1:200]:
        turned.append(quaternion.multiply(turned[-1], quaternion.exp(rate * definition.sample_time)))
    assert angle(np.array(turned), truth.q[:200]).max() < 1e-9
    np.testing.assert_allclose(np.linalg.norm(truth.mag, axis=-1), 5e-5, rtol=1e-12)
    np.testing.assert_allclose(
        quaternion.rotate(truth.q, truth.mag), np.tile(definition.field, (len(truth.time), 1)), atol=1e-17
    )


@pytest.mark.parametrize("name", ALL)
def test_a_seed_gives_one_record_and_another_seed_another(name: str) -> None:
    first, again, other = (scenarios.load(name, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.gyro, again.gyro)
    assert not np.array_equal(first.mag, other.mag)
    np.testing.assert_array_equal(first.q_true, other.q_true)
    assert first.name == name


def test_the_table_holds_the_published_experiments() -> None:
    published = "me/static me/dynamic me/hover ac/fixed-x ac/fixed-y ac/fixed-z ac/swing cg/hand gc/static"
    assert set(published.split()) | {"gc/lin", "gc/circ", "gc/hw-slide", "gc/hw-circ"} <= set(ALL)


@pytest.mark.parametrize(
    ("name", "rate", "duration"),
    [("me/static", 66, 300), ("me/dynamic", 66, 68), ("ac/swing", 100, 60), ("cg/hand", 250, 40)],
)
def test_rate_and_duration_are_the_published_ones(name: str, rate: int, duration: int) -> None:
    record = scenarios.load(name)
    assert record.sample_time == pytest.approx(1 / rate)
    assert len(record) == rate * duration


def test_the_bias_ramp_of_the_static_run_ends_where_it_should() -> None:
    simulation = scenarios.simulate("me/static")
    np.testing.assert_array_equal(simulation.gyro_bias[0], 0.0)
    np.testing.assert_allclose(
        simulation.gyro_bias[-1] / DEG, (-1.45, 0.435, 0.29), rtol=1.01 / len(simulation.record)
    )
    noise = simulation.record.gyro - simulation.gyro_bias
    assert noise.std() == pytest.approx(0.05 * DEG, rel=0.01)


def test_only_the_swing_itself_is_evaluated() -> None:
    record = scenarios.load("ac/swing")
    assert record.evaluate is not None
    counted = record.time[record.evaluate]
    assert counted[[0, -1]] == pytest.approx([7.0, 53.0])
    assert scenarios.load("gc/lin").evaluate is None


def test_the_initial_attitude_is_that_of_the_mean_reading() -> None:
    simulation = scenarios.simulate("ac/swing")
    definition = simulation.scenario.filter_noise
    tilt, heading = definition.accel_std / 9.8, definition.mag_std / 4e-5
    limit = 4.0 * np.hypot(tilt, heading) / np.sqrt(50)
    assert angle(simulation.q0, simulation.record.q_true[0]) < limit
    exact = scenarios.truth(simulation.scenario)
    np.testing.assert_allclose(
        scenarios.initial_attitude(
            scenarios.Record(exact.time, exact.gyro, exact.accel, exact.mag), samples=1
        ),
        exact.q[0],
        atol=1e-15,
    )


def test_a_level_multirotor_accelerates_towards_its_tilt_and_feels_thrust_and_drag_only() -> None:
    definition = scenarios.describe("me/dynamic")
    truth = scenarios.truth(definition)
    north_east = quaternion.rotate(truth.q, truth.accel) + np.array([0.0, 0.0, 9.8])
    np.testing.assert_allclose(north_east[:, 2], 0.0, atol=1e-12)
    k = int(7 * definition.rate)
    assert north_east[k, 1] > 0.0
    # Velocity from the acceleration: thrust minus drag must give that acceleration back.
    velocity = np.cumsum(north_east, axis=0) / definition.rate - north_east / definition.rate
    thrust = north_east + 0.5 * velocity
    np.testing.assert_allclose(thrust[k, 1], 9.8 * np.tan(20 * DEG), rtol=1e-6)


def test_the_pivots_acceleration_agrees_with_rigid_body_kinematics() -> None:
    definition = scenarios.describe("ac/swing")
    truth = scenarios.truth(definition)
    rate = 0.5 * (truth.gyro[1:-1] + truth.gyro[2:])
    rotation_acceleration = np.diff(truth.gyro[1:], axis=0) * definition.rate
    arm = np.array([0.05, 0.03, 0.1])
    expected = np.cross(rotation_acceleration, arm) + np.cross(rate, np.cross(rate, arm))
    gravity = quaternion.rotate(quaternion.conjugate(truth.q), [0.0, 0.0, -9.8])
    np.testing.assert_allclose((truth.accel - gravity)[1:-1], expected, atol=2e-3)


def test_a_circle_pulls_to_its_centre_on_the_right() -> None:
    definition = scenarios.describe("gc/circ")
    truth = scenarios.truth(definition)
    k = int(25 * definition.rate)
    np.testing.assert_allclose(truth.accel[k], (0.0, 4.0, -9.8), atol=1e-9)
    np.testing.assert_allclose(truth.gyro[k], (0.0, 0.0, 2.0), atol=1e-9)


def test_shapes_reach_their_heights_smoothly() -> None:
    t = np.array([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0])
    np.testing.assert_allclose(
        trajectories.trapezoid(t, 1.0, 5.0, 1.0, 2.0), (0, 0, 1, 2, 2, 2, 0), atol=1e-15
    )
    np.testing.assert_allclose(
        trajectories.s_curve(t, 1.0, 5.0, 20.0), (0, 0, 0.625, 2.5, 10, 17.5, 20), atol=1e-15
    )


def test_variants_run_without_a_name_of_their_own() -> None:
    short = msgspec.structs.replace(scenarios.describe("gc/lin"), duration=2.0, sensor="mpu9250")
    assert len(scenarios.run(short).record) == 100


def test_an_unknown_scenario_is_refused_with_the_known_names() -> None:
    with pytest.raises(ScenarioError, match=r"'gc/loop' is unknown; known are .*gc/lin"):
        scenarios.load("gc/loop")


@pytest.mark.parametrize("entry", [{"motion": {"kind": "train"}}, {"rate": -1.0}, {"rolls": {}}])
def test_a_scenario_with_a_wrong_entry_is_refused(entry: dict[str, object]) -> None:
    data = msgspec.to_builtins(scenarios.describe("gc/lin")) | entry
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(data, scenarios.Scenario)

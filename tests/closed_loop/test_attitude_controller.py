"""The attitude controller in C: signs, limits, mixing, integral, and the loop with the vehicle."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.native import NativeModel

Array = NDArray[np.float64]

TICK = 0.004
THRUST, TORQUE = 1.3e-5, 2.35e-7
DISTANCE = 0.225 / np.sqrt(2.0)
LOW, HIGH = THRUST * 100.0**2, THRUST * 750.0**2


def native(name: str, **parameters: object) -> NativeModel:
    descriptor = descriptors.load(name)
    model = NativeModel(descriptor)
    for parameter, value in parameters.items():
        model.set(parameter, descriptor.numbers(descriptor.parameter(parameter), value))
    model.reset()
    return model


def command(model: NativeModel, **inputs: ArrayLike) -> Array:
    """Rotor speeds for inputs."""
    for name, value in inputs.items():
        model.set(name, value)
    model.update(TICK)
    model.compute_outputs()
    return np.asarray(model.get("rotor_speed_command"), dtype=float)


def effect(speed: Array) -> tuple[float, Array]:
    """Total thrust and moment of the rotors, from their places."""
    place = DISTANCE * np.array([[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]])
    sense = np.array([-1.0, -1.0, 1.0, 1.0])
    thrust = THRUST * speed**2
    return float(thrust.sum()), np.array(
        [-(place[:, 1] @ thrust), place[:, 0] @ thrust, -(sense @ speed**2) * TORQUE]
    )


def test_it_starts_with_hover() -> None:
    model = native("attitude_controller")
    model.compute_outputs()
    assert effect(np.asarray(model.get("rotor_speed_command")))[0] == pytest.approx(9.80665)


def test_on_the_reference_it_gives_the_thrust_and_no_moment() -> None:
    thrust, moment = effect(command(native("attitude_controller"), thrust=12.0))
    assert thrust == pytest.approx(12.0)
    assert moment == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_an_attitude_error_is_turned_back(axis: int, sign: float) -> None:
    error = 0.02 * sign * np.eye(3)[axis]
    _, moment = effect(command(native("attitude_controller"), q=quaternion.exp(error)))
    gain = np.array([6.0 * 20.0, 6.0 * 20.0, 2.5 * 6.0]) * np.array([0.0095, 0.01, 0.018])
    assert moment == pytest.approx(-gain * 2.0 * np.sin(0.5 * error), abs=1e-9)


def test_either_sign_of_the_estimate_is_the_same_attitude() -> None:
    q = quaternion.exp([0.3, -0.2, 0.1])
    assert np.array_equal(
        command(native("attitude_controller"), q=q), command(native("attitude_controller"), q=-q)
    )


def test_feed_forward_asks_for_the_rate_and_the_acceleration_of_the_reference() -> None:
    model = native("attitude_controller")
    rate = np.array([0.5, -0.3, 0.2])
    _, moment = effect(command(model, rate_ref=rate, rate=rate, angular_acceleration_ref=[0.6, 0.5, 0.4]))
    inertia = np.array([0.0095, 0.01, 0.018])
    assert moment == pytest.approx(inertia * [0.6, 0.5, 0.4] + np.cross(rate, inertia * rate), abs=1e-12)


def test_feed_forward_is_turned_from_reference_axes_to_body_axes() -> None:
    model = native("attitude_controller", attitude_gain=[0.0, 0.0, 0.0])
    q, q_ref = quaternion.exp([0.0, 0.0, 0.2]), quaternion.exp([0.4, 0.0, 0.2])
    rate_ref = np.array([0.1, 0.5, -0.2])
    away = quaternion.multiply(quaternion.conjugate(q), q_ref)
    rate = quaternion.rotate(away, rate_ref)
    _, moment = effect(command(model, q=q, q_ref=q_ref, rate_ref=rate_ref, rate=rate))
    inertia = np.array([0.0095, 0.01, 0.018])
    assert moment == pytest.approx(np.cross(rate, inertia * rate), abs=1e-12)


def test_the_integral_removes_a_lasting_rate_error_and_stops_at_its_limit() -> None:
    model = native("attitude_controller", attitude_gain=[0.0, 0.0, 0.0], integral_limit=[0.5, 10.0, 2.0])
    for _ in range(100):
        command(model, rate=[-0.01, -0.01, 0.0])
    _, moment = effect(command(model, rate=[0.0, 0.0, 0.0]))
    assert moment[0] == pytest.approx(0.0095 * 20.0 * 0.01 * 0.4, rel=1e-6)
    for _ in range(2000):
        command(model, rate=[-0.05, 0.0, 0.0])
    assert effect(command(model, rate=[0.0, 0.0, 0.0]))[1][0] == pytest.approx(0.0095 * 0.5, rel=1e-6)


def test_the_wanted_rate_is_limited() -> None:
    _, moment = effect(
        command(
            native("attitude_controller", rate_limit=[0.1, 4.0, 1.5]), q_ref=quaternion.exp([1.0, 0.0, 0.0])
        )
    )
    assert moment[0] == pytest.approx(0.0095 * 20.0 * 0.1, rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_rotors_stay_within_limits_whatever_is_asked(seed: int) -> None:
    random = np.random.default_rng(seed)
    speed = command(
        native("attitude_controller"),
        q=quaternion.normalise(random.standard_normal(4)),
        rate=random.uniform(-20.0, 20.0, 3),
        thrust=random.uniform(-20.0, 60.0),
    )
    assert np.all(speed >= 100.0 * (1.0 - 1e-12))
    assert np.all(speed <= 750.0 * (1.0 + 1e-12))


def test_roll_and_pitch_come_before_thrust_and_yaw() -> None:
    model = native("attitude_controller")
    error = quaternion.exp([-0.3, 0.2, -1.0])
    asked = np.array([0.0095, 0.01]) * 120.0 * -2.0 * error[1:3]
    thrust, moment = effect(command(model, q=error, thrust=4.0 * HIGH))
    assert moment[:2] == pytest.approx(asked, rel=1e-9)
    assert thrust < 4.0 * HIGH
    assert 0.0 <= moment[2] < 0.018 * 15.0 * 2.0 * np.sin(0.5)
    assert model.get("saturated")[0] == 1


def test_an_impossible_moment_keeps_its_direction() -> None:
    model = native("attitude_controller", rate_gain=[200.0, 200.0, 6.0])
    _, moment = effect(command(model, rate=[-9.5e-1, 1.8e-0, 0.0]))
    assert moment[0] / moment[1] == pytest.approx(-0.0095 * 0.95 / (0.01 * 1.8), rel=1e-9)
    assert abs(moment[0]) + abs(moment[1]) == pytest.approx((HIGH - LOW) * 2.0 * DISTANCE, rel=1e-9)


def test_the_integral_waits_while_the_mixer_cuts() -> None:
    model = native("attitude_controller", rate_gain=[200.0, 20.0, 6.0])
    for _ in range(50):
        command(model, rate=[-10.0, 0.0, 0.0])
    assert effect(command(model, rate=[0.0, 0.0, 0.0]))[1][0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
@pytest.mark.parametrize("name", ["q", "q_ref", "rate", "rate_ref", "angular_acceleration_ref", "thrust"])
def test_inputs_that_cannot_be_hold_the_last_command(name: str, value: float) -> None:
    model = native("attitude_controller")
    last = command(model, q=quaternion.exp([0.01, 0.02, 0.0]))
    kept = np.array(model.get(name))
    assert np.array_equal(command(model, **{name: np.full_like(kept, value)}), last)
    assert not np.array_equal(command(model, **{name: kept, "thrust": 10.0}), last)


def test_an_estimate_without_an_attitude_is_not_obeyed() -> None:
    model = native("attitude_controller")
    last = command(model, q=quaternion.exp([0.01, 0.02, 0.0]))
    assert np.array_equal(command(model, q=[0.0, 0.0, 0.0, 0.0]), last)


def flight(seconds: float) -> dict[str, Array]:
    """Vehicle and controller on the true attitude, on a smooth manoeuvre."""
    plant, controller = native("quadrotor"), native("attitude_controller")
    rows: dict[str, list[Array]] = {"euler": [], "reference": [], "saturated": []}
    for k in range(round(seconds / TICK)):
        controller.compute_outputs()
        plant.set("rotor_speed_command", controller.get("rotor_speed_command"))
        plant.update(TICK)
        plant.compute_outputs()
        time = (k + 1) * TICK
        reference = np.array([0.4 * np.sin(2.0 * time), 0.3 * np.sin(1.4 * time), 0.8 * np.sin(0.5 * time)])
        slope = np.array([0.8 * np.cos(2.0 * time), 0.42 * np.cos(1.4 * time), 0.4 * np.cos(0.5 * time)])
        roll, pitch, _ = reference
        body = np.array([[1.0, 0.0, -np.sin(pitch)], [0.0, np.cos(roll), np.sin(roll) * np.cos(pitch)],
                         [0.0, -np.sin(roll), np.cos(roll) * np.cos(pitch)]])  # fmt: skip
        controller.set("q_ref", quaternion.from_euler(reference))
        controller.set("rate_ref", body @ slope)
        controller.set("thrust", 9.80665 / (np.cos(roll) * np.cos(pitch)))
        controller.set("q", plant.get("q"))
        controller.set("rate", plant.get("rate"))
        controller.update(TICK)
        controller.compute_outputs()
        rows["euler"].append(np.array([plant.get(name)[0] for name in ("roll", "pitch", "yaw")]))
        rows["reference"].append(reference)
        rows["saturated"].append(controller.get("saturated"))
    return {name: np.array(values) for name, values in rows.items()}


def test_on_the_true_attitude_the_vehicle_follows_a_manoeuvre() -> None:
    y = flight(10.0)
    error = (y["euler"] - y["reference"])[500:]
    assert np.sqrt(np.mean(error**2, axis=0)).max() < np.radians(3.0)
    assert not y["saturated"].any()

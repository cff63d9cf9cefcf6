"""The quadrotor in C against an integrator of high order and against the laws of conservation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.errors import ParameterError
from ahrs_fmu.native import NativeModel, Precision

Array = NDArray[np.float64]

FRONT_RIGHT = np.array([[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]])
SENSE = np.array([-1.0, -1.0, 1.0, 1.0])
TICK = 0.004
HOLD = 25
"""Ticks for which the manoeuvre holds its commands."""


def parameters(**changes: object) -> dict[str, Array]:
    """Every parameter of the model as an array, with changes."""
    descriptor = descriptors.load("quadrotor")
    values = {p.name: np.array(descriptor.numbers(p, p.default)) for p in descriptor.parameters}
    return values | {
        name: np.array(descriptor.numbers(descriptor.parameter(name), v)) for name, v in changes.items()
    }


def model(precision: Precision = "double", **changes: object) -> NativeModel:
    native = NativeModel(descriptors.load("quadrotor"), precision)
    for name, value in parameters(**changes).items():
        native.set(name, value)
    native.reset()
    return native


def derivative(x: Array, p: dict[str, Array], command: Array, wind: Array) -> tuple[Array, Array]:
    """State derivative and specific force at the IMU, docs/vehicle.md section 1 in matrix form."""
    velocity, q, rate, speed = x[3:6], x[6:10] / np.linalg.norm(x[6:10]), x[10:13], x[13:17]
    c = quaternion.to_matrix(q)
    speed_change = (np.clip(command, p["rotor_speed_min"], p["rotor_speed_max"]) - speed) / p[
        "rotor_time_constant"
    ]
    hubs = np.column_stack((FRONT_RIGHT * p["arm_length"] / np.sqrt(2.0), np.full(4, -p["rotor_height"][0])))
    air = c.T @ (velocity - wind)
    hub_air = air + np.cross(rate, hubs)
    forces = np.column_stack(
        (
            -p["rotor_drag_coefficient"] * speed * hub_air[:, 0],
            -p["rotor_drag_coefficient"] * speed * hub_air[:, 1],
            -p["thrust_coefficient"] * speed**2,
        )
    )
    force = forces.sum(axis=0) - 0.5 * p["air_density"] * np.linalg.norm(air) * p["drag_area"] * air
    moment = np.cross(hubs, forces).sum(axis=0)
    moment[2] -= np.sum(SENSE * (p["torque_coefficient"] * speed**2 + p["rotor_inertia"] * speed_change))
    momentum = p["inertia"] * rate + np.array([0.0, 0.0, np.sum(SENSE * p["rotor_inertia"] * speed)])
    acceleration = (moment - np.cross(rate, momentum)) / p["inertia"]
    velocity_change = c @ force / p["mass"] + np.array([0.0, 0.0, p["gravity"][0]])
    q_change = 0.5 * quaternion.multiply(x[6:10], np.concatenate(([0.0], rate)))
    place = p["imu_position"]
    felt = force / p["mass"] + np.cross(acceleration, place) + np.cross(rate, np.cross(rate, place))
    return np.concatenate((velocity, velocity_change, q_change, acceleration, speed_change)), felt


def manoeuvre(time: float) -> tuple[Array, Array]:
    """Rotor commands and wind that tumble and yaw the vehicle."""
    command = (
        440.0
        + 3.0 * np.cos(2.5 * time) * np.array([-1.0, 1.0, 1.0, -1.0])
        + 2.0 * np.cos(1.7 * time) * np.array([1.0, -1.0, 1.0, -1.0])
        + 9.0 * np.sin(0.7 * time) * np.array([1.0, 1.0, -1.0, -1.0])
    )
    return command, np.array([2.0 * np.sin(0.5 * time), 1.0, 0.3 * np.cos(time)])


def flown(native: NativeModel, ticks: int) -> dict[str, Array]:
    """Every output after each tick of the manoeuvre."""
    held = [manoeuvre((k - k % HOLD) * TICK) for k in range(ticks)]
    inputs = {
        "rotor_speed_command": np.array([command for command, _ in held]),
        "wind": np.array([wind for _, wind in held]),
    }
    names = [output.name for output in native.descriptor.outputs]
    return {
        name: np.asarray(v, dtype=float)
        for name, v in native.run(np.full(ticks, TICK), inputs, names).items()
    }


def integrated(p: dict[str, Array], ticks: int) -> tuple[Array, Array]:
    """States and specific forces after each hold by an integrator of eighth order."""
    x = np.concatenate(
        (
            p["initial_position"],
            p["initial_velocity"],
            p["initial_q"],
            p["initial_rate"],
            np.repeat(p["initial_rotor_speed"], 4),
        )
    )
    states, forces = [], []
    for k in range(0, ticks, HOLD):
        command, wind = manoeuvre(k * TICK)
        solution = solve_ivp(
            lambda _, y, c=command, w=wind: derivative(y, p, c, w)[0],
            (0.0, HOLD * TICK),
            x,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        x = solution.y[:, -1]
        states.append(x)
        forces.append(derivative(x, p, command, wind)[1])
    return np.array(states), np.array(forces)


def test_ten_seconds_of_manoeuvre_agree_with_an_integrator_of_eighth_order() -> None:
    ticks = 2500
    ours = {name: values[HOLD - 1 :: HOLD] for name, values in flown(model(), ticks).items()}
    states, forces = integrated(parameters(), ticks)
    turn = quaternion.log(quaternion.multiply(quaternion.conjugate(states[:, 6:10]), ours["q"]))
    assert np.ptp(np.unwrap(ours["yaw"].ravel())) > 1.0
    assert np.abs(ours["position"] - states[:, :3]).max() < 1e-6
    assert np.linalg.norm(turn, axis=1).max() < 1e-8
    assert np.abs(ours["velocity"] - states[:, 3:6]).max() < 1e-6
    assert np.abs(ours["rate"] - states[:, 10:13]).max() < 1e-7
    assert np.abs(ours["specific_force"] - forces).max() < 1e-6


def test_a_tumble_without_air_keeps_energy_and_angular_momentum() -> None:
    free = {
        "gravity": 0.0,
        "thrust_coefficient": 0.0,
        "torque_coefficient": 0.0,
        "rotor_drag_coefficient": 0.0,
        "air_density": 0.0,
        "initial_rate": [3.0, 0.1, 2.0],
        "initial_velocity": [1.0, 2.0, 3.0],
        "initial_rotor_speed": 400.0,
        "rotor_speed_min": 0.0,
    }
    native, p = model(**free), parameters(**free)
    commands = np.linspace(400.0, 100.0, 2500)[:, None] * np.array([1.0, 0.6, 0.9, 0.4])
    y = native.run(
        np.full(2500, TICK), {"rotor_speed_command": commands}, ["q", "rate", "rotor_speed", "velocity"]
    )
    carried = p["inertia"] * y["rate"]
    carried[:, 2] += p["rotor_inertia"] * (y["rotor_speed"] @ SENSE)
    momentum = quaternion.rotate(y["q"], carried)
    at_start = p["inertia"] * p["initial_rate"]
    assert np.abs(momentum - at_start).max() < 1e-9 * np.linalg.norm(at_start)
    assert np.abs(y["velocity"] - [1.0, 2.0, 3.0]).max() < 1e-12

    native.set("rotor_inertia", 0.0)
    native.reset()
    y = native.run(np.full(2500, TICK), {}, ["rate"])
    energy = 0.5 * np.sum(p["inertia"] * y["rate"] ** 2, axis=1)
    assert np.abs(energy / (0.5 * np.sum(p["inertia"] * p["initial_rate"] ** 2)) - 1.0).max() < 1e-9


def test_the_error_falls_with_the_fourth_power_of_the_inner_step() -> None:
    fine = flown(model(inner_step=0.0002), 250)["position"][-1]
    coarse = np.linalg.norm(flown(model(inner_step=0.004), 250)["position"][-1] - fine)
    medium = np.linalg.norm(flown(model(inner_step=0.002), 250)["position"][-1] - fine)
    assert 12.0 < coarse / medium < 20.0


def test_hover_is_an_equilibrium() -> None:
    hover = float(np.sqrt(9.80665 / (4.0 * 1.3e-5)))
    native = model(initial_rotor_speed=hover)
    y = native.run(
        np.full(2500, TICK),
        {"rotor_speed_command": np.full((2500, 4), hover)},
        ["position", "specific_force"],
    )
    assert np.abs(y["position"]).max() < 1e-9
    assert np.abs(y["specific_force"] - [0.0, 0.0, -9.80665]).max() < 1e-9


def test_the_default_start_is_hover() -> None:
    p = parameters()
    hover = np.sqrt(p["mass"] * p["gravity"] / (4.0 * p["thrust_coefficient"]))
    assert p["initial_rotor_speed"] == pytest.approx(hover, abs=0.005)


@pytest.mark.parametrize(
    ("change", "axis", "sign"),
    [([-1, 1, 1, -1], 0, 1), ([1, -1, 1, -1], 1, 1), ([1, 1, -1, -1], 2, 1)],
    ids=["left rotors roll right", "front rotors pitch up", "counter-clockwise rotors yaw right"],
)
def test_rotors_turn_the_vehicle_the_right_way(change: list[int], axis: int, sign: int) -> None:
    native = model()
    y = native.run(
        np.full(50, TICK),
        {"rotor_speed_command": np.tile(434.27 + 20.0 * np.array(change), (50, 1))},
        ["rate"],
    )
    turn = y["rate"][-1]
    assert np.argmax(np.abs(turn)) == axis
    assert np.sign(turn[axis]) == sign


def test_wind_pushes_along_its_own_direction() -> None:
    native = model()
    y = native.run(
        np.full(250, TICK), {"wind": np.tile([0.0, 5.0, 0.0], (250, 1))}, ["velocity", "specific_force"]
    )
    assert y["velocity"][-1, 1] > 0.5
    assert y["specific_force"][0, 1] > 0.0


def test_the_vehicle_lands_and_rests_on_the_ground() -> None:
    native = model(
        ground=True,
        initial_position=[0.0, 0.0, -1.0],
        initial_rotor_speed=0.0,
        rotor_speed_min=0.0,
        initial_velocity=[0.3, 0.0, 0.0],
    )
    y = native.run(
        np.full(1500, TICK),
        {"rotor_speed_command": np.zeros((1500, 4))},
        ["position", "velocity", "specific_force"],
    )
    sunk = 9.80665 / (4.0 * 2000.0)
    assert y["position"][-1, 2] == pytest.approx(-0.12 + sunk, abs=1e-6)
    assert np.abs(y["velocity"][-1]).max() < 1e-6
    assert y["specific_force"][-1] == pytest.approx([0.0, 0.0, -9.80665], abs=1e-5)


def test_without_ground_the_vehicle_falls_through_zero_height() -> None:
    native = model(rotor_speed_min=0.0, initial_rotor_speed=0.0)
    y = native.run(np.full(250, TICK), {"rotor_speed_command": np.zeros((250, 4))}, ["position"])
    assert y["position"][-1, 2] > 4.0


@pytest.mark.parametrize("wind", [[np.nan, 0.0, 0.0], [0.0, np.inf, 0.0], [0.0, 0.0, -1e30]])
def test_commands_and_wind_that_cannot_be_leave_the_last_ones_standing(wind: list[float]) -> None:
    native = model()
    native.set("rotor_speed_command", [440.0, 430.0, 435.0, 436.0])
    native.set("wind", [1.0, 2.0, 3.0])
    native.update(TICK)
    kept = native.save()
    native.update(TICK)
    native.compute_outputs()
    expected = native.get("rate")
    native.restore(kept)
    native.set("rotor_speed_command", [np.nan, np.inf, -np.inf, np.nan])
    native.set("wind", wind)
    native.update(TICK)
    native.compute_outputs()
    assert np.array_equal(native.get("rate"), expected)


@pytest.mark.parametrize("dt", [0.0, -0.01, np.nan, np.inf])
def test_a_step_that_is_no_time_changes_nothing(dt: float) -> None:
    native = model()
    native.update(TICK)
    before = native.save()
    native.update(dt)
    assert native.save() == before


def test_a_tick_is_cut_into_whole_inner_steps() -> None:
    """Ratios that are whole but for their rounding give no extra step: the bits tell."""
    by_tick, by_step = model(), model()
    for native, ticks, dt in ((by_tick, 100, 0.003), (by_step, 300, 0.001)):
        native.run(
            np.full(ticks, dt), {"rotor_speed_command": np.tile([440.0, 430.0, 437.0, 435.0], (ticks, 1))}, []
        )
        native.compute_outputs()
    assert by_tick.get("q") == pytest.approx(by_step.get("q"), abs=1e-14)


def test_single_precision_follows_double() -> None:
    single, double = flown(model("single"), 500), flown(model(), 500)
    assert np.abs(single["q"] - double["q"]).max() < 1e-3


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"rotor_speed_min": 800.0}, "rotor_speed_min <= rotor_speed_max"),
        ({"initial_q": [0.0, 0.0, 0.0, 0.0]}, "no direction"),
        ({"inner_step": 0.05}, "lower inner_step"),
        ({"mass": 0.0}, "mass = 0 kg"),
    ],
)
def test_impossible_vehicles_are_refused_by_name(changes: dict[str, object], text: str) -> None:
    with pytest.raises(ParameterError, match=text):
        descriptors.load("quadrotor").check({k: v.tolist() for k, v in parameters(**changes).items()})

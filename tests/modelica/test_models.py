"""Modelica models against the C models, against theory, and against their own twins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

import control
import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from modelica_libraries import Array, Simulation
from numpy.typing import ArrayLike

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.native import NativeModel
from loop_fmus import LoopFmus

Simulate = Callable[[str], Simulation]

mpl.use("Agg")

TICK = 0.004


def native(name: str, **parameters: object) -> NativeModel:
    descriptor = descriptors.load(name)
    model = NativeModel(descriptor)
    for parameter, value in parameters.items():
        model.set(parameter, descriptor.numbers(descriptor.parameter(parameter), value))
    model.reset()
    return model


def rotation_between(q: Array, p: Array) -> Array:
    """Angle between attitudes, rad."""
    return np.linalg.norm(quaternion.log(quaternion.multiply(quaternion.conjugate(q), p)), axis=-1)


def plot(
    path: Path, time: Array, curves: Mapping[str, tuple[Array, Array]], differences: Mapping[str, Array]
) -> None:
    """Both sources over each other, and below their differences."""
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for label, (modelica, other) in curves.items():
        (line,) = top.plot(time, np.unwrap(modelica), label=label, alpha=0.5, linewidth=3.0)
        top.plot(time, np.unwrap(other), "--", color=line.get_color(), linewidth=1.0)
    for label, difference in differences.items():
        bottom.semilogy(time, np.maximum(np.abs(difference), 1e-18), label=label)
    top.set_title("thick: Modelica, dashed: C")
    bottom.set(xlabel="time, s", ylabel="difference")
    for axes in (top, bottom):
        axes.legend(loc="upper left", ncols=3)
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=120)


def test_a_rigid_body_without_forces_keeps_momentum_and_energy(simulate: Simulate) -> None:
    y = simulate("AHRSTest.FreeTumble")
    assert (
        np.abs(
            y["momentum"] / np.linalg.norm(y["momentum"][0])
            - y["momentum"][0] / np.linalg.norm(y["momentum"][0])
        ).max()
        < 1e-9
    )
    assert np.abs(y["energy"] / y["energy"][0] - 1.0).max() < 1e-9
    assert np.abs(np.linalg.norm(y["body.q"], axis=1) - 1.0).max() < 1e-9


def test_the_quadrotor_flies_as_the_fmu(simulate: Simulate, plots: Path, loop_fmu: LoopFmus) -> None:
    y = simulate("AHRSTest.QuadrotorFlight")
    ticks = len(y.time) - 1
    assert ticks == 2500
    # Row k holds what the commands set at tick k - 1 led to, as the C model does.
    inputs = {"rotor_speed_command": y["command"][:-1], "wind": y["wind"][:-1]}
    with closing(loop_fmu("quadrotor", "3").instantiate()) as fmu:
        ours = fmu.replay(inputs, ["q", "position", "velocity"], TICK)
    angle = rotation_between(y["quadrotor.q"][1:], ours["q"])
    apart = np.linalg.norm(y["quadrotor.position"][1:] - ours["position"], axis=1)
    euler = quaternion.to_euler(y["quadrotor.q"][1:]), quaternion.to_euler(ours["q"])
    plot(
        plots / "quadrotor.png",
        y.time[1:],
        {f"{name}, rad": (euler[0][:, i], euler[1][:, i]) for i, name in enumerate(("roll", "pitch", "yaw"))},
        {"attitude, rad": angle, "position, m": apart},
    )
    assert np.linalg.norm(ours["position"][-1]) > 10.0
    assert angle.max() < 1e-7
    assert apart.max() < 1e-5
    assert np.abs(y["quadrotor.velocity"][1:] - ours["velocity"]).max() < 1e-6


@pytest.mark.parametrize(
    ("block", "model", "parameters"),
    [("gcf", "gcf", {}), ("third", "gcf", {"kp": 1.0, "ki": 0.3, "kii": 0.05}), ("mahony", "mahony", {})],
)
def test_sampled_filters_give_the_attitude_of_the_c_core(
    simulate: Simulate, plots: Path, block: str, model: str, parameters: dict[str, float]
) -> None:
    y, dt = simulate("AHRSTest.SampledFilters"), 0.02
    inputs = {name: y[f"imu.imu.{name}"][1:] for name in ("gyro", "accel", "mag")}
    ticks = len(y.time) - 1
    assert ticks == 1000
    ours = native(model, sample_time=dt, **parameters).run(
        np.full(ticks, dt), inputs, ["q", "gyro_bias", "rate"]
    )
    difference = np.abs(y[f"{block}.q"][1:] - ours["q"]).max(axis=1)
    euler = quaternion.to_euler(y[f"{block}.q"][1:]), quaternion.to_euler(ours["q"])
    plot(
        plots / f"sampled_{block}.png",
        y.time[1:],
        {f"{name}, rad": (euler[0][:, i], euler[1][:, i]) for i, name in enumerate(("roll", "pitch", "yaw"))},
        {
            "quaternion": difference,
            "bias, rad/s": np.abs(y[f"{block}.gyro_bias"][1:] - ours["gyro_bias"]).max(axis=1),
        },
    )
    assert np.ptp(euler[0][:, 0]) > 1.5
    assert difference.max() < 1e-10
    assert np.abs(y[f"{block}.gyro_bias"][1:] - ours["gyro_bias"]).max() < 1e-10
    assert np.abs(y[f"{block}.rate"][1:] - ours["rate"]).max() < 1e-10


@pytest.mark.parametrize("block", ["gcf", "mahony"])
def test_sampled_filters_begin_and_lose_sensors_as_the_c_core_does(simulate: Simulate, block: str) -> None:
    y, dt = simulate("AHRSTest.Dropouts"), 0.02
    # The changes of validity lie between the ticks and have rows of their own.
    ticks = np.flatnonzero(np.abs(y.time / dt - np.round(y.time / dt)) < 1e-6)[1:]
    assert len(ticks) == 500
    inputs = {name: y[f"imu.imu.{name}"][ticks] for name in ("gyro", "accel", "mag")}
    valid = {name: y[name][ticks].astype(np.int32) for name in ("accel_valid", "mag_valid")}
    assert [int(np.abs(np.diff(column)).sum()) for column in valid.values()] == [3, 3]
    model = native(block, sample_time=dt, bias_limit=0.003)
    ours = model.run(np.full(len(ticks), dt), inputs | valid, ["q", "gyro_bias"])
    assert np.abs(y[f"{block}.q"][ticks] - ours["q"]).max() < 1e-10
    assert np.abs(y[f"{block}.gyro_bias"][ticks] - ours["gyro_bias"]).max() < 1e-10
    assert np.abs(np.asarray(ours["gyro_bias"])).max() == 0.003


@pytest.mark.parametrize(
    ("block", "law"),
    [("first", [0.5]), ("second", [0.5, 0.1]), ("third", [1.0, 0.3, 0.05])],
    ids=["first order", "second order", "third order"],
)
def test_continuous_filters_have_the_step_response_of_theory(
    simulate: Simulate, block: str, law: list[float]
) -> None:
    """Error e of one axis: e' = -H e + b, H = KP + KI/s + KII/s^2; pitch starts with an error of 1e-3 rad."""
    y = simulate("AHRSTest.StepResponse")
    step, bias = 1e-3, 1e-4
    from_bias = control.feedback(
        control.tf([1.0], [1.0, 0.0]), control.tf(law, [1.0, *[0.0] * (len(law) - 1)])
    )
    forced = np.asarray(control.forced_response(from_bias, y.time, np.full(len(y.time), bias)).outputs)
    free = np.asarray(control.impulse_response(from_bias, y.time).outputs)
    error = y[f"{block}.euler"]
    assert np.abs(error[:, 1] - (forced - step * free)).max() < 1e-6
    assert np.abs(error[:, 2] - forced).max() < 1e-6
    assert np.abs(error[:, 0]).max() < 1e-7
    assert np.abs(forced).max() > 5e-5


def test_the_measured_frequency_response_is_that_of_the_formulas(simulate: Simulate, plots: Path) -> None:
    y = simulate("AHRS.Examples.FrequencyResponse")
    w = np.array([0.1, 0.2, 0.4, 0.6, 1.0, 2.0, 4.0])
    low = control.tf([0.5, 0.1], [1.0, 0.5, 0.1])
    high = control.tf([1.0, 0.0, 0.0], [1.0, 0.5, 0.1])
    for part, system in (("A", low), ("B", high)):
        expected = system(1j * w)
        measured = y[f"gain_{part}"][-1] * np.exp(1j * y[f"phase_{part}"][-1])
        assert np.abs(measured - expected).max() < 1e-6
        assert np.abs(y[f"theory_{part}"][-1] - np.abs(expected)).max() < 1e-12
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axes = figure.subplots()
    fine = np.geomspace(0.05, 8.0, 200)
    for part, system, name in (("A", low, "from the measured angle"), ("B", high, "from the gyroscope")):
        (line,) = axes.loglog(fine, np.abs(system(1j * fine)), label=name)
        axes.loglog(w, y[f"gain_{part}"][-1], "o", color=line.get_color())
    axes.set(
        xlabel="frequency, rad/s", ylabel="gain", title="Complementary pair: lines theory, points simulated"
    )
    axes.legend()
    axes.grid(which="both", alpha=0.3)
    figure.savefig(plots / "frequency_response.png", dpi=120)


def test_quaternion_functions_agree_with_their_twins(simulate: Simulate) -> None:
    y = simulate("AHRSTest.Functions")
    q, v = y["q"], np.array([1.0, -2.0, 3.0])
    assert np.abs(q - quaternion.from_euler(y["euler"])).max() < 1e-14
    assert np.abs(rotation_between(q, quaternion.from_euler(y["euler_again"]))).max() < 1e-7
    assert np.abs(y["rotated"] - quaternion.rotate(q, v)).max() < 1e-14
    assert np.abs(y["rotated_by_product"][:, 1:] - y["rotated"]).max() < 1e-14
    assert np.abs(y["back"] - v).max() < 1e-14
    assert np.abs(y["vector"] - quaternion.log(q)).max() < 1e-12
    assert np.abs(y["small"] - y["vector"]).max() < 1e-12
    assert np.abs(y["tiny"] - 1e-7 * v).max() < 1e-20
    assert rotation_between(y["measured"], q).max() < 1e-7
    assert np.abs(y["error"]).max() < 1e-14
    assert np.abs(y["length"] - 1.0).max() < 1e-15
    assert np.array_equal(y["smooth"], q)
    aligned = quaternion.rotate(y["aligned"], y["field"])
    assert np.abs(aligned[:, 1]).max() < 1e-14
    assert (aligned[:, 0] > 0.0).all()
    assert np.abs(aligned[:, 2] - quaternion.rotate(q, y["field"])[:, 2]).max() < 1e-14


def test_the_mixer_gives_what_is_asked_or_stays_within_limits(simulate: Simulate) -> None:
    y = simulate("AHRSTest.Mixing")
    thrust, free = y["y"][:, :4], (y["y"][:, 5] == 1.0) & (y["y"][:, 6] == 1.0)
    assert thrust.min() >= 0.13 - 1e-12
    assert thrust.max() <= 7.3 + 1e-12
    assert 0.1 < free.mean() < 0.9
    assert np.abs(y["achieved_torque"] - y["torque"])[free].max() < 1e-12
    unmoved = np.abs(y["y"][:, 4] - y["thrust"] / 4.0) < 1e-12
    assert np.abs(y["achieved_thrust"] - y["thrust"])[unmoved].max() < 1e-12
    uncut = y["y"][:, 5] == 1.0
    assert np.abs(y["achieved_torque"] - y["torque"])[uncut, :2].max() < 1e-12


def combined_generators(seed: int, count: int) -> Array:
    """The generator of AHRS.Functions in whole numbers."""
    a = 1 + (16807 * seed + 12345) % 2147483562
    b = 1 + (48271 * seed + 67890) % 2147483398
    uniform = []
    for k in range(10 + 2 * count):
        a, b = 40014 * a % 2147483563, 40692 * b % 2147483399
        if k >= 10:
            uniform.append(((a - b) % 2147483562 + 0.5) / 2147483562.0)
    pairs = np.array(uniform).reshape(-1, 2)
    return np.sqrt(-2.0 * np.log(pairs[:, 0])) * np.cos(2.0 * np.pi * pairs[:, 1])


def test_noise_is_that_of_the_generator_and_has_its_deviation(simulate: Simulate) -> None:
    y = simulate("AHRSTest.NoiseStatistics")
    expected = combined_generators(42, 12 * 1000).reshape(1000, 12)
    assert np.abs(y["imu.imu.gyro"][1:] - expected[:, 3:6]).max() < 1e-12
    assert np.abs(y["imu.imu.mag"][1:] - 3.0 * expected[:, 9:12]).max() < 1e-11
    for name, deviation in (("gyro", 1.0), ("accel", 2.0), ("mag", 3.0)):
        noise = y[f"imu.imu.{name}"][1:]
        assert noise.std() == pytest.approx(deviation, rel=0.05)
        assert np.abs(np.corrcoef(noise.T) - np.eye(3)).max() < 0.1
    assert np.abs(np.corrcoef(y["imu.imu.gyro"][1:, 0], y["other.imu.gyro"][1:, 0])[0, 1]) < 0.1


def test_the_faster_filter_levels_the_horizon_in_a_turn(simulate: Simulate) -> None:
    y = simulate("AHRS.Examples.BankAngle")
    in_turn = y.time > 8.0
    # Nothing but the crossover pulls the estimate away: the error grows with 1 - exp(-KP t).
    assert np.abs(y["fast_error"][in_turn]).max() > np.radians(25.0)
    assert np.abs(y["slow_error"][in_turn]).max() < np.radians(10.0)
    assert np.abs(y["imu.specific_force"][in_turn, 1]).max() < 1e-9


def loop_of_fmus(loop_fmu: LoopFmus, ticks: int) -> dict[str, Array]:
    """The example's loop with FMUs of FMI 3, in the order of docs/vehicle.md section 4."""
    plant, controller = (
        loop_fmu("quadrotor", "3").instantiate(),
        loop_fmu("attitude_controller", "3").instantiate(),
    )
    imu = loop_fmu("imu", "3").instantiate({"errors": False})
    estimator = loop_fmu("gcf", "3").instantiate({"sample_time": TICK})
    rows: dict[str, list[Array]] = {"q": [], "estimate": [], "position": []}
    controller.initialise()
    for k in range(1, ticks + 1):
        plant.set("rotor_speed_command", controller.get("rotor_speed_command"))
        plant.step(TICK)
        for name in ("q", "rate", "specific_force", "rotor_speed"):
            imu.set(name, plant.get(name))
        imu.step(TICK)
        for name in ("gyro", "accel", "mag"):
            estimator.set(name, imu.get(name))
        estimator.step(TICK)
        for name, value in references(k * TICK).items():
            controller.set(name, value)
        for name in ("q", "rate"):
            controller.set(name, estimator.get(name))
        controller.step(TICK)
        rows["q"].append(plant.get("q"))
        rows["estimate"].append(estimator.get("q"))
        rows["position"].append(plant.get("position"))
    for stepper in (plant, controller, imu, estimator):
        stepper.close()
    return {name: np.array(values) for name, values in rows.items()}


def references(time: float) -> dict[str, ArrayLike]:
    """Attitude, rate and thrust that the example asks for."""
    roll, pitch, yaw = 0.3 * np.sin(1.5 * time), 0.2 * np.sin(1.1 * time), 0.5 * np.sin(0.4 * time)
    d_roll, d_pitch, d_yaw = 0.45 * np.cos(1.5 * time), 0.22 * np.cos(1.1 * time), 0.2 * np.cos(0.4 * time)
    return {
        "q_ref": quaternion.from_euler([roll, pitch, yaw]),
        "rate_ref": [
            d_roll - np.sin(pitch) * d_yaw,
            np.cos(roll) * d_pitch + np.sin(roll) * np.cos(pitch) * d_yaw,
            -np.sin(roll) * d_pitch + np.cos(roll) * np.cos(pitch) * d_yaw,
        ],
        "thrust": 9.80665 / (np.cos(roll) * np.cos(pitch)),
    }


def test_the_closed_loop_flies_as_the_loop_of_fmus(
    simulate: Simulate, plots: Path, loop_fmu: LoopFmus
) -> None:
    y = simulate("AHRS.Examples.ClosedLoopQuadrotor")
    ticks = len(y.time) - 1
    assert ticks == 2500
    ours = loop_of_fmus(loop_fmu, ticks)
    angle = rotation_between(y["quadrotor.q"][1:], ours["q"])
    estimate = rotation_between(y["filter.q"][1:], ours["estimate"])
    euler = quaternion.to_euler(ours["q"])
    plot(
        plots / "closed_loop.png",
        y.time[1:],
        {f"{name}, rad": (y["euler"][1:, i], euler[:, i]) for i, name in enumerate(("roll", "pitch", "yaw"))},
        {"attitude, rad": angle, "estimate, rad": estimate},
    )
    assert np.ptp(euler[:, 0]) > 0.5
    assert angle.max() < 1e-6
    assert estimate.max() < 1e-6
    assert np.abs(y["quadrotor.position"][1:] - ours["position"]).max() < 1e-5


def test_the_loop_follows_its_reference_and_a_noisy_sensor_does_not_upset_it(simulate: Simulate) -> None:
    clean, noisy = simulate("AHRS.Examples.ClosedLoopQuadrotor"), simulate("AHRSTest.NoisyLoop")
    for y, limit in ((clean, 12.0), (noisy, 15.0)):
        error = y["euler"] - y["reference"]
        assert np.degrees(np.sqrt(np.mean(error**2, axis=0))).max() < limit
    assert np.abs(noisy["euler"] - clean["euler"]).max() > 1e-4

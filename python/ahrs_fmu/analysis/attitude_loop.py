"""Loop gain of a quadrotor that flies on an estimated attitude, by linear theory (docs/vehicle.md section 5).

Roll about hover, where all three models of the loop are linear: the plant held over each step, the sensors,
the estimator's linear model and the controller, broken at the rotors' commands.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from control import StateSpace
from numpy.typing import ArrayLike
from scipy.signal import cont2discrete

from ahrs_fmu import descriptors
from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.systems import Array

ROLL = (-1.0, 1.0, 1.0, -1.0)
"""The rotor speeds that roll the vehicle to the right: direction of the loop gain."""

Parameters = Mapping[str, ArrayLike]
_NONE: Parameters = MappingProxyType({})


def roll_loop(
    step: float,
    estimator: StateSpace | None = None,
    vehicle: Parameters = _NONE,
    controller: Parameters = _NONE,
    imu: Parameters = _NONE,
) -> StateSpace:
    """Return the gain once around the roll loop, from rotor command to rotor command.

    Parameters
    ----------
    step : float
        Communication step and sample time of all components, s.
    estimator : control.StateSpace, optional
        `ahrs_fmu.analysis.linear_model.linearise` for the roll axis, with its sensors separate; without one
        the true attitude and rate are fed back.
    vehicle, controller, imu : mapping of str to value, optional
        Parameters of `quadrotor`, `attitude_controller` and `imu` that differ from their defaults. Of the
        sensor count bandwidths and place; its magnetometer is taken to bring a sample at every step.

    Returns
    -------
    control.StateSpace
        L(z), positive for negative feedback.
    """
    v = _values("quadrotor", vehicle)
    c = _values("attitude_controller", controller)
    plant = _plant(v, step)
    if estimator is None:
        seen = systems.state_space([], [], [], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], step)
    else:
        seen = _with_rate(estimator, step) * _sensors(_values("imu", imu), v, step)
    return _controller(c, v, step) * seen * plant


def _values(model: str, changes: Parameters) -> dict[str, Array]:
    descriptor = descriptors.load(model)
    given = {p.name: changes.get(p.name, p.default) for p in descriptor.parameters}
    return {
        p.name: np.asarray(descriptor.numbers(p, given[p.name]), dtype=np.float64)
        for p in descriptor.parameters
    }


def _hover_speed(v: Mapping[str, Array]) -> float:
    return float(np.sqrt(v["mass"] * v["gravity"] / (4.0 * v["thrust_coefficient"]))[0])


def _effect(v: Mapping[str, Array]) -> float:
    """Moment about the roll axis per rotor speed along `ROLL`, N m s: 4 (l / sqrt 2) k_T Omega."""
    arm = v["arm_length"] / math.sqrt(2.0)
    return float((4.0 * arm * v["thrust_coefficient"])[0]) * _hover_speed(v)


def _plant(v: Mapping[str, Array], step: float) -> StateSpace:
    """From the command to roll angle (rad), roll rate (rad/s) and lateral specific force (m/s2).

    States: roll angle, roll rate, lateral velocity in body axes, rotor speed along `ROLL`.
    """
    mass, g, h, tau = (
        float(v[name][0]) for name in ("mass", "gravity", "rotor_height", "rotor_time_constant")
    )
    inertia, below = float(v["inertia"][0]), float(v["imu_position"][2])
    drag = 4.0 * float(v["rotor_drag_coefficient"][0]) * _hover_speed(v)
    side = np.array([0.0, -drag * h, -drag, 0.0])  # rotor drag, N
    angular = (h * side + np.array([0.0, 0.0, 0.0, _effect(v)])) / inertia
    a = np.array(
        [[0.0, 1.0, 0.0, 0.0], angular, side / mass + [g, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0 / tau]]
    )
    b = np.array([[0.0], [0.0], [0.0], [1.0 / tau]])
    outputs = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], side / mass - below * angular])
    held = cont2discrete((a, b, outputs, np.zeros((3, 1))), step, method="zoh")
    return systems.state_space(*held[:4], step)


def _sensors(imu: Mapping[str, Array], v: Mapping[str, Array], step: float) -> StateSpace:
    """From the plant's outputs to what accelerometer and magnetometer show of the roll, and the gyro.

    The gyro reads the mean rate since the last sample; with a bandwidth y := (1-p) x + p y follows.
    States: last angle, last reading of the gyro, last one of the accelerometer.
    """
    p_gyro, p_accel = (
        math.exp(-2.0 * math.pi * bandwidth * step) if bandwidth > 0.0 else 0.0
        for bandwidth in (float(imu["gyro_bandwidth"][0]), float(imu["accel_bandwidth"][0]))
    )
    turned, tilted = (1.0 - p_gyro) / step, -(1.0 - p_accel) / float(v["gravity"][0])
    gyro = np.array([-turned, p_gyro, 0.0]), np.array([turned, 0.0, 0.0])
    accel = np.array([0.0, 0.0, p_accel]), np.array([0.0, 0.0, tilted])
    none, angle = np.zeros(3), np.array([1.0, 0.0, 0.0])
    return systems.state_space(
        [none, gyro[0], accel[0]],
        [angle, gyro[1], accel[1]],
        [accel[0], none, gyro[0]],
        [accel[1], angle, gyro[1]],
        step,
    )


def _with_rate(estimator: StateSpace, step: float) -> StateSpace:
    """Turn the estimator's second output, the gyro bias, into the rate without it."""
    a, b, c, d = systems.matrices(estimator)
    rate = np.array([0.0, 0.0, 1.0])
    return systems.state_space(a, b, [c[0], -c[1]], [d[0], rate - d[1]], step)


def _controller(c: Mapping[str, Array], v: Mapping[str, Array], step: float) -> StateSpace:
    """From estimated angle and rate to the command along `ROLL`; state: the integral z."""
    to_angle, to_rate, integral = (
        float(c[name][0]) for name in ("attitude_gain", "rate_gain", "rate_integral_gain")
    )
    error = np.array([to_angle, 1.0])
    command = float(c["inertia"][0]) / _effect({**c, "gravity": v["gravity"], "mass": v["mass"]})
    return systems.state_space(
        [[1.0]], [step * integral * error], [[command]], [command * to_rate * error], step
    )

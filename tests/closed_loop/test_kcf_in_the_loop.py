"""The KCF in the loop of a multirotor that accelerates for seconds on end (docs/accuracy.md).

Every estimator flies on its own estimate: what it gets wrong, the vehicle does. The components are the C
cores, which give the bits of the FMUs in the same loop (test_system.py).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from ahrs_fmu import descriptors, models, quaternion
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.system import System
from ahrs_fmu.metrics import attitude_error
from ahrs_fmu.trajectories import trapezoid
from quadrotor_loop import CONNECTIONS, START_VALUES

STEP = 0.004
SECONDS = 60.0
GRAVITY = 9.80665
SEEDS = (1, 2, 3, 4, 5)

ROLL = ((5, 9, 1, 20), (10, 14, 1, -20), (40, 46, 0.8, 25), (47, 53, 0.8, -25))
PITCH = ((17, 21, 1, 15), (22, 26, 1, -15), (41, 48, 1, 20), (49, 55, 1, -20))
YAW = ((29, 36, 2, 60), (38, 42, 1.5, -30), (42, 56, 4, 90))
"""Attitude that is asked for: from, to, time to get there, degrees; the vehicle gains up to 11 m/s."""

OTHERS = tuple(name for name in models.BY_NAME if name != "kcf")
SUITED: Mapping[str, tuple[str, Mapping[str, object]]] = {
    "mekf, compensated": ("mekf", {"motion_compensation": True}),
    "gcf, slow": ("gcf", {"kp": 0.1, "ki": 0.005}),
}
"""Settings that suit sustained accelerations better than the defaults."""


def angles(time: float) -> NDArray[np.float64]:
    """Roll, pitch and yaw that are asked for, rad."""
    at = np.array([time])
    sums = [sum(trapezoid(at, *part)[0] for part in parts) for parts in (ROLL, PITCH, YAW)]
    return np.radians(np.array(sums, dtype=np.float64))


def wanted_attitude(time: float) -> NDArray[np.float64]:
    return quaternion.from_euler(angles(time))


def wanted_thrust(time: float) -> float:
    """Thrust that carries the weight of one kilogram at the attitude that is asked for, N."""
    roll, pitch, _ = angles(time)
    return float(GRAVITY / (np.cos(roll) * np.cos(pitch)))


def thrust_from_the_ground(time: float) -> float:
    """Rotors that idle, a take-off, then the same."""
    return 0.6 if time < 3.5 else 11.3 if time < 4.8 else wanted_thrust(time)


ON_THE_GROUND: Mapping[str, Mapping[str, object]] = {
    "quadrotor": {"ground": True, "initial_position": (0.0, 0.0, -0.12), "initial_rotor_speed": 100.0},
    "controller": {"initial_thrust": 0.6},
}


def errors(
    model: str,
    options: Mapping[str, object],
    seed: int,
    *,
    from_ground: bool = False,
    hard_iron: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[float, float]:
    """RMS error in total and of the tilt over a flight, deg: from hover, or from a rest on the ground.

    The hard iron is in body axes, T.
    """
    start = ON_THE_GROUND if from_ground else {"quadrotor": {}, "controller": {}}

    def core(name: str, **parameters: object) -> CoreStepper:
        return CoreStepper(descriptors.load(name), {"sample_time": STEP, **parameters})

    system = System(
        {
            "quadrotor": core("quadrotor", **start["quadrotor"]),
            "imu": core("imu", seed=seed, hard_iron=hard_iron),
            "estimator": core(model, **options),
            "controller": core("attitude_controller", **start["controller"]),
        },
        CONNECTIONS,
        step=STEP,
        drives={
            "controller.q_ref": wanted_attitude,
            "controller.thrust": thrust_from_the_ground if from_ground else wanted_thrust,
        },
        start_values=START_VALUES,
    )
    flight = system.run(SECONDS, ("quadrotor.q", "estimator.q"))
    rms = attitude_error(flight["estimator.q"], flight["quadrotor.q"]).rms().degrees()
    return rms["total"], rms["inclination"]


def mean_errors(
    model: str,
    options: Mapping[str, object],
    *,
    from_ground: bool = False,
    hard_iron: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> NDArray[np.float64]:
    flights = [errors(model, options, seed, from_ground=from_ground, hard_iron=hard_iron) for seed in SEEDS]
    found = np.mean(flights, axis=0)
    start = "from the ground" if from_ground else "from hover"
    iron = f", hard iron {[round(1e6 * x) for x in hard_iron]} uT" if any(hard_iron) else ""
    print(f"{model} {dict(options)} {start}{iron}: total {found[0]:.1f}, tilt {found[1]:.1f}")
    return found


OWN = {"profile": "multirotor"}


@pytest.fixture(scope="module")
def own() -> NDArray[np.float64]:
    return mean_errors("kcf", OWN)


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_in_a_loop_with_sustained_accelerations_it_is_far_better(name: str, own: NDArray[np.float64]) -> None:
    others = mean_errors(name, {})
    assert np.all(others > 1.5 * own), (others, own)


@pytest.mark.slow
@pytest.mark.parametrize("name", SUITED)
def test_settings_that_suit_accelerations_do_not_make_up_for_it(name: str, own: NDArray[np.float64]) -> None:
    # Their tilt comes nearer, and they pay for it with the heading.
    others = mean_errors(*SUITED[name])
    assert others[0] > 1.5 * own[0], (others, own)
    assert others[1] > 1.2 * own[1], (others, own)


@pytest.mark.slow
def test_a_rest_before_take_off_halves_its_errors(own: NDArray[np.float64]) -> None:
    rested = mean_errors("kcf", OWN, from_ground=True)
    assert np.all(rested < [0.6, 0.7] * own), (rested, own)


@pytest.mark.slow
def test_who_trusts_the_field_is_better_until_a_hard_iron_comes_along(own: NDArray[np.float64]) -> None:
    # Noises with which the magnetometer holds the tilt: the flight of docs/vehicle.md section 5.
    trusting = ("mekf", {"accel_noise": 2.0, "mag_noise": 1e-7, "gyro_bias_noise": 1e-5})
    assert np.all(mean_errors(*trusting) < own)
    iron = (5e-6, -5e-6, 0.0)
    lost, held = mean_errors(*trusting, hard_iron=iron), mean_errors("kcf", OWN, hard_iron=iron)
    assert np.all(lost > 5.0 * held), (lost, held)
    assert held[1] < 1.2 * own[1], (held, own)

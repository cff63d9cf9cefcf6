"""What an estimator costs in a control loop, against the C core behind a modelled sensor."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from ahrs_fmu import descriptors, quaternion, sensors
from ahrs_fmu.analysis.equivalent import small_signal
from ahrs_fmu.analysis.in_loop import InLoop, thrust_borne
from ahrs_fmu.analysis.measure import OperatingPoint
from ahrs_fmu.analysis.quantity import rows
from ahrs_fmu.analysis.theory import Gains, LowPass, Responding, filter_of
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.stepper import replay
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import DesignError
from ahrs_fmu.sensors import Imu, Triad

T = 0.004
OMEGA = np.array([0.1, 0.5, 2.0, 6.0, 18.0, 60.0])
GAINS = Gains(0.5, 0.1)
PITCH = 1
DRAG = 0.26
FLIGHT = (
    *("quadrotor.q -> imu.q", "quadrotor.rate -> imu.rate", "quadrotor.rotor_speed -> imu.rotor_speed"),
    *("quadrotor.specific_force -> imu.specific_force", "imu.gyro -> estimator.gyro"),
    *("imu.accel -> estimator.accel", "imu.mag -> estimator.mag"),
    *("estimator.q -> controller.q", "estimator.rate -> controller.rate"),
    "controller.rotor_speed_command -> quadrotor.rotor_speed_command",
)


def simulated(
    core: CoreStepper,
    omega: float,
    imu: Imu | None = None,
    seen: complex = 1.0,
    settle: float = 150.0,
    vibration: float = 0.0,
) -> complex:
    """Estimated over true pitch of a vehicle that swings by a degree, seen by the accelerometer as `seen`.

    It vibrates up and down from sample to sample.
    """
    imu = imu or Imu()
    steps = round((settle + max(20.0, 4.0 * math.pi / omega)) / T)
    time = T * np.arange(steps + 1)
    swing = math.radians(1.0) * np.exp(1j * omega * time)
    true, shown = np.zeros((2, steps, 3))
    true[:, PITCH], shown[:, PITCH] = swing.imag[1:], (seen * swing).imag[1:]
    rate = np.zeros((steps, 3))
    rate[:, PITCH] = np.diff(swing.imag) / T
    point = OperatingPoint()
    truth = point.sensors(true, rate) | {"accel": point.sensors(shown, rate)["accel"]}
    truth["accel"][:, 2] += vibration * (-1.0) ** np.arange(steps)
    draws = sensors.CounterDraws(0)
    read = sensors.measure(imu, **truth, sample_time=T, draws=draws)
    core.reset()
    inputs = {"gyro": read.gyro, "accel": read.accel, "mag": read.mag}
    estimate = point.turned(replay(core, inputs, ["q"], T)["q"])[:, PITCH]
    kept = slice(round(settle / T), None)
    basis = np.stack((swing.imag[1:], swing.real[1:], np.ones(steps)), axis=-1)[kept]
    along, across, _ = np.linalg.lstsq(basis, estimate[kept], rcond=None)[0]
    return complex(along, across)


def gcf() -> CoreStepper:
    parameters = {"kp": GAINS.kp, "ki": GAINS.ki, "sample_time": T}
    return CoreStepper(descriptors.load("gcf"), parameters)


def assert_near(found: list[complex], expected: np.ndarray, decibels: float, degrees: float) -> None:
    ratio = np.array(found) / expected
    assert np.max(np.abs(20.0 * np.log10(np.abs(ratio)))) < decibels
    assert math.degrees(np.max(np.abs(np.angle(ratio)))) < degrees


@pytest.mark.parametrize("sample_time", [None, T])
@pytest.mark.parametrize("law", [Gains(0.5), GAINS, Gains(1.0, 0.3, 0.05), LowPass(0.4, 0.7)])
def test_perfect_sensors_on_a_vehicle_at_rest_cost_nothing(
    law: Gains | LowPass, sample_time: float | None
) -> None:
    loop = InLoop(filter_of(law, sample_time), held=False)
    np.testing.assert_allclose(loop.respond(OMEGA), 1.0, rtol=0, atol=1e-12)
    assert abs(loop.cost(6.0).phase) < 1e-12


def test_hold_and_delay_take_half_a_sample_and_all_of_the_delay() -> None:
    cost = InLoop(filter_of(GAINS, T), delay=T).cost(18.0)
    assert cost.phase == pytest.approx(-18.0 * 1.5 * T, rel=1e-9)
    assert cost.equivalent_delay == pytest.approx(1.5 * T, rel=1e-9)
    assert cost.gain == pytest.approx(np.sinc(18.0 * T / (2.0 * math.pi)), rel=1e-9)


def test_continuous_estimators_have_continuous_sensors() -> None:
    gyro = Triad(bandwidth=10.0, delay=0.002, rate=500.0)
    loop = InLoop(filter_of(Gains(1e-6)), gyro)
    s = 6.0j
    hold = (1.0 - np.exp(-0.002 * s)) / (0.002 * s)
    expected = np.exp(-0.002 * s) / (1.0 + s / (20.0 * math.pi)) * hold
    assert complex(loop.respond(6.0)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    "imu",
    [
        Imu(gyro=Triad(bandwidth=92.0), accel=Triad(bandwidth=94.0)),
        Imu(gyro=Triad(bandwidth=20.0, delay=0.008), accel=Triad(bandwidth=5.0, rate=50.0)),
        Imu(gyro=Triad(rate=125.0)),
    ],
    ids=["imu", "slow", "gyro-rate"],
)
def test_low_pass_delay_and_rate_of_the_sensors_cost_what_is_predicted(imu: Imu) -> None:
    loop = InLoop(filter_of(GAINS, T), imu.gyro, imu.accel, held=False)
    omega = OMEGA[1:]
    assert_near([simulated(gcf(), w, imu) for w in omega], loop.respond(omega), 0.01, 0.05)


def test_a_multirotor_whose_accelerometer_sees_no_tilt_gains_phase_and_loses_amplitude() -> None:
    vehicle = thrust_borne(DRAG)
    loop = InLoop(filter_of(GAINS, T), seen=vehicle, held=False)
    seen = [complex(vehicle(1j * w)) for w in OMEGA]
    found = [simulated(gcf(), w, seen=m) for w, m in zip(OMEGA, seen, strict=True)]
    assert_near(found, loop.respond(OMEGA), 0.01, 0.05)
    cost = loop.cost(2.0)
    assert math.degrees(cost.motion) > 10.0
    assert loop.cost(0.5).gain < 0.8


def test_the_nearest_filter_of_the_kcf_predicts_its_cost_in_flight() -> None:
    core = CoreStepper(descriptors.load("kcf"), {"sample_time": T})
    nearest: Responding = small_signal(core, T)
    omega, vehicle = np.array([0.5, 2.0, 6.0]), thrust_borne(DRAG)
    seen = [complex(vehicle(1j * w)) for w in omega]
    # Without vibration it would take the slow swing at rest for the bias of the gyro.
    found = [simulated(core, w, None, m, 300.0, vibration=1.5) for w, m in zip(omega, seen, strict=True)]
    assert_near(found, InLoop(nearest, seen=vehicle, held=False).respond(omega), 0.2, 2.0)


def test_causes_sum_to_the_phase_and_every_number_has_a_unit() -> None:
    gyro, accel = Triad(bandwidth=92.0, delay=0.004), Triad(bandwidth=44.0)
    loop = InLoop(filter_of(GAINS, T), gyro, accel, thrust_borne(DRAG), delay=T)
    cost = loop.cost(6.0)
    assert cost.phase == pytest.approx(cost.sensors + cost.motion + cost.timing)
    assert cost.gain * np.exp(1j * cost.phase) == pytest.approx(complex(loop.respond(6.0)))
    units = {row.name: row.unit for row in rows(cost)}
    assert units["phase"] == "rad"
    assert units["equivalent_delay"] == "s"


def test_phase_margin_falls_by_the_phase_of_the_estimator() -> None:
    """A loop 6/s around an estimator, its margin from python-control, with the cost as a pure delay."""
    loop = InLoop(filter_of(GAINS), Triad(bandwidth=20.0), Triad(bandwidth=20.0))
    without = control.tf([6.0], [1.0, 0.0])
    behind = without * control.tf([1.0], [1.0 / (40.0 * math.pi), 1.0])
    _, margin, _, crossover = control.margin(behind)
    assert 90.0 + math.degrees(loop.cost(float(crossover)).phase) == pytest.approx(margin, abs=1e-6)


@pytest.mark.parametrize("omega", [2.0, 6.0, 12.0])
def test_a_quadrotor_that_flies_on_its_estimate_has_the_predicted_cost(omega: float) -> None:
    """Pitch swings by 2 deg in closed loop; docs/vehicle.md gives its drag."""

    def reference(time: float) -> np.ndarray:
        half = math.radians(1.0) * math.sin(omega * time)
        return np.array([math.cos(half), 0.0, math.sin(half), 0.0])

    models = {"quadrotor": "quadrotor", "imu": "imu", "estimator": "gcf", "controller": "attitude_controller"}
    parameters = {"quadrotor": {"imu_position": [0.0, 0.0, 0.0]}, "imu": {"errors": False}}
    parts = {
        name: CoreStepper(descriptors.load(model), {"sample_time": T, **parameters.get(name, {})})
        for name, model in models.items()
    }
    system = System(
        parts,
        FLIGHT,
        step=T,
        drives={"controller.q_ref": reference, "controller.thrust": 9.80665},
        start_values=(
            *("quadrotor.wind", "controller.rate_ref", "controller.angular_acceleration_ref"),
            *("estimator.accel_valid", "estimator.mag_valid"),
        ),
    )
    settled = 60.0
    flown = system.run(settled + round(25.0 / T) * T, ["quadrotor.q", "estimator.q"])
    basis = np.exp(1j * omega * flown.time)
    basis = np.stack((basis.imag, basis.real, np.ones_like(flown.time)), axis=-1)[flown.time > settled]
    swing = [
        quaternion.log(flown[name])[flown.time > settled, PITCH] for name in ("quadrotor.q", "estimator.q")
    ]
    along, across, _ = np.linalg.lstsq(basis, np.stack(swing, axis=-1), rcond=None)[0]
    truth, estimate = along + 1j * across
    drag = 4.0 * 1.5e-4 * 434.27
    loop = InLoop(filter_of(GAINS, T), seen=thrust_borne(drag), held=False)
    assert_near([estimate / truth], loop.respond([omega]), 0.02, 0.2)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: InLoop(filter_of(GAINS, T)).cost(-1.0), "frequency = -1 rad/s: give a positive one"),
        (lambda: InLoop(filter_of(GAINS, T)).respond([1.0, 900.0]), "half the sample rate, 785.398 rad/s"),
        (lambda: InLoop(filter_of(GAINS)).cost(math.nan), "frequency = nan"),
        (lambda: InLoop(filter_of(GAINS, T), delay=-T), "delay = -0.004 s"),
        (lambda: thrust_borne(0.0), "drag = 0 1/s"),
    ],
)
def test_impossible_loops_are_refused_in_one_line(make, words: str) -> None:
    with pytest.raises(DesignError) as refusal:
        make()
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)

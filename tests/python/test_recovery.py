"""How soon an estimator forgets a misfortune: as its documented gains or noises predict, not later.

The attitude error and the bias error at the end of the misfortune are the initial condition of the linear
filter that docs/algorithms.md gives for each estimator: first order with KP, second order with KP and KI, the
corner of a quaternion EKF, the steady gains of a Kalman filter with bias (section 6).
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm

from ahrs_fmu import EstimateResult, Record, descriptors, quaternion
from every_estimator import CORRECTING, PRECISIONS, make, noisy
from motion import GRAVITY, angle_between, at_rest, tumbling

DEG = math.pi / 180.0
T = 0.01
HORIZONTAL_FIELD = 4e-5
TAN_DIP = 0.75
BEGIN, DURATION = 30.0, 90.0
GRID = np.arange(0.0, DURATION - BEGIN, 0.1)
LEFT = 0.1
"""Of the error at the end of the misfortune: what may be left after the predicted time."""
NOISE = 0.3 * DEG
"""By which two runs with the same noise differ once their gains differ."""


def default(name: str, parameter: str) -> float:
    known = descriptors.load(name)
    return known.numbers(known.parameter(parameter), known.parameter(parameter).default)[0]


class Linear(NamedTuple):
    """An estimator about a fixed attitude: derivative of its errors, and which of them are angles and biases.

    `shown` are the angles that come out.
    """

    matrix: np.ndarray
    shown: list[int]
    angles: list[int]
    biases: list[int]

    def envelope(self, angle: float, bias: float) -> np.ndarray:
        """Largest error from each time of `GRID` on, for an angle and a bias in any direction at first."""
        step, state = expm(self.matrix * (GRID[1] - GRID[0])), np.eye(len(self.matrix))
        errors = np.empty(len(GRID))
        for k in range(len(GRID)):
            of_angle, of_bias = (state[np.ix_(self.shown, columns)] for columns in (self.angles, self.biases))
            errors[k] = angle * np.linalg.norm(of_angle, 2)
            if self.biases:
                errors[k] += bias * np.linalg.norm(of_bias, 2)
            state = step @ state
        return np.maximum.accumulate(errors[::-1])[::-1]


def first_order(corner: float) -> Linear:
    return Linear(np.array([[-corner]]), [0], [0], [])


def second_order(kp: float, ki: float) -> Linear:
    """Attitude error, bias error."""
    return Linear(np.array([[-kp, 1.0], [-ki, 0.0]]), [0], [0], [1])


def decoupled(kp: float, ki: float) -> Linear:
    """Tilt and its bias, heading and its bias: a tilt error leaks into the measured heading with tan I."""
    seen = {0: np.array([1.0, 0.0, 0.0, 0.0]), 2: np.array([TAN_DIP, 0.0, 1.0, 0.0])}
    matrix = np.zeros((4, 4))
    for angle, error in seen.items():
        matrix[angle] = -kp * error
        matrix[angle, angle + 1] = 1.0
        matrix[angle + 1] = -ki * error
    return Linear(matrix, [0, 2], [0, 2], [1, 3])


def smoothed(behind: Linear, corner: float) -> Linear:
    """A low-pass that follows the angles of a filter, with the filter's bias in its own rate."""
    matrix = np.zeros((6, 6))
    matrix[:4, :4] = behind.matrix
    for output, angle in ((4, 0), (5, 2)):
        matrix[output, [output, angle, angle + 1]] = [-corner, corner, 1.0]
    return Linear(matrix, [4, 5], [0, 2], behind.biases)


def kalman(name: str, angle_noise: float) -> Linear:
    """Steady gains for gyroscope noise, bias walk and the noise of the measured angle."""
    n, k = default(name, "gyro_noise"), default(name, "gyro_bias_noise")
    return second_order(math.sqrt(n**2 / angle_noise**2 + 2.0 * k / angle_noise), k / angle_noise)


def linear(name: str) -> list[Linear]:
    """The estimator with its default parameters; tilt and heading apart where their gains differ."""
    value = functools.partial(default, name)
    if name == "complementary":
        return [first_order(value("kp"))]
    if name in ("gcf", "mahony"):
        return [decoupled(value("kp"), value("ki"))]
    if name in ("improved_ekf", "cg_ekf"):
        return [first_order(value("gyro_noise") / value("attitude_noise"))]
    if name == "mahony_ekf":
        corner = value("gyro_noise") / value("attitude_noise")
        return [smoothed(decoupled(value("kp"), value("ki")), corner)]
    tilt, heading = value("accel_noise") / GRAVITY, value("mag_noise") / HORIZONTAL_FIELD
    return [kalman(name, tilt), kalman(name, heading)]


def adapting_envelope(name: str, angle: float) -> np.ndarray:
    """The same for a filter that takes its error for noise of the accelerometer.

    The variance of the measured angle becomes that error squared at most, the density R the error times the
    root of the sample time; a Kalman filter whose variance is still small then gives e/cosh(t N/R).
    """
    corner = default(name, "gyro_noise") / (angle * math.sqrt(T))
    return angle / np.cosh(np.minimum(corner * GRID, 50.0))


def recovery_time(name: str, angle: float, bias: float) -> float:
    """Seconds after which at most `LEFT` of the angle is left, by theory."""
    if name == "adaptive_ckf":
        envelopes = [adapting_envelope(name, angle)]
    else:
        envelopes = [filter_.envelope(angle, bias) for filter_ in linear(name)]
    return float(GRID[np.argmax(np.max(envelopes, axis=0) <= LEFT * angle)])


@functools.cache
def resting() -> Record:
    return noisy(at_rest(DURATION, T, euler=(0.2, -0.3, 1.0), gyro_bias=(0.005, -0.003, 0.002)))


@functools.cache
def moving() -> Record:
    return noisy(tumbling(DURATION, T, rate=0.4))


def during(record: Record, seconds: float) -> np.ndarray:
    return (record.time >= BEGIN) & (record.time < BEGIN + seconds)


def lied_to(record: Record, seconds: float, turn: np.ndarray) -> np.ndarray:
    """Rates with an offset of 4 deg/s about an axis of the navigation frame."""
    axis = quaternion.rotate(quaternion.conjugate(record.q_true), np.asarray(turn, dtype=float))
    return record.gyro + np.where(during(record, seconds)[:, None], 4.0 * DEG * axis, 0.0)


def silent() -> tuple[Record, Record]:
    """Half a second of NaN from all sensors, in motion."""
    record, gone = moving(), during(moving(), 0.5)[:, None]
    spoiled = {name: np.where(gone, np.nan, getattr(record, name)) for name in ("gyro", "accel", "mag")}
    return record, replace(record, **spoiled)


def without_gyro() -> tuple[Record, Record]:
    """A second of NaN from the gyroscope, in motion: the rate is held."""
    record = moving()
    return record, replace(record, gyro=np.where(during(record, 1.0)[:, None], np.nan, record.gyro))


def weightless() -> tuple[Record, Record]:
    """Three seconds of an accelerometer at zero, while the gyroscope is wrong about north."""
    record = resting()
    accel = np.where(during(record, 3.0)[:, None], 0.0, record.accel)
    return record, replace(record, accel=accel, gyro=lied_to(record, 3.0, [1, 0, 0]))


def without_heading() -> tuple[Record, Record]:
    """Three seconds of a field along gravity, while the gyroscope is wrong about the vertical."""
    record = resting()
    mag = np.where(during(record, 3.0)[:, None], -5e-6 * record.accel, record.mag)
    return record, replace(record, mag=mag, gyro=lied_to(record, 3.0, [0, 0, 1]))


def gap() -> tuple[Record, Record]:
    """Samples of a second and a half are missing, in motion: one long step with the rate at its end."""
    record = moving()
    return record, record_of(record, ~during(record, 1.5))


def record_of(record: Record, kept: np.ndarray) -> Record:
    columns = ("time", "gyro", "accel", "mag", "accel_valid", "mag_valid", "q_true")
    return replace(record, **{name: getattr(record, name)[kept] for name in columns})


MISFORTUNES = {
    "silent": (silent, 0.5),
    "without gyroscope": (without_gyro, 1.0),
    "weightless": (weightless, 3.0),
    "without heading": (without_heading, 3.0),
    "gap": (gap, 1.5),
}
UNCORRECTED = ("weightless", "without heading", "gap")
"""Those in which no sensor corrects what goes wrong, long enough that every estimator is in error then."""


def aligned(result: EstimateResult, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rows = np.searchsorted(result.time, time)
    return result.q[rows], result.gyro_bias[rows]


def forgets(name: str, misfortune: str, **parameters: object) -> tuple[bool, float]:
    """Whether the error is gone after the time that the defaults predict, and the error at first."""
    make_records, seconds = MISFORTUNES[misfortune]
    clean, spoiled = (make(name, **parameters).run(record) for record in make_records())
    assert np.isfinite(spoiled.q).all()
    assert np.isfinite(spoiled.gyro_bias).all()
    assert not spoiled.covariance_reset.any()
    time = clean.time[clean.time >= BEGIN + seconds - 0.5 * T]
    (q, bias), (q_spoiled, bias_spoiled) = aligned(clean, time), aligned(spoiled, time)
    angle, off = angle_between(q, q_spoiled), np.linalg.norm(bias_spoiled - bias, axis=1)
    # With the correction of the first sample after it the misfortune has ended.
    predicted = recovery_time(name, angle[0], off[0])
    assert 0.0 < predicted < GRID[-1] - 5.0
    late = time - time[0] >= predicted
    return bool(angle[late].max() < LEFT * angle[0] + NOISE), float(angle[0])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("misfortune", MISFORTUNES)
@pytest.mark.parametrize("name", CORRECTING)
def test_a_misfortune_is_forgotten_within_the_time_that_the_bandwidth_predicts(
    name: str, misfortune: str, precision: str
) -> None:
    forgotten, angle = forgets(name, misfortune, precision=precision)
    assert forgotten
    if misfortune in UNCORRECTED:
        assert angle > 2.0 * DEG


@pytest.mark.parametrize(
    ("name", "slower"),
    [
        ("complementary", {"kp": 0.3}),
        ("gcf", {"kp": 0.25, "ki": 0.025}),
        ("mahony", {"kp": 0.3, "ki": 0.04}),
        ("improved_ekf", {"gyro_noise": 0.002}),
        ("cg_ekf", {"attitude_noise": 0.04}),
        ("mahony_ekf", {"kp": 0.3, "ki": 0.04}),
        ("mekf", {"accel_noise": 0.5}),
        ("ukf", {"accel_noise": 0.5}),
    ],
)
def test_the_prediction_is_sharp_enough_to_find_a_filter_that_is_slower(
    name: str, slower: dict[str, float]
) -> None:
    assert not forgets(name, "weightless", **slower)[0]

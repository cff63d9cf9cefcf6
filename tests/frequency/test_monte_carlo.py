"""Predicted errors against simulation of the C core."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ahrs_fmu import descriptors
from ahrs_fmu.analysis.coupling import ErrorKind
from ahrs_fmu.analysis.design import (
    SensorNoise,
    error_against_crossover,
    gains_for,
    optimal_gains,
    predict_attitude_rms,
    predict_rms,
)
from ahrs_fmu.analysis.simulate import errors_at_rest
from ahrs_fmu.analysis.theory import Gains, characterise, filter_of
from ahrs_fmu.cosim.core import CoreStepper

T = 0.02
GRAVITY = 9.8
GYRO, BIAS_STEP, ACCEL, MAG = math.radians(0.05), math.radians(0.001), 0.01, 0.1e-6
SENSOR = SensorNoise(
    gyro=GYRO * math.sqrt(T),
    bias_walk=BIAS_STEP / math.sqrt(T),
    accel=ACCEL * math.sqrt(T),
    mag=MAG * math.sqrt(T),
    field=50e-6,
    dip=math.atan2(30.0, 40.0),
    gravity=GRAVITY,
)
SETTLED = 60.0
"""Seconds after which the slowest mode of the coupled filter has forgotten the first, noisy sample."""
SOON_SETTLED = 30.0
"""The same for a decoupled filter."""


def simulated_squares(
    gains: Gains, error: str, runs: int, seconds: float, settled: float = SETTLED
) -> np.ndarray:
    """Mean squares of roll, pitch and heading error of each run (runs, 3), rad^2, after settling."""
    parameters = {"kp": gains.kp, "ki": gains.ki, "kii": gains.kii, "sample_time": T, "error": error}
    # A field learned from the first noisy sample would tilt the coupled filter for good.
    field = {"field_reference": "given", "field_magnitude": SENSOR.field, "field_dip": SENSOR.dip}
    core = CoreStepper(descriptors.load("gcf"), {**parameters, **field, "gravity": GRAVITY})
    errors = (errors_at_rest(core, SENSOR, T, seconds, seed)[round(settled / T) :] for seed in range(runs))
    return np.array([np.mean(e**2, axis=0) for e in errors])


@pytest.mark.parametrize(
    ("gains", "error"),
    [(Gains(0.5, 0.1), "decoupled"), (Gains(1.56, 0.855), "decoupled"), (Gains(0.5, 0.1), "coupled")],
)
def test_two_hundred_runs_have_the_predicted_error_on_every_axis(gains: Gains, error: ErrorKind) -> None:
    simulated = np.sqrt(np.mean(simulated_squares(gains, error, 200, 120.0), axis=0))
    predicted = predict_attitude_rms(gains, SENSOR, T, error)
    np.testing.assert_allclose(simulated, [predicted.roll, predicted.pitch, predicted.heading], rtol=0.05)


def test_third_order_filter_has_the_predicted_tilt_error() -> None:
    gains = Gains(1.0, 0.3, 0.05)
    simulated = math.sqrt(np.mean(simulated_squares(gains, "decoupled", 60, 150.0)[:, :2]))
    assert simulated == pytest.approx(predict_rms(gains, SENSOR.tilt, T).total, rel=0.05)


def test_the_simulated_u_curve_has_its_minimum_at_the_computed_gains() -> None:
    best = characterise(filter_of(optimal_gains(SENSOR.tilt)))
    crossovers = best.crossover * np.array([0.55, 0.75, 1.0, 1.35, 1.8])
    squares = [
        np.mean(simulated_squares(gains_for(wc, best.damping), "decoupled", 200, 90.0, SOON_SETTLED)[:, :2])
        for wc in crossovers
    ]
    # The curve is steeper towards slow filters, so that a parabola would miss the minimum by 6 %.
    shape = np.polyfit(np.log(crossovers / best.crossover), np.log(squares), 3)
    minima = [x for x in np.roots(np.polyder(shape)).real if np.polyval(np.polyder(shape, 2), x) > 0.0]
    assert len(minima) == 1
    assert math.exp(minima[0]) == pytest.approx(1.0, abs=0.1)
    curve = error_against_crossover(SENSOR.tilt, crossovers, best.damping, sample_time=T)
    np.testing.assert_allclose(np.sqrt(squares), curve.total, rtol=0.05)

"""The GCF on the source's experiments (docs/algorithms.md section 8): RMS errors over ten seeds."""

from __future__ import annotations

import math

import numpy as np
import pytest

import ahrs_fmu
from ahrs_fmu import metrics, scenarios

SEEDS = range(1, 11)
LEAK = -0.02 / math.log(0.98)

COUPLED = {"error": "coupled"}
DECOUPLED: dict[str, object] = {}
LEAKY = {"motion_compensation": True, "motion_time_constant": LEAK}
FULL = {"motion_compensation": True, "motion_time_constant": math.inf}

# Roll, pitch, yaw in degrees, from an independent implementation (two seeds).
EXPECTED = [
    ("gc/static", COUPLED, (0.03, 0.01, 0.05)),
    ("gc/static", DECOUPLED, (0.03, 0.02, 0.03)),
    ("gc/static", COUPLED | LEAKY, (0.54, 0.02, 0.41)),
    ("gc/lin", COUPLED, (0.03, 2.46, 0.05)),
    ("gc/lin", DECOUPLED, (0.03, 3.64, 0.03)),
    ("gc/lin", COUPLED | LEAKY, (0.54, 0.10, 0.41)),
    ("gc/circ", COUPLED, (6.33, 6.29, 6.06)),
    ("gc/circ", DECOUPLED, (12.32, 12.17, 5.41)),
    ("gc/circ", COUPLED | LEAKY, (1.00, 0.53, 0.82)),
    ("gc/circ", DECOUPLED | LEAKY, (7.73, 5.50, 5.41)),
]


def estimator(simulation: scenarios.Simulation, options: dict[str, object]) -> ahrs_fmu.GCF:
    field = np.asarray(simulation.scenario.field)
    return ahrs_fmu.GCF(
        sample_time=simulation.scenario.sample_time,
        gravity=simulation.scenario.gravity,
        field_reference="given",
        field_magnitude=float(np.linalg.norm(field)),
        field_dip=math.atan2(field[2], field[0]),
        initialisation="given",
        q0=tuple(simulation.q0),
        **options,
    )


def rms(name: str, options: dict[str, object]) -> np.ndarray:
    """Root mean square errors in degrees, one row per seed."""
    rows = []
    for seed in SEEDS:
        simulation = scenarios.simulate(name, seed)
        result = estimator(simulation, options).run(simulation.record)
        error = metrics.attitude_error(result.q, simulation.record.q_true).euler
        rows.append(np.sqrt(np.mean(error**2, axis=0)))
    return np.degrees(rows)


@pytest.mark.parametrize(("name", "options", "expected"), EXPECTED)
def test_errors_are_those_of_an_independent_implementation(
    name: str, options: dict[str, object], expected: tuple[float, ...]
) -> None:
    measured = rms(name, options).mean(axis=0)
    tolerance = np.maximum(0.3 * np.asarray(expected), 0.05)
    assert np.all(np.abs(measured - expected) <= tolerance), f"{measured} against {expected}"


@pytest.mark.parametrize(
    ("name", "expected"), [("gc/static", (0.66, 0.92, 0.50)), ("gc/lin", (0.66, 1.08, 0.50))]
)
def test_slowly_observed_tilt_wanders_as_in_an_independent_implementation(
    name: str, expected: tuple[float, ...]
) -> None:
    # The error follows the random walk of the gyroscope bias: seeds differ ninefold, and the expected values
    # are a mean of two, which drifted by 2.62 deg in pitch without any correction where the average is 2.0.
    each = rms(name, DECOUPLED | LEAKY)
    spread = each.std(axis=0, ddof=1) * math.sqrt(1 / 2 + 1 / len(each))
    assert np.all(np.abs(each.mean(axis=0) - expected) <= 3 * spread)


def test_full_compensation_trades_the_error_of_acceleration_for_drift() -> None:
    plain, full = (rms("gc/lin", COUPLED | extra).mean(axis=0) for extra in ({}, FULL))
    assert full[1] < 0.1 * plain[1]
    assert full[0] > 5 * plain[0]
    assert full[2] > 5 * plain[2]


@pytest.mark.parametrize(
    ("gains", "tilt", "heading"), [((0.5, 0.1), 0.0240, 0.0328), ((1.56, 0.855), 0.01026, 0.0225)]
)
def test_noise_at_rest_leaves_the_error_that_theory_predicts(
    gains: tuple[float, float], tilt: float, heading: float
) -> None:
    squares = []
    for seed in SEEDS:
        simulation = scenarios.simulate("gc/static", seed)
        result = estimator(simulation, {"kp": gains[0], "ki": gains[1]}).run(simulation.record)
        settled = simulation.record.time >= 20.0
        squares.append(
            np.mean(metrics.attitude_error(result.q, simulation.record.q_true).euler[settled] ** 2, axis=0)
        )
    measured = np.degrees(np.sqrt(np.mean(squares, axis=0)))
    np.testing.assert_allclose(measured, (tilt, tilt, heading), rtol=0.1)

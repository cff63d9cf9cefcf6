"""The GCF on the source's experiments (docs/algorithms.md section 8): RMS errors over ten seeds."""

from __future__ import annotations

import math

import numpy as np
import pytest

import ahrs_fmu
from ahrs_fmu import metrics, scenarios

SEEDS = range(1, 11)

COUPLED = {"error": "coupled"}
FULL = {"motion_compensation": True, "motion_time_constant": math.inf}


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

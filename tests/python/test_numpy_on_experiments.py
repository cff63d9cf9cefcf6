"""The numpy back-end against the C core over whole experiments and a recording: 1e-9 rad.

The UKF of the C core keeps a root, that of numpy the covariance: 2e-6 rad. A filter that is known to lose its
covariance is compared up to there: what follows begins from rounding errors.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import EstimateResult, Record, experiments, models, records, scenarios
from ahrs_fmu.estimator import Backend
from ahrs_fmu.scenarios import Simulation
from motion import angle_between

SAME, SQUARE_ROOT = 1e-9, 2e-6
BACKENDS: tuple[Backend, ...] = ("c", "numpy")
FEW = 200
DEFAULTS = sorted(models.BY_NAME)
RECORDING = "01_undisturbed_slow_rotation_A.mat"


def compare(model: str, results: list[EstimateResult], least: int = 2) -> None:
    """Attitudes and biases of both back-ends, up to the first reset of a covariance."""
    c, numpy_ = results
    resets = np.flatnonzero(c.covariance_reset | numpy_.covariance_reset)
    end = int(resets[0]) if resets.size else len(c)
    assert end >= least
    assert np.isfinite(numpy_.q).all()
    limit = SQUARE_ROOT if model == "ukf" else SAME
    assert np.max(angle_between(c.q[:end], numpy_.q[:end])) < limit
    np.testing.assert_allclose(numpy_.gyro_bias[:end], c.gyro_bias[:end], rtol=0.0, atol=limit)
    for name in ("status", "accel_used", "mag_used"):
        np.testing.assert_array_equal(getattr(numpy_, name)[:end], getattr(c, name)[:end])


def by_setting(name: str, scenario: str, rows: int | None) -> None:
    simulation = scenarios.simulate(scenario)
    setting = experiments.setting(name)
    record = simulation.record.rows(0, rows)
    results = [setting.estimator(scenario, simulation, backend).run(record) for backend in BACKENDS]
    compare(setting.model, results)


def by_default(model: str, record: Record, **parameters: float) -> None:
    results = [models.BY_NAME[model](backend=backend, **parameters).run(record) for backend in BACKENDS]
    compare(model, results, len(record))


def conditions(simulation: Simulation) -> dict[str, float]:
    return {"sample_time": simulation.scenario.sample_time, "gravity": simulation.scenario.gravity}


@pytest.mark.parametrize("setting", experiments.settings())
def test_every_setting_gives_the_same_at_the_beginning_of_a_swing(setting: str) -> None:
    by_setting(setting, "ac/swing", FEW)


def test_a_filter_that_fails_is_the_same_up_to_there() -> None:
    """The textbook form of the adaptive CKF is reset at sample 1346."""
    by_setting("adaptive CKF, textbook", "gc/circ", 1400)


@pytest.mark.parametrize("scenario", scenarios.names())
def test_every_experiment_begins_the_same(scenario: str) -> None:
    by_setting("MEKF", scenario, FEW)


@pytest.mark.parametrize("model", DEFAULTS)
def test_the_defaults_give_the_same_at_the_beginning_of_a_recording(model: str, broad_dir: Path) -> None:
    by_default(model, records.read(broad_dir / RECORDING).rows(0, FEW))


@pytest.mark.slow
@pytest.mark.parametrize("scenario", scenarios.names())
@pytest.mark.parametrize("setting", experiments.settings())
def test_every_setting_gives_the_same_on_every_experiment(setting: str, scenario: str) -> None:
    by_setting(setting, scenario, None)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", scenarios.names())
@pytest.mark.parametrize("model", DEFAULTS)
def test_the_defaults_give_the_same_on_every_experiment(model: str, scenario: str) -> None:
    simulation = scenarios.simulate(scenario)
    by_default(model, simulation.record, **conditions(simulation))


@pytest.mark.slow
@pytest.mark.parametrize("model", DEFAULTS)
def test_the_defaults_give_the_same_over_a_whole_recording(model: str, broad_dir: Path) -> None:
    record = records.read(broad_dir / RECORDING)
    assert len(record) > 40_000
    by_default(model, record, sample_time=record.sample_time)

"""The defaults never fail on a published experiment, in both precisions: the covariance is looked at."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from ahrs_fmu import descriptors, metrics, models, scenarios
from ahrs_fmu.host_library import Precision
from ahrs_fmu.native import NativeModel
from ahrs_fmu.scenarios import Simulation
from every_estimator import PRECISIONS, WITH_COVARIANCE

DEG = np.pi / 180.0
ROWS = 50
"""Samples between two looks at the covariance."""
EVERY = sorted(models.BY_NAME)


class Watched:
    """A C model of one experiment, with the matrices in its state."""

    def __init__(self, name: str, simulation: Simulation, precision: Precision) -> None:
        self.descriptor = descriptors.load(name)
        self.model = NativeModel(self.descriptor, precision)
        scenario = simulation.scenario
        for parameter, value in (("sample_time", scenario.sample_time), ("gravity", scenario.gravity)):
            self.model.set(parameter, value)
        self.model.reset()
        self._real = np.dtype(np.float64 if precision == "double" else np.float32)

    def state(self, name: str) -> np.ndarray:
        """Elements of a state variable of the estimator's own: they are the end of its state, all real."""
        sizes = {variable.name: variable.size for variable in self.descriptor.states}
        names = list(sizes)
        part = self.model._model.state
        saved = np.frombuffer(self.model.save()[part.offset : part.offset + part.size], self._real)
        begin = saved.size - sum(sizes[n] for n in names[names.index(name) :])
        return saved[begin : begin + sizes[name]].astype(np.float64)

    def covariance(self) -> np.ndarray:
        """The whole covariance (n, n), whatever form it is kept in."""
        name = self.descriptor.name
        if name == "mekf":
            cross = self.state("cross_covariance").reshape(3, 3)
            a, c = (symmetric(self.state(f"{part}_covariance")) for part in ("attitude", "bias"))
            return np.block([[a, cross], [cross.T, c]])
        if name == "ukf":
            root = lower(self.state("root"))
            return root @ root.T
        if name == "cg_ekf":
            return self.state("variance") * np.eye(4)
        return symmetric(self.state("covariance"))


def lower(elements: np.ndarray) -> np.ndarray:
    n = round((np.sqrt(8 * elements.size + 1) - 1) / 2)
    triangle = np.zeros((n, n))
    triangle[np.tril_indices(n)] = elements
    return triangle


def symmetric(elements: np.ndarray) -> np.ndarray:
    triangle = lower(elements)
    return triangle + np.tril(triangle, -1).T


def is_positive_definite(covariance: np.ndarray) -> bool:
    """Judged on the correlations, so that units do not matter."""
    std = np.sqrt(np.diagonal(covariance))
    if not (np.isfinite(covariance).all() and (std > 0.0).all()):
        return False
    return bool(np.linalg.eigvalsh(covariance / np.outer(std, std))[0] > 0.0)


def check(name: str, simulation: Simulation, precision: Precision) -> None:
    watched = Watched(name, simulation, precision)
    record = simulation.record
    columns = {n: getattr(record, n) for n in ("gyro", "accel", "mag", "accel_valid", "mag_valid")}
    outputs = [v.name for v in watched.descriptor.outputs]
    q = np.empty((len(record), 4))
    for start in range(0, len(record), ROWS):
        rows = slice(start, start + ROWS)
        y = watched.model.run(record.steps[rows], {n: c[rows] for n, c in columns.items()}, outputs)
        assert all(np.isfinite(values).all() for values in y.values())
        assert not np.any(y.get("covariance_reset", False))
        q[rows] = y["q"]
        if name in WITH_COVARIANCE:
            assert is_positive_definite(watched.covariance()), start
    if name != "strapdown":
        inclination = metrics.attitude_error(q, record.q_true).inclination
        assert np.sqrt(np.mean(inclination**2)) < 20 * DEG


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("experiment", ["me/hover", "ac/swing", "gc/circ"])
@pytest.mark.parametrize("name", EVERY)
def test_the_defaults_keep_a_covariance_and_finite_outputs(
    name: str, experiment: str, precision: Precision
) -> None:
    check(name, scenarios.simulate(experiment), precision)


@pytest.mark.slow
@pytest.mark.parametrize("experiment", scenarios.names())
def test_the_defaults_fail_in_no_experiment_with_any_of_twenty_seeds(experiment: str) -> None:
    for seed in range(1, 21):
        simulation = scenarios.simulate(experiment, seed)
        for name, precision in itertools.product(EVERY, PRECISIONS):
            check(name, simulation, precision)


def test_the_covariance_that_is_looked_at_is_that_of_the_output() -> None:
    simulation = scenarios.simulate("me/hover")
    for name in ("mekf", "ukf"):
        watched = Watched(name, simulation, "double")
        record = simulation.record.rows(0, 500)
        columns = {n: getattr(record, n) for n in ("gyro", "accel", "mag")}
        std = watched.model.run(record.steps, columns, ["attitude_std"])["attitude_std"]
        np.testing.assert_allclose(np.sqrt(np.diagonal(watched.covariance())[:3]), std[-1], rtol=1e-12)


def test_a_matrix_that_is_not_positive_definite_is_seen() -> None:
    assert is_positive_definite(symmetric(np.array([1.0, 0.9, 1.0])))
    assert not is_positive_definite(symmetric(np.array([1.0, 1.1, 1.0])))
    assert not is_positive_definite(np.diag([1.0, 0.0]))
    assert not is_positive_definite(np.full((2, 2), np.nan))

"""Which weights an unscented filter bears in single precision (docs/algorithms.md section 1)."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest

from ahrs_fmu import models, scenarios, single_precision
from ahrs_fmu.errors import ParameterError
from ahrs_fmu.single_precision import Trial, Weighting

DEG = np.pi / 180.0
REST = 500
"""Sample of the scenario at which the first acceleration begins."""


@functools.cache
def trials(form: str, alpha: float) -> list[Trial]:
    return [t for t in all_trials() if t.form == form and t.weighting.alpha == alpha]


@functools.cache
def all_trials() -> list[Trial]:
    return single_precision.trials()


def test_only_the_alpha_of_the_textbooks_fails_and_only_as_textbooks_write_it() -> None:
    assert all(trial.as_expected for trial in all_trials()), [t for t in all_trials() if not t.as_expected]


def test_the_covariance_form_fails_where_the_motion_begins() -> None:
    """An independent computation found sample 510 with microtesla."""
    found = trials("covariance", 0.001)
    assert len(found) == 3
    for trial in found:
        assert trial.failed is not None
        assert REST < trial.failed < REST + 100


def test_the_square_root_form_fails_at_the_first_sample() -> None:
    (trial,) = trials("square root", 0.001)
    assert trial.failed == 1


@pytest.mark.parametrize(
    ("form", "alpha", "limit"),
    [
        ("covariance", 0.01, 0.1),
        ("covariance", 0.1, 0.003),
        ("covariance", 1.0, 0.003),
        ("square root", 0.1, 0.003),
        ("square root", 1.0, 0.003),
        ("C code", 0.001, 0.1),
        ("C code", 0.01, 0.003),
        ("C code", 0.1, 0.003),
        ("C code", 1.0, 0.003),
    ],
)
def test_what_passes_is_as_accurate_as_in_double_precision(form: str, alpha: float, limit: float) -> None:
    found = trials(form, alpha)
    assert found
    for trial in found:
        assert abs(trial.rms - trial.rms_double) < limit * DEG


def test_the_c_code_keeps_its_covariance_with_every_alpha_and_seed() -> None:
    for seed, alpha in itertools.product(range(1, 11), (1e-4, 1e-3, 0.003, 0.01, 0.015, 0.03, 0.1, 1.0)):
        simulation = scenarios.simulate(single_precision.SCENARIO, seed)
        assert np.isfinite(single_precision.c_code(simulation, Weighting(alpha), "single")).all()


def test_an_alpha_that_leaves_little_but_rounding_is_refused_in_single_precision() -> None:
    with pytest.raises(ParameterError, match=r"in single precision .* use double, or a larger alpha"):
        models.UKF(alpha=0.009, precision="single")
    models.UKF(alpha=0.009)
    models.UKF(alpha=0.01, precision="single")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_update_of_a_triangle_adds_a_square(sign: float) -> None:
    rng = np.random.default_rng(3)
    root = np.tril(rng.standard_normal((20, 6, 6))) + 5.0 * np.eye(6)
    x = rng.standard_normal((20, 6))
    got = single_precision.updated(root, x, np.full(20, sign))
    expected = root @ np.swapaxes(root, 1, 2) + sign * x[:, :, None] * x[:, None, :]
    np.testing.assert_allclose(got @ np.swapaxes(got, 1, 2), expected, atol=1e-12)
    with np.errstate(invalid="ignore"):
        assert np.isnan(single_precision.updated(root, 50.0 * x, np.full(20, -1.0))).any(axis=(1, 2)).all()

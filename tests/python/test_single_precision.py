"""Which weights an unscented filter bears in single precision (docs/algorithms.md section 1)."""

from __future__ import annotations

import functools

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


def test_only_the_alpha_of_the_textbooks_fails_and_only_in_single_precision() -> None:
    assert all(trial.as_expected for trial in all_trials()), [t for t in all_trials() if not t.as_expected]


def test_the_covariance_form_fails_where_the_motion_begins() -> None:
    """An independent computation found sample 510 with microtesla."""
    found = trials("covariance", 0.001)
    assert len(found) == 3
    for trial in found:
        assert trial.failed is not None
        assert REST < trial.failed < REST + 100


def test_the_square_root_form_fails_at_the_first_correction() -> None:
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
    ],
)
def test_what_passes_is_as_accurate_as_in_double_precision(form: str, alpha: float, limit: float) -> None:
    found = trials(form, alpha)
    assert found
    for trial in found:
        assert abs(trial.rms - trial.rms_double) < limit * DEG


@pytest.mark.parametrize("alpha", [0.001, 0.01, 0.03])
def test_what_the_square_root_form_does_not_bear_is_refused(alpha: float) -> None:
    simulations = [scenarios.simulate(single_precision.SCENARIO, seed) for seed in range(1, 11)]
    lost = [
        np.isnan(single_precision.square_root_form(s, Weighting(alpha), "single")).any() for s in simulations
    ]
    assert any(lost)
    with pytest.raises(ParameterError, match=r"in single precision .* use double, or alpha 0.1 or larger"):
        models.UKF(alpha=alpha, precision="single")
    models.UKF(alpha=alpha)


@pytest.mark.parametrize(("alpha", "kappa"), [(0.07, 0.0), (0.1, -3.0)])
def test_the_smallest_spread_that_is_allowed_is_borne(alpha: float, kappa: float) -> None:
    models.UKF(alpha=alpha, kappa=kappa, precision="single")
    for seed in range(1, 11):
        simulation = scenarios.simulate(single_precision.SCENARIO, seed)
        weighting = Weighting(alpha, kappa=kappa)
        q = single_precision.square_root_form(simulation, weighting, "single")
        assert np.isfinite(q).all()

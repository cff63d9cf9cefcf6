"""The numpy back-end against the traces computed independently of this project."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_golden import CASES, FILES, Trace

from ahrs_fmu import models
from ahrs_fmu.estimators.model import FILTERS
from motion import angle_between

NUMPY_CASES = [case for case, (model, _) in CASES.items() if model in FILTERS]


def compare(case: str, file: Path, rows: int | None) -> None:
    with np.load(file) as arrays:
        trace = Trace({name: arrays[name] for name in arrays})
    model, parameters = CASES[case]
    estimator = models.BY_NAME[model](**trace.setting, **parameters(trace), backend="numpy")
    result = estimator.run(trace.record.rows(0, rows))
    error = angle_between(trace.arrays[case][:rows], result.q)
    assert np.max(error) < 1e-9
    if f"{case}_bias" in trace.arrays:
        expected = trace.arrays[f"{case}_bias"][:rows]
        np.testing.assert_allclose(result.gyro_bias, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("case", NUMPY_CASES)
def test_the_first_turn_on_a_circle_is_that_of_the_independent_computation(
    case: str, golden_dir: Path
) -> None:
    compare(case, golden_dir / "gc_circ.npz", rows=600)


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("case", NUMPY_CASES)
def test_every_trace_is_that_of_the_independent_computation(case: str, name: str, golden_dir: Path) -> None:
    compare(case, golden_dir / f"{name}.npz", rows=None)

"""The numpy back-end as a model: batches, saved states, refusals."""

from __future__ import annotations

import numpy as np
import pytest

import ahrs_fmu
from ahrs_fmu import descriptors, scenarios
from ahrs_fmu.errors import ParameterError, RecordError
from ahrs_fmu.estimators.model import FILTERS, NumpyModel
from ahrs_fmu.native import NativeModel

ROWS = 60
OUTPUTS = ("q", "gyro_bias", "status", "yaw")


def samples(seed: int) -> dict[str, np.ndarray]:
    record = scenarios.load("ac/swing", seed).rows(100, 100 + ROWS)
    return {"gyro": record.gyro, "accel": record.accel, "mag": record.mag, "mag_valid": record.mag_valid}


def steps() -> np.ndarray:
    return np.r_[0.0, np.full(ROWS - 1, 0.01)]


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_a_batch_gives_what_its_runs_give_alone(name: str) -> None:
    descriptor = descriptors.load(name)
    runs = [samples(seed) for seed in (1, 2, 3)]
    # Each run of a batch has misfortunes of its own.
    runs[0]["accel"] = runs[0]["accel"].copy()
    runs[0]["accel"][:20] = np.nan
    runs[1]["gyro"] = runs[1]["gyro"].copy()
    runs[1]["gyro"][30:33] = np.inf
    runs[2]["mag_valid"] = np.arange(ROWS) > 40
    batch = NumpyModel(descriptor, (3,))
    together = batch.run(steps(), {key: np.stack([run[key] for run in runs]) for key in runs[0]}, OUTPUTS)
    for i, run in enumerate(runs):
        alone = NumpyModel(descriptor).run(steps(), run, OUTPUTS)
        for output in OUTPUTS:
            assert together[output].shape[:2] == (3, ROWS)
            np.testing.assert_allclose(together[output][i], alone[output], rtol=0, atol=1e-12, err_msg=output)


def test_a_batch_may_have_several_dimensions_and_share_its_samples() -> None:
    model = NumpyModel(descriptors.load("gcf"), (2, 3))
    y = model.run(steps(), samples(1), ("q", "roll"))
    assert y["q"].shape == (2, 3, ROWS, 4)
    assert y["roll"].shape == (2, 3, ROWS)
    np.testing.assert_array_equal(y["q"][1, 2], y["q"][0, 0])


@pytest.mark.parametrize("name", sorted(FILTERS))
@pytest.mark.parametrize("shape", [(), (2,)])
def test_a_restored_state_continues_bit_for_bit(name: str, shape: tuple[int, ...]) -> None:
    model = NumpyModel(descriptors.load(name), shape)
    data = samples(4)
    model.run(steps()[:30], {key: column[:30] for key, column in data.items()}, ())
    saved = model.save()
    rest = {key: column[30:] for key, column in data.items()}
    first = model.run(steps()[30:], rest, OUTPUTS)
    other = NumpyModel(descriptors.load(name), shape)
    other.restore(saved)
    second = other.run(steps()[30:], rest, OUTPUTS)
    for output in OUTPUTS:
        np.testing.assert_array_equal(first[output], second[output])
    with pytest.raises(ValueError, match="the saved state has"):
        other.restore(saved[:-1])


def test_one_sample_at_a_time_is_the_same_as_the_whole_record() -> None:
    data = samples(5)
    whole = NumpyModel(descriptors.load("mekf")).run(steps(), data, OUTPUTS)
    model = NumpyModel(descriptors.load("mekf"))
    for k, dt in enumerate(steps()):
        for key, column in data.items():
            model.set(key, column[k])
        model.update(dt)
        model.compute_outputs()
        np.testing.assert_array_equal(model.get("q"), whole["q"][k])
        assert model.get("status") == whole["status"][k]


def test_the_classes_choose_their_back_end() -> None:
    record = scenarios.load("gc/lin").rows(0, 200)
    c = ahrs_fmu.GCF(kp=1.0, sample_time=0.02).run(record)
    numpy_ = ahrs_fmu.GCF(kp=1.0, sample_time=0.02, backend="numpy").run(record)
    np.testing.assert_allclose(numpy_.q, c.q, rtol=0, atol=1e-12)
    assert not np.array_equal(numpy_.q, c.q)
    estimator = ahrs_fmu.GCF(sample_time=0.02, backend="numpy")
    estimate = [estimator.update(record.gyro[k], record.accel[k], record.mag[k]) for k in range(20)][-1]
    np.testing.assert_allclose(estimate.q, ahrs_fmu.GCF(sample_time=0.02).run(record).q[19], atol=1e-12)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_several_recordings_are_run_as_each_would_be(backend: str) -> None:
    records = [scenarios.load("gc/lin", seed).rows(0, 50) for seed in (1, 2, 3)]
    estimator = ahrs_fmu.Mahony(backend=backend, sample_time=0.02)  # type: ignore[arg-type]
    estimator.run(records[0])
    before = estimator.save()
    together = estimator.run_all(records)
    assert estimator.save() == before
    for record, result in zip(records, together, strict=True):
        alone = ahrs_fmu.Mahony(backend=backend, sample_time=0.02).run(record)  # type: ignore[arg-type]
        np.testing.assert_allclose(result.q, alone.q, rtol=0, atol=1e-14)
        np.testing.assert_array_equal(result.status, alone.status)


def test_recordings_with_different_times_are_not_run_together() -> None:
    records = [scenarios.load("gc/lin").rows(0, 50), scenarios.load("ac/swing").rows(0, 50)]
    with pytest.raises(RecordError, match="all with the same time"):
        ahrs_fmu.GCF(backend="numpy").run_all(records)
    with pytest.raises(RecordError, match="at least one"):
        ahrs_fmu.GCF().run_all([])


def test_the_numpy_back_end_has_no_single_precision() -> None:
    with pytest.raises(ParameterError, match="double precision; use backend 'c'"):
        ahrs_fmu.GCF(backend="numpy", precision="single")


def test_state_that_has_lost_its_meaning_begins_anew() -> None:
    descriptor = descriptors.load("gcf")
    data = samples(6)
    models = NumpyModel(descriptor), NativeModel(descriptor)
    for model in models:
        model.run(steps(), data, OUTPUTS)
        model.set("kp", [1e308])
        model.run(steps()[1:6], {key: column[:5] for key, column in data.items()}, OUTPUTS)
        model.set("kp", [0.5])
        y = model.run(steps()[1:], {key: column[1:] for key, column in data.items()}, OUTPUTS)
        assert np.isfinite(y["q"]).all()
        np.testing.assert_allclose(np.linalg.norm(y["q"], axis=-1), 1.0, atol=1e-12)

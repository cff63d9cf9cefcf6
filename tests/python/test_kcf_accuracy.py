"""The KCF on recordings with optical truth and on the published experiments (docs/accuracy.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import KCF, Record, benchmark, descriptors, kcf_offline, models, quaternion, records, scenarios
from ahrs_fmu.metrics import attitude_error
from ahrs_fmu.native import NativeModel
from motion import angle_between

DEG = np.pi / 180.0
DEVELOPMENT_HALF = 15
SEEDS = range(1, 11)

TABLE: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "me/dynamic": ((2.9, 2.1, 1.1), (0.98, 0.65, 0.57)),
    "me/hover": ((0.23, 0.32, 0.22), (0.43, 0.40, 0.36)),
    "ac/swing": ((0.12, 0.10, 0.27), (0.39, 0.32, 0.70)),
    "gc/lin": ((0.08, 1.81, 0.24), (0.20, 0.47, 0.20)),
    "gc/circ": ((0.46, 0.35, 0.26), (0.16, 0.12, 0.21)),
    "cg/hand": ((0.19, 0.20, 0.54), (0.51, 0.52, 1.17)),
    "gc/static": ((0.04, 0.04, 0.05), (0.05, 0.05, 0.06)),
}
"""RMS roll, pitch, yaw in degrees, with the profile hand and with multirotor: of a prototype, the last two of
this filter."""


@pytest.fixture(scope="module")
def trials(broad_dir: Path) -> list[Record]:
    found = [records.read(trial.path) for trial in benchmark.find_trials(broad_dir)]
    if len(found) != DEVELOPMENT_HALF:
        pytest.skip(f"the numbers are those of {DEVELOPMENT_HALF} trials, and {len(found)} are here")
    return found


def mean_errors(trials: list[Record], change: Callable[[Record], Record], **options: object) -> np.ndarray:
    """Mean total, heading and inclination error, degrees."""
    errors = []
    for record in map(change, trials):
        filter_ = KCF(frame=record.frame.value, sample_time=record.sample_time, **options)
        rms = attitude_error(filter_.run(record).q, record.q_true).rms(record.evaluate).degrees()
        errors.append([rms["total"], rms["heading"], rms["inclination"]])
    return np.mean(errors, axis=0)


def test_the_equations_are_those_of_an_independent_trace(broad_dir: Path, golden_dir: Path) -> None:
    record = records.read(broad_dir / "05_undisturbed_slow_rotation_with_breaks_B.mat")
    golden = np.load(golden_dir / "kcf_broad05.npz")
    # The trace uses odds of exp(-1.1). Its row 0 is from before its first slow step.
    plain = KCF(frame="enu", sample_time=0.0035, refine=False, uncalibrated_odds=float(np.exp(-1.1)))
    assert angle_between(plain.run(record).q[20::20], golden["startup"][1:]).max() < 1e-6
    rounded = KCF(frame="enu", sample_time=0.0035, refine=False)
    assert angle_between(rounded.run(record).q[20::20], golden["startup"][1:]).max() < 1e-6


@pytest.mark.slow
def test_the_mean_errors_of_the_development_half(trials: list[Record]) -> None:
    total, heading, inclination = mean_errors(trials, benchmark.as_recorded)
    assert total < 1.71
    assert heading < 1.52
    assert inclination < 0.62


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stress", "limit"),
    [
        ("hard iron (5, -5) uT", 6.8),
        ("rest cut off", 2.40),
        ("rest cut off, +1 deg/s", 2.75),
        ("every third sample", 1.75),
    ],
)
def test_the_errors_under_stress(trials: list[Record], stress: str, limit: float) -> None:
    assert mean_errors(trials, benchmark.STRESSES[stress])[0] < limit
    assert mean_errors(trials, benchmark.STRESSES[stress], spread=True)[0] < 1.01 * limit


@pytest.mark.slow
def test_single_precision_agrees_on_every_trial(trials: list[Record]) -> None:
    for record in trials:
        options = {"frame": record.frame.value, "sample_time": record.sample_time}
        double, single = (KCF(precision=p, **options).run(record).q for p in ("double", "single"))
        assert angle_between(double, single).max() < 0.01 * DEG


@pytest.mark.slow
def test_no_trial_is_called_implausible_and_swapped_ones_are(trials: list[Record]) -> None:
    def reported(record: Record) -> bool:
        filter_ = KCF(frame=record.frame.value, sample_time=record.sample_time)
        return bool(filter_.run(record).others["implausible"].any())

    assert not any(map(reported, trials))
    assert all(reported(benchmark.swapped_gyro(r)) for r in trials)
    assert all(reported(benchmark.swapped_mag(r)) for r in trials)


@pytest.mark.slow
@pytest.mark.parametrize("name", scenarios.names())
def test_no_experiment_is_called_implausible(name: str) -> None:
    for profile in ("hand", "multirotor"):
        for seed in SEEDS:
            record = scenarios.load(name, seed)
            result = KCF(sample_time=record.sample_time, profile=profile).run(record)
            assert not result.others["implausible"].any(), (profile, seed)


@pytest.mark.slow
def test_the_smoother_is_better_than_the_filter(trials: list[Record]) -> None:
    errors = []
    for record in trials:
        rms = attitude_error(kcf_offline.smooth(record).q, record.q_true).rms(record.evaluate)
        errors.append(rms.degrees()["total"])
    assert np.mean(errors) < 1.52


def test_the_way_back_ends_where_the_way_there_began(broad_dir: Path) -> None:
    record = records.read(broad_dir / "11_undisturbed_slow_translation_B.mat")
    smoothed = kcf_offline.smooth(record)
    errors = {
        name: attitude_error(q, record.q_true).rms(record.evaluate).degrees()["total"]
        for name, q in (("there", smoothed.forward.q), ("back", smoothed.backward), ("both", smoothed.q))
    }
    assert max(errors["back"], errors["both"]) < 0.7 * errors["there"]
    half = kcf_offline.between(smoothed.forward.q, smoothed.backward)
    np.testing.assert_array_equal(half, smoothed.q)
    np.testing.assert_allclose(angle_between(half, half), 0.0, atol=1e-7)


def euler_rms(name: str, seed: int, make: Callable[[Record], models.Estimator]) -> np.ndarray:
    """RMS errors of roll, pitch and yaw, degrees, of a cold start on a published experiment."""
    record = scenarios.load(name, seed)
    rms = attitude_error(make(record).run(record).q, record.q_true).rms(record.evaluate).degrees()
    return np.array([rms["roll"], rms["pitch"], rms["yaw"]])


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["hand", "multirotor"])
@pytest.mark.parametrize("name", TABLE)
def test_the_published_experiments(name: str, profile: str) -> None:
    def make(record: Record) -> KCF:
        return KCF(sample_time=record.sample_time, profile=profile)

    mean = np.mean([euler_rms(name, seed, make) for seed in SEEDS], axis=0)
    print(f"{name} {profile}: " + " / ".join(f"{x:.2f}" for x in mean))
    expected = np.array(TABLE[name][("hand", "multirotor").index(profile)])
    assert np.all(mean <= np.maximum(1.1 * expected, expected + 0.03)), mean


@pytest.mark.slow
def test_under_multirotor_dynamics_it_is_far_better_than_every_other_estimator() -> None:
    def errors(model: str, **options: object) -> np.ndarray:
        def make(record: Record) -> models.Estimator:
            return models.BY_NAME[model](sample_time=record.sample_time, **options)

        return np.mean([euler_rms("me/dynamic", seed, make) for seed in SEEDS], axis=0)

    own = np.linalg.norm(errors("kcf", profile="multirotor"))
    for model in models.BY_NAME:
        if model != "kcf":
            ratio = np.linalg.norm(errors(model)) / own
            print(f"{model}: {ratio:.1f} times the KCF's error")
            assert ratio > 1.5, model


def with_bursts(record: Record, seed: int) -> Record:
    """Senseless samples of every sensor for up to 0.2 s, and times without accelerometer or magnetometer."""
    draw = np.random.default_rng(seed)
    sensors = {name: np.array(getattr(record, name)) for name in ("gyro", "accel", "mag")}
    valid = {name: np.ones(len(record), dtype=np.bool_) for name in ("accel_valid", "mag_valid")}
    longest = int(0.2 / record.sample_time)
    for samples in sensors.values():
        for start in draw.integers(1, len(record), 8):
            stop = start + draw.integers(1, longest + 1)
            samples[start:stop] = draw.choice([np.nan, np.inf, -np.inf, 1e30])
    for flags in valid.values():
        for start in draw.integers(1, len(record), 3):
            flags[start : start + int(draw.uniform(0.5, 3.0) / record.sample_time)] = False
    return replace(record, **sensors, **valid)


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["hand", "multirotor"])
@pytest.mark.parametrize("bursts", [False, True])
@pytest.mark.parametrize("name", scenarios.names())
def test_covariance_and_calibration_stay_sound_in_every_experiment(
    name: str, bursts: bool, profile: str
) -> None:
    outputs = ["q", "gyro_bias", "hard_iron", "gyro_scale", "mag_latency"]
    for seed in range(1, 21):
        record = scenarios.load(name, seed)
        record = with_bursts(record, seed) if bursts else record
        core = NativeModel(descriptors.load("kcf"))
        core.set("sample_time", record.sample_time)
        core.set("profile", ("hand", "multirotor").index(profile))
        core.reset()
        steps = np.diff(record.time, prepend=record.time[0])
        for part in np.array_split(np.arange(len(record)), 5):
            samples = {
                s: getattr(record, s)[part] for s in ("gyro", "accel", "mag", "accel_valid", "mag_valid")
            }
            y = core.run(steps[part], samples, outputs)
            assert all(np.isfinite(values).all() for values in y.values())
            assert np.abs(y["hard_iron"]).max() < 100e-6
            assert np.abs(y["gyro_scale"]).max() < 0.1
            assert np.abs(y["mag_latency"]).max() < 0.05
            assert np.linalg.eigvalsh(covariance_of(core)).min() > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLE)
def test_bursts_and_dropouts_cost_little(name: str) -> None:
    def total(record: Record) -> float:
        q = KCF(sample_time=record.sample_time, profile="multirotor").run(record).q
        return attitude_error(q, record.q_true).rms(record.evaluate).degrees()["total"]

    clean = [total(scenarios.load(name, seed)) for seed in SEEDS]
    spoilt = [total(with_bursts(scenarios.load(name, seed), seed)) for seed in SEEDS]
    assert np.mean(spoilt) < 1.5 * np.mean(clean) + 0.5


def covariance_of(core: NativeModel) -> np.ndarray:
    """Covariance (19, 19) inside the state: what follows nineteen states that begin with the bias."""
    held = np.frombuffer(core.save(), dtype=np.float64)
    bias = core.get("gyro_bias")
    for k in range(len(held) - 399):
        rows = held[k + 19 : k + 399].reshape(19, 20)
        covariance, padding = rows[:, :19], rows[:, 19]
        if np.array_equal(held[k : k + 3], bias) and not padding.any() and covariance.trace() > 0.0:
            np.testing.assert_array_equal(covariance, covariance.T)
            return covariance
    raise AssertionError("no covariance in the state")


@pytest.mark.parametrize("name", ["VQF", "BasicVQF", "offlineVQF", "Fusion"])
def test_peers_get_their_frames_and_units_right(name: str, broad_dir: Path) -> None:
    pytest.importorskip("vqf")
    pytest.importorskip("imufusion")
    trial = next(t for t in benchmark.find_trials(broad_dir) if t.name.startswith("05_"))
    assert benchmark.evaluate(benchmark.Job(name, trial)).total < 3.0


def test_the_sign_of_a_quaternion_does_not_matter_half_way() -> None:
    p = quaternion.exp(np.array([[0.1, 0.2, 0.3]]))
    q = quaternion.exp(np.array([[0.1, 0.2, 0.5]]))
    np.testing.assert_allclose(kcf_offline.between(p, q), kcf_offline.between(p, -q), atol=1e-12)

"""The benchmark on recordings of its own making: what it counts, keeps and draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import Frame, benchmark, benchmark_plots, peers, records
from ahrs_fmu.cli import main
from ahrs_fmu.errors import RecordError
from ahrs_fmu.metrics import attitude_error
from motion import tumbling


@pytest.fixture
def data(tmp_path: Path) -> Path:
    folder = tmp_path / "data"
    folder.mkdir()
    names = ("01_undisturbed_slow_rotation_A", "33_disturbed_attached_magnet_2cm")
    for seed, name in enumerate(names):
        record = tumbling(12.0, 0.01, seed=seed)
        moving = np.arange(len(record)) >= 300
        path = folder / f"{name}.mat"
        fields = {"evaluate": moving, "name": name}
        records.write(
            type(record)(
                time=record.time,
                gyro=record.gyro,
                accel=record.accel,
                mag=record.mag,
                q_true=record.q_true,
                **fields,
            ),
            path,
        )
    return folder


@pytest.mark.parametrize(
    ("name", "group"),
    [
        ("07_undisturbed_fast_rotation_B", "undisturbed"),
        ("25_disturbed_tapping_B", "vibration"),
        ("27_disturbed_phone_vibration_B", "vibration"),
        ("31_disturbed_stationary_magnet_D", "fixed magnet"),
        ("35_disturbed_attached_magnet_4cm", "attached magnet"),
        ("38_disturbed_office_B", "other"),
    ],
)
def test_a_trial_belongs_to_the_group_its_name_tells(name: str, group: str) -> None:
    assert benchmark.group_of(name) == group


def test_a_second_run_uses_what_the_first_has_kept(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = [benchmark.Job("kcf", trial) for trial in benchmark.find_trials(data)]
    first = benchmark.run(jobs, tmp_path / "kept")
    monkeypatch.setattr(benchmark, "evaluate", None)
    again = benchmark.run(jobs, tmp_path / "kept")
    for a, b in zip(first, again, strict=True):
        assert (a.total, a.heading, a.inclination) == (b.total, b.heading, b.inclination)
        np.testing.assert_array_equal(a.curves, b.curves)


def test_only_the_movement_counts(data: Path) -> None:
    trial = benchmark.find_trials(data)[0]
    outcome = benchmark.evaluate(benchmark.Job("kcf", trial))
    moving = outcome.time >= 3.0
    assert outcome.total == pytest.approx(np.sqrt(np.mean(outcome.curves[moving, 0] ** 2)), rel=1e-6)


def test_stresses_change_what_they_say(data: Path) -> None:
    record = records.read(benchmark.find_trials(data)[0].path).in_frame(Frame.ENU)
    cut = benchmark.without_rest_biased(record)
    assert cut.evaluate is not None
    assert cut.evaluate.all()
    np.testing.assert_allclose(cut.gyro, record.gyro[300:] + np.pi / 180)
    np.testing.assert_allclose(benchmark.every_third(record).accel, record.accel[::3])
    np.testing.assert_allclose(benchmark.with_hard_iron(record).mag - record.mag, [[5e-6, -5e-6, 0.0]] * 1201)
    assert not benchmark.Job("VQF", benchmark.find_trials(data)[0], benchmark.SINGLE).is_possible


def test_rows_are_means_in_order_of_the_total(data: Path, tmp_path: Path) -> None:
    trials = benchmark.find_trials(data)
    jobs = [benchmark.Job(name, trial) for name in ("gcf", "kcf") for trial in trials]
    outcomes = benchmark.run(jobs, tmp_path / "kept")
    rows = benchmark.summary(outcomes)
    assert [row.total for row in rows] == sorted(row.total for row in rows)
    kcf = next(row for row in rows if row.estimator == "KCF")
    own = [o.total for o in outcomes if o.job.estimator == "kcf"]
    assert kcf.total == pytest.approx(np.mean(own))
    assert kcf.by_group == {"undisturbed": own[0], "attached magnet": own[1]}
    assert len(benchmark_plots.bar_chart(rows, "two").axes[0].patches) == 3 * len(rows)
    assert len(benchmark_plots.trial_figure(outcomes[::2]).axes) == 3


def test_a_folder_without_recordings_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="holds no MAT files"):
        benchmark.find_trials(tmp_path)


def test_the_command_prints_a_table_and_draws(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["benchmark", "broad", "--data", str(data), "--estimators", "kcf, GCF"]
    arguments += ["--workers", "1", "--stress", "-o", str(tmp_path / "out")]
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert "mean over 2 trials" in text
    assert "KCF" in text
    assert "gyro x swapped" in text
    drawn = {path.name for path in (tmp_path / "out" / "benchmark").rglob("*.png")}
    assert drawn == {"broad.png", *(f"{trial.name}.png" for trial in benchmark.find_trials(data))}


def test_an_unknown_filter_is_refused(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["benchmark", "broad", "--data", str(data), "--estimators", "kcf,nonsense"]) == 2
    error = capsys.readouterr().err
    assert "no filter 'nonsense'" in error
    assert "--peers" in error


@pytest.mark.parametrize("name", peers.PEERS)
def test_a_peer_follows_ideal_sensors_in_its_own_units_and_frame(name: str) -> None:
    pytest.importorskip(peers.PEERS[name][1])
    record = tumbling(30.0, 0.01, rate=0.5).in_frame(Frame.ENU)
    assert record.q_true is not None
    error = attitude_error(peers.PEERS[name][0](record), record.q_true)
    # A frame, a sign or a unit that is wrong costs tens of degrees.
    assert np.degrees(error.total[2000:].max()) < 1.5

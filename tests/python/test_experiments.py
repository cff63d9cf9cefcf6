"""The published experiments, RMS errors beside those of an independent computation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import experiments, scenarios
from ahrs_fmu.cli import main
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.experiments import Outcome

SETTLED = [
    (setting, scenario)
    for setting, entry in experiments.settings().items()
    for scenario in entry.expected
    if entry.is_settled(scenario)
]
FAILING = [
    (setting, scenario)
    for setting in ("adaptive CKF as printed", "adaptive CKF, textbook")
    for scenario in experiments.scenario_names()
    if scenario not in experiments.setting(setting).expected
]


def one(setting: str, scenario: str, seeds: int) -> Outcome:
    return experiments.run(scenario, [setting], range(1, seeds + 1))[0]


@pytest.mark.parametrize("setting", list(experiments.settings()))
def test_every_estimator_agrees_on_an_experiment_of_its_kind(setting: str) -> None:
    entry = experiments.setting(setting)
    # The errors of these two follow from the motion, not from the noise: three seeds tell.
    for scenario in ("me/dynamic", "gc/circ"):
        if entry.is_settled(scenario) and entry.model != "strapdown":
            outcome = one(setting, scenario, 3)
            assert outcome.agrees, (scenario, np.degrees(outcome.mean), outcome.expected)
            assert outcome.resets == 0


@pytest.mark.slow
@pytest.mark.parametrize(("setting", "scenario"), SETTLED)
def test_every_estimator_agrees_on_every_experiment(setting: str, scenario: str) -> None:
    outcome = one(setting, scenario, 10)
    assert outcome.agrees, (np.degrees(outcome.mean), outcome.expected)
    assert outcome.resets == 0


@pytest.mark.parametrize(("setting", "scenario"), FAILING)
def test_what_loses_its_covariance_there_loses_it_here(setting: str, scenario: str) -> None:
    outcome = one(setting, scenario, 2)
    assert outcome.expected is None
    assert outcome.resets > 0
    assert np.isfinite(outcome.rms).all()
    assert outcome.verdict == "fails likewise"


@pytest.mark.parametrize(("factor", "verdict"), [(1.2, "agrees"), (1.4, "differs")])
def test_the_tolerance_is_thirty_per_cent_or_a_twentieth_of_a_degree(factor: float, verdict: str) -> None:
    expected = np.radians([1.0, 0.5, 0.01])
    rms = np.tile(expected * factor, (2, 1))
    rms[:, 2] = np.radians(0.05)
    assert Outcome("x", "y", rms, 0, expected, settled=True).verdict == verdict
    assert Outcome("x", "y", 3 * rms, 0, expected, settled=False).verdict == "differs, as seeds do"
    assert Outcome("x", "y", rms, 0, None, settled=True).verdict == "does not fail here"


def test_noise_per_sample_becomes_a_density() -> None:
    values = experiments.setting("MEKF").values("gc/lin", scenarios.describe("gc/lin"))
    assert values["gyro_noise"] == pytest.approx(np.radians(0.05) * np.sqrt(0.02))
    assert values["gyro_bias_noise"] == pytest.approx(np.radians(0.001) / np.sqrt(0.02))
    assert values["accel_noise"] == pytest.approx(0.01 * np.sqrt(0.02))
    assert values["mag_noise"] == pytest.approx(1e-7 * np.sqrt(0.02))
    cubature = experiments.setting("CKF").values("gc/lin", scenarios.describe("gc/lin"))
    assert cubature["quaternion_noise"] == pytest.approx(0.01 / np.sqrt(0.02))


def test_hardware_runs_and_compensation_have_their_own_parameters() -> None:
    gcf = experiments.setting("GCF, compensated 0.98")
    hardware = gcf.values("gc/hw-circ", scenarios.describe("gc/hw-circ"))
    assert (hardware["kp"], hardware["ki"]) == (0.15, 0.01)
    assert gcf.values("gc/lin", scenarios.describe("gc/lin"))["kp"] == 0.5
    assert hardware["motion_time_constant"] == pytest.approx(-0.02 / np.log(0.98))
    never = experiments.setting("GCF, compensated 1").values("gc/lin", scenarios.describe("gc/lin"))
    assert never["motion_time_constant"] == np.inf


def test_the_settings_cover_every_estimator_but_the_newest() -> None:
    assert {entry.model for entry in experiments.settings().values()} == {
        *("strapdown", "complementary", "improved_ekf", "mahony", "mahony_ekf", "adaptive_ckf", "cg_ekf"),
        *("gcf", "mekf", "ukf"),
    }


def test_unknown_sources_and_settings_are_refused_with_the_known_ones(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["reproduce", "XY"]) == 2
    assert "'XY' is unknown; known are ME, AC, CG, GC and all" in capsys.readouterr().err
    with pytest.raises(ScenarioError, match=r"'EKF' is unknown; known are .*MEKF"):
        experiments.run("gc/lin", ["EKF"], [1])


@pytest.mark.slow
def test_reproduce_writes_tables_and_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "CG", "--seeds", "2", "-o", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "Turned by hand" in printed
    assert {path.name for path in tmp_path.iterdir()} == {
        *("reproduce.csv", "reproduce.md", "cg-hand.png", "cg-hand.svg"),
    }
    table = (tmp_path / "reproduce.md").read_text()
    assert table.count("agrees") == (tmp_path / "reproduce.csv").read_text().count("agrees") > 10

"""The commands bode, design, allan and explain."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import Record, records
from ahrs_fmu.analysis.design import gains_for, optimal_gains
from ahrs_fmu.analysis.sensor_noise import noise_of_imu
from ahrs_fmu.analysis.simulate import sensors_at_rest
from ahrs_fmu.analysis.theory import Gains, filter_of
from ahrs_fmu.cli import main
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.sensors import load


@pytest.fixture(autouse=True)
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_fmu("gcf", fmi="3", output=tmp_path_factory.mktemp("build"))


@pytest.fixture
def rest(workplace: Path) -> Path:
    sensor = noise_of_imu(load("mpu9250"), 0.01)
    readings = sensors_at_rest(sensor, 0.01, 60.0, 3)
    record = Record(time=0.01 * np.arange(len(readings["gyro"])), **readings)
    return Path(records.write(record, workplace / "rest.csv") or workplace / "rest.csv")


def said(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert main([str(a) for a in arguments]) == 0
    return capsys.readouterr().out


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert main([str(a) for a in arguments]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


def written(path: str) -> dict[str, object]:
    found: dict[str, object] = json.loads(Path(path).read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize("command", ["bode", "design", "allan", "explain"])
def test_every_command_shows_examples_in_its_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert f"Examples:\n    ahrs-fmu {command}" in said(capsys, command, "--help")


def test_bode_refuses_what_is_no_attitude_estimator(capsys: pytest.CaptureFixture[str]) -> None:
    message = refused(capsys, "bode", "--estimator", "quadrotor", "--measure", "--points", 2)
    assert "no variable gyro, accel, mag" in message


def test_bode_shows_the_theory_of_gains(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "bode", "--kp", 0.5, "--ki", 0.1, "--points", 5, "--json", "bode.json")
    assert "crossover" in text
    data = written("bode.json")
    g_a, _ = filter_of(Gains(0.5, 0.1), 0.01).respond(np.array(data["frequency"]["value"]))
    np.testing.assert_allclose(data["theory"]["angle"]["real"], g_a.real)
    assert data["measured"] == {}
    assert data["characteristics"]["crossover"]["unit"] == "rad/s"


def test_bode_measures_the_c_core_and_draws(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "bode", "--measure", "--points", 4, "--save", "--json", "bode.json")
    assert text.count("from theory, coherence at least 0.9999") + text.count("coherence at least 1.0") == 2
    assert Path("build/bode/gcf_roll.png").is_file()
    assert Path("build/bode/gcf_roll.svg").is_file()
    data = written("bode.json")
    assert set(data["measured"]) == {"angle", "rate"}
    np.testing.assert_allclose(
        data["measured"]["angle"]["real"], data["theory"]["angle"]["real"], rtol=1e-2, atol=1e-4
    )


def test_bode_measures_an_fmu_with_the_gains_it_is_given(
    capsys: pytest.CaptureFixture[str], fmu: Path
) -> None:
    settings = ("--set", "sample_time=0.02", "--set", "realisation=vector", "--kp", 1, "--ki", 0.3)
    text = said(
        capsys, "bode", "--fmu", fmu, "--measure", *settings, "--points", 4, "--low", 0.2, "--axis", "yaw"
    )
    assert text.startswith("GCF, yaw, 50 Hz")
    assert "at most 0.008" in text


def test_bode_of_the_coupled_error_has_a_theory_on_pitch_only(capsys: pytest.CaptureFixture[str]) -> None:
    settings = ("--set", "error=coupled", "--points", 3)
    said(capsys, "bode", *settings, "--axis", "pitch", "--json", "bode.json")
    assert written("bode.json")["gains"] == {"kp": 1.0, "ki": 0.2, "kii": 0.0}
    assert "add --measure" in refused(capsys, "bode", *settings, "--axis", "roll")


@pytest.mark.parametrize(("axis", "decibels"), [("roll", "0.0"), ("yaw", "0.00")])
def test_bode_knows_that_motion_compensation_acts_on_tilt_alone(
    axis: str, decibels: str, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = ("--set", "motion_compensation=true", "--set", "motion_time_constant=2", "--measure")
    gains = ("--kp", 5, "--ki", 0.1, "--set", "sample_time=0.02")
    options = ("--points", 3, "--low", 0.3, "--amplitude", 2, "--axis", axis)
    assert said(capsys, "bode", *settings, *gains, *options).count(f"at most {decibels}") == 2


def test_bode_names_the_nearest_filter_where_there_is_no_theory(capsys: pytest.CaptureFixture[str]) -> None:
    quick = ("--measure", "--method", "multisine", "--points", 5, "--low", 0.1)
    text = said(capsys, "bode", "--set", "error=coupled", *quick)
    assert "nearest complementary filter: kp " in text


def test_design_finds_gains_for_a_crossover(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "design", "--crossover", 0.5, "--damping", 0.8, "--json", "design.json", "--save")
    assert Path("build/design/bode.png").is_file()
    gains = gains_for(0.5, 0.8)
    assert f"kp = {gains.kp:.4g} rad/s, ki = {gains.ki:.4g} rad2/s2" in text
    assert written("design.json")["gains"]["kp"] == pytest.approx(gains.kp)


def test_design_finds_the_best_gains_of_a_sensor_and_draws_the_curve(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = said(capsys, "design", "--sensor", "mpu9250", "--save", "--json", "design.json")
    best = optimal_gains(noise_of_imu(load("mpu9250"), 0.01).tilt)
    data = written("design.json")
    assert data["gains"]["ki"] == pytest.approx(best.ki)
    assert data["attitude"]["heading"]["unit"] == "rad"
    assert "predicted RMS at rest" in text
    assert Path("build/design/error.svg").is_file()


def test_design_warns_of_a_crossover_that_the_sample_rate_does_not_allow(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["design", "--crossover", "90"]) == 0
    assert "90 rad/s is fast for 100 Hz" in capsys.readouterr().err


def test_bode_refuses_an_fmu_that_is_no_attitude_estimator(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    other = build_fmu("quadrotor", fmi="3", output=tmp_path)
    assert "no variable gyro, accel, mag" in refused(capsys, "bode", "--fmu", other, "--measure")


def test_design_takes_densities_in_degrees(capsys: pytest.CaptureFixture[str]) -> None:
    said(capsys, "design", "--noise", "gyro=0.007,walk=1e-3,accel=2e-3", "--json", "design.json")
    sensor = written("design.json")["sensor"]
    assert sensor["gyro"]["value"] == pytest.approx(math.radians(0.007))
    assert sensor["bias_walk"]["value"] == pytest.approx(math.radians(1e-3))
    assert written("design.json")["attitude"] is None


def test_design_slows_down_for_a_vehicle_that_accelerates(capsys: pytest.CaptureFixture[str]) -> None:
    said(capsys, "design", "--sensor", "mpu9250", "--json", "calm.json")
    said(capsys, "design", "--sensor", "mpu9250", "--motion", "0.5,0.2,2", "--json", "moved.json")
    assert written("moved.json")["gains"]["kp"] < 0.5 * written("calm.json")["gains"]["kp"]


def test_allan_goes_from_a_recording_to_gains(capsys: pytest.CaptureFixture[str], rest: Path) -> None:
    text = said(capsys, "allan", rest, "--save", "--json", "allan.json")
    assert "best gains for roll and pitch at rest: kp =" in text
    assert Path("build/allan/rest.png").is_file()
    data = written("allan.json")
    assert data["gyro"]["x"]["white"]["value"] == pytest.approx(1.234e-4, rel=0.1)
    assert len(data["gyro"]["x"]["tau"]) == len(data["gyro"]["x"]["deviation"])


def test_explain_says_what_the_gains_do(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "explain", "gcf", "--set", "kp=1", "--set", "ki=0", "--json", "explain.json")
    for topic in ("crossover", "damping", "settling", "gyro bias", "tilt per 1 m/s2", "stability"):
        assert topic in text
    assert "first order" in text
    assert len(text.splitlines()) < 40
    assert set(written("explain.json")["findings"][0]) == {"topic", "value", "meaning"}


@pytest.mark.parametrize(
    ("estimator", "words"),
    [
        ("complementary", "Complementary: kp = 0.58 rad/s; 100 Hz"),
        ("mahony", "Mahony: kp = 1 rad/s, ki = 0.1 rad2/s2; 100 Hz"),
        ("mahony_ekf", "to second order and low-pass 5.02 rad/s: kp = 1.017 rad/s"),
        ("improved_ekf", "to first order: kp = 4.876 rad/s"),
        ("adaptive_ckf", "within 2 dB to first order"),
        ("mekf", "to second order: kp = 0.4335 rad/s, ki = 0.08897 rad2/s2"),
        ("kcf", "to low-pass of second order: natural frequency 0.4029 rad/s"),
    ],
)
def test_explain_speaks_of_every_estimator(
    estimator: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = said(capsys, "explain", estimator)
    assert words in text
    for topic in ("crossover", "settling", "gyro bias", "tilt per 1 m/s2", "stability", "predicted error"):
        assert topic in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("bode", "--kp", "500"), "kp*sample_time < 1"),
        (("bode", "--kp", "-1"), "kp = -1"),
        (("bode", "--set", "kP=1"), "no parameter 'kP'"),
        (("bode", "--low", "-1"), "give positive ones"),
        (("bode", "--high", "1000"), "stay below half the sample rate"),
        (("bode", "--measure", "--amplitude", "90"), "amplitude = 90 deg"),
        (("bode", "--fmu", "nowhere.fmu"), "nowhere.fmu"),
        (("bode", "--estimator", "nothing"), "no model 'nothing'"),
        (("design",), "give --crossover, --sensor or --noise"),
        (("design", "--crossover", "-1"), "crossover = -1 rad/s"),
        (("design", "--crossover", "500"), "unstable"),
        (("design", "--crossover", "1", "--damping", "-1"), "damping = -1: give a positive"),
        (("design", "--noise", "gyro=-1,accel=1"), "gyro = -1 deg/s/rtHz: it must be zero or positive"),
        (("bode", "--measure", "--amplitude", "0"), "amplitude = 0 deg"),
        (("design", "--crossover", "1", "--rate", "0"), "rate = 0 Hz"),
        (("design", "--sensor", "none"), "sensor 'none' is unknown"),
        (("design", "--noise", "giro=1"), "'giro' is none of gyro, walk, accel, mag"),
        (("design", "--noise", "gyro=1"), "accel=... is needed"),
        (("design", "--noise", "gyro=x,accel=1"), "gyro = x: it is not a number"),
        (("design", "--sensor", "gc", "--noise", "gyro=1"), "not both"),
        (("design", "--sensor", "gc", "--motion", "1,2"), "RMS,LOW,HIGH"),
        (("allan", "nowhere.csv"), "nowhere.csv"),
        (("explain", "gcf", "--set", "ki=1e6"), "ki*sample_time*sample_time"),
        (("explain", "nothing"), "no model 'nothing'"),
        (
            ("explain", "strapdown"),
            "Strapdown: the estimate does not answer to accelerometer and magnetometer",
        ),
        (("explain", "quadrotor"), "Quadrotor: no variable gyro, accel, mag"),
        (("explain", "mekf", "--set", "kp=1"), "no parameter 'kp'"),
    ],
)
def test_wrong_options_are_refused_in_one_line(
    arguments: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in refused(capsys, *arguments)


def test_a_recording_that_is_too_short_is_refused(
    capsys: pytest.CaptureFixture[str], workplace: Path
) -> None:
    readings = sensors_at_rest(noise_of_imu(load("mpu9250"), 0.01), 0.01, 5.0, 3)
    records.write(Record(time=0.01 * np.arange(500), **readings), workplace / "short.csv")
    assert "record 10 s or more at rest" in refused(capsys, "allan", "short.csv")

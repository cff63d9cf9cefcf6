from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from ahrs_fmu import records
from ahrs_fmu.cli import main
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.version import __version__


@pytest.fixture(autouse=True)
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, and no recordings but those of the test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("BROAD_DIR", raising=False)
    return tmp_path


@pytest.fixture
def flight(workplace: Path) -> Path:
    (workplace / "empty").mkdir()
    path = workplace / "flight.csv"
    records.write(demo_flight(duration=8.0), path)
    return path


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line that a refused command leaves on the error stream."""
    assert main(arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("ahrs-fmu: ")
    return lines[0]


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """What a successful command prints."""
    assert main(arguments) == 0
    return capsys.readouterr().out


def test_without_a_command_the_help_lists_all_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys)
    assert all(command in text for command in ("build", "info", "validate", "replay", "cosim", "demo"))


@pytest.mark.parametrize("command", ["build", "info", "validate", "replay", "cosim", "demo"])
def test_every_command_explains_itself_with_examples(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = said(capsys, command, "--help")
    assert f"Examples:\n    ahrs-fmu {command}" in text


def test_the_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, "--version") == f"ahrs-fmu {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--bogus"], "--bogus"),
        (["nonsense"], "nonsense"),
        (["validate"], "Missing argument"),
        (["replay"], "BROAD_DIR"),
        (["replay", "none.csv"], "none.csv: No such file"),
        (["replay", "empty"], "empty: no recordings in it"),
        (["replay", "gc/line"], "scenario 'gc/line' is unknown; known are me/static"),
        (["replay", "flight.csv", "--via", "fmu4"], "'fmu4' is not one of"),
        (["replay", "flight.csv", "--set", "kp"], "'kp' is not of the form NAME=VALUE"),
        (["replay", "flight.csv", "--set", "kpp=1"], "no parameter 'kpp'; it has kp among"),
        (["replay", "flight.csv", "--set", "kp=-1"], "kp = -1 rad/s is refused"),
        (["replay", "flight.csv", "--set", "kp=fast"], "kp = 'fast' is not a number"),
        (["replay", "flight.csv", "--estimator", "foo"], "no model 'foo'"),
        (["replay", "flight.csv", "--unit", "accel=g", "--unit", "mag=ft"], "mag cannot have the unit 'ft'"),
        (["replay", "flight.csv", "--frame", "enu"], "declare the other frame"),
        (["build", "foo"], "no model 'foo'"),
        (["build", "--platforms", "mars"], "unknown platform 'mars'"),
        (["build", "--fmi", "1"], "'1' is not one of"),
        (["info", "none.fmu"], "none.fmu: No such file"),
        (["info", "flight.csv"], "flight.csv: is not an FMU"),
        (["validate", "none.fmu"], "none.fmu: No such file"),
    ],
)
@pytest.mark.usefixtures("flight")
def test_what_cannot_be_done_is_one_line_and_exit_code_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in refused(capsys, *arguments)


def test_an_error_in_several_lines_is_still_told_in_one(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, flight: Path
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError("first\nsecond")

    monkeypatch.setattr("ahrs_fmu.commands.replay.records.read", fail)
    assert refused(capsys, "replay", str(flight)) == "ahrs-fmu: first second"


def test_replay_prints_errors_and_draws_a_picture(capsys: pytest.CaptureFixture[str], flight: Path) -> None:
    text = said(capsys, "replay", str(flight), "--plot")
    assert "GCF, C core" in text
    assert "RMS error [deg]" in text
    assert "generated flight" in text
    plots = [Path(line.removeprefix("plot: ")) for line in text.splitlines() if line.startswith("plot: ")]
    assert [p.suffix for p in plots] == [".png", ".svg"]
    assert all(p.stat().st_size > 10_000 for p in plots)


def test_replay_knows_the_published_experiments_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "replay", "gc/lin", "ac/swing", "--estimator", "mekf", "--set", "gravity=9.8")
    assert [line.split()[0] for line in text.splitlines() if "/" in line] == ["gc/lin", "ac/swing"]
    other = said(capsys, "replay", "gc/lin", "--estimator", "mekf", "--set", "gravity=9.8", "--seed", "2")
    assert other not in text


def test_replay_of_a_folder_adds_the_mean(capsys: pytest.CaptureFixture[str], flight: Path) -> None:
    records.write(demo_flight(duration=8.0, seed=2), flight.parent / "second.npz")
    assert "mean" in said(capsys, "replay", str(flight.parent))


def test_replay_without_truth_prints_the_last_attitude(
    capsys: pytest.CaptureFixture[str], workplace: Path
) -> None:
    records.write(replace(demo_flight(duration=8.0), q_true=None), workplace / "log.npz")
    text = said(capsys, "replay", "log.npz")
    assert "last attitude [deg]" in text
    assert "RMS" not in text


def test_settings_change_the_result(capsys: pytest.CaptureFixture[str], flight: Path) -> None:
    default = said(capsys, "replay", str(flight))
    assert said(capsys, "replay", str(flight), "--set", "kp=5", "--set", "realisation=vector") != default


def test_a_questionable_setting_warns_once_and_runs(capsys: pytest.CaptureFixture[str], flight: Path) -> None:
    settings = ("--set", "motion_compensation=true", "--set", "motion_time_constant=inf")
    assert main(["replay", str(flight), str(flight), *settings]) == 0
    warnings = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning: ")]
    assert len(warnings) == 1


@pytest.mark.parametrize("via", ["fmu2", "fmu3", "fmu3-scalar"])
def test_replay_through_an_fmu_prints_the_same_errors(
    via: str, capsys: pytest.CaptureFixture[str], flight: Path
) -> None:
    core = said(capsys, "replay", str(flight)).splitlines()
    through = said(capsys, "replay", str(flight), "--via", via).splitlines()
    assert through[1:] == core[1:]


def test_build_info_and_validate_go_together(capsys: pytest.CaptureFixture[str], workplace: Path) -> None:
    assert "build/fmi2/GCF.fmu" in said(capsys, "build", "gcf")
    made = sorted(p.relative_to(workplace) for p in workplace.rglob("*.fmu"))
    assert made == [Path("build", f"fmi{n}", "GCF.fmu") for n in (2, 3)]
    assert said(capsys, "validate", *map(str, made)).count("no problem") == 2
    text = said(capsys, "info", str(made[1]))
    assert "FMI 3.0 co-simulation" in text
    assert "  kp: 0.5 rad/s, 0 to 1000, tunable" in text


def test_validate_lists_problems_and_returns_1(capsys: pytest.CaptureFixture[str], workplace: Path) -> None:
    with zipfile.ZipFile(workplace / "bad.fmu", "w") as archive:
        archive.writestr("readme.txt", "")
    assert main(["validate", "bad.fmu"]) == 1
    assert "  modelDescription.xml is missing" in capsys.readouterr().out


def test_the_demo_flies_on_fmus_with_the_bits_of_the_c_code_and_draws(
    capsys: pytest.CaptureFixture[str], workplace: Path
) -> None:
    text = said(capsys, "demo")
    assert text.count("no problem found") == 8
    assert sum(line.rstrip().endswith("same") for line in text.splitlines()) == 3
    assert "FAILS" not in text
    for name in ("flight", "bode"):
        assert (workplace / "build" / "demo" / f"{name}.png").stat().st_size > 10_000

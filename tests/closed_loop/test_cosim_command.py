"""The command ``ahrs-fmu cosim`` as a person uses it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from ahrs_fmu.cli import main

SCENARIO = """
template = "estimation"
duration = 10.0
[[expect]]
signal = "attitude_error.total"
measure = "rms"
at_most = "6 deg"
"""


@pytest.fixture(autouse=True)
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with one scenario."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rest.cosim.toml").write_text(SCENARIO)
    return tmp_path


def test_it_prints_a_table_of_verdicts_and_draws(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cosim", "rest.cosim.toml", "--plot"]) == 0
    text = capsys.readouterr().out
    assert "rest seed=1: 10 s, " in text
    assert "rms of attitude_error.total" in text
    assert "holds" in text
    assert Path("build/cosim/rest-seed=1.png").stat().st_size > 10_000


def test_a_clause_that_fails_gives_exit_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    limit = "expect=[{signal='attitude_error.total', measure='max', at_most='0.001 deg'}]"
    assert main(["cosim", "rest.cosim.toml", "--set", limit]) == 1
    assert "FAILS" in capsys.readouterr().out


def test_runs_of_the_same_clauses_share_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    Path("again.cosim.toml").write_text(SCENARIO)
    assert main(["cosim", "rest.cosim.toml", "again.cosim.toml", "--seed", "1", "--seed", "2"]) == 0
    text = capsys.readouterr().out
    assert re.findall(r"^ (rest|again) seed=(\d) .* holds", text, re.MULTILINE) == [
        ("rest", "1"), ("rest", "2"), ("again", "1"), ("again", "2")
    ]  # fmt: skip
    assert text.count("1: rms of attitude_error.total, ≤ 6 deg") == 1
    assert text.endswith("4 of 4 runs hold\n")


def test_more_clauses_than_fit_into_a_table_make_one_for_each_scenario(
    capsys: pytest.CaptureFixture[str],
) -> None:
    clause = SCENARIO[SCENARIO.index("[[expect]]") :]
    for name, bounds in (("few", range(2, 8)), ("many", range(12, 18))):
        text = SCENARIO + "".join(clause + f"from = {0.1 * bound}\n" for bound in bounds)
        Path(f"{name}.cosim.toml").write_text(text.replace("6 deg", "0.001 deg", name == "few"))
    assert main(["cosim", "few.cosim.toml", "many.cosim.toml"]) == 1
    text = capsys.readouterr().out
    for name in ("few", "many"):
        assert f"\n\n{name}\n" in text
    assert text.count("1: rms of attitude_error.total, ") == 2
    assert text.endswith("!: does not hold\n1 of 2 runs hold\n")


def test_settings_seeds_and_files_of_results(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [
        "--set",
        "components.estimator.model=mekf",
        "--set",
        "duration=5",
        "--seed",
        "3",
        "--seed",
        "4",
    ]
    assert main(["cosim", "rest.cosim.toml", *arguments, "--record", "a.csv", "--json", "a.json"]) == 0
    assert "rest estimator=mekf-duration=5-seed=4: 5 s" in capsys.readouterr().out
    runs = json.loads(Path("a.json").read_text())["runs"]
    assert [run["case"].rpartition("-")[2] for run in runs] == ["seed=3", "seed=4"]
    assert runs[0]["verdicts"][0]["measured"] < np.radians(6.0)
    assert len(Path("a.csv").read_text().splitlines()) == 501


def test_the_system_can_be_written_as_a_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cosim", "rest.cosim.toml", "--set", "duration=1", "--ssp", "rest.ssp"]) == 0
    assert "written: rest.ssp" in capsys.readouterr().out
    assert {"SystemStructure.ssd", "resources/GCF.fmu"} <= set(ZipFile("rest.ssp").namelist())


@pytest.mark.parametrize("via", ["c", "single", "numpy", "fmu2", "fmu3", "fmu3-scalar"])
def test_every_way_of_computing_gives_the_verdict(via: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cosim", "rest.cosim.toml", "--set", "duration=2", "--via", via]) == 0
    assert "holds" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.cosim.toml"], "none.cosim.toml: No such file"),
        (["rest.cosim.toml", "--set", "durations=5"], "rest.cosim.toml: .*unknown field `durations`"),
        (["rest.cosim.toml", "--set", "components.estimator.model=gfc"], "no model 'gfc'"),
        (["rest.cosim.toml", "--via", "fmu4"], "'fmu4' is not one of"),
        (["rest.cosim.toml", "--record", "a.txt"], "ends in .csv or .parquet"),
    ],
)
def test_what_cannot_be_done_is_one_line(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["cosim", *arguments]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert re.search(words, lines[0])


def test_the_overview_names_every_limit_that_a_clause_has(
    workplace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (workplace / "strict.cosim.toml").write_text(SCENARIO.replace("6 deg", "0.01 deg"))
    assert main(["cosim", "rest.cosim.toml", "strict.cosim.toml"]) == 1
    text = capsys.readouterr().out
    assert "1: rms of attitude_error.total, ≤ 6 deg or ≤ 0.01 deg" in text
    assert re.search(r"strict +\S+ ! +FAILS", text)
    assert "1 of 2 runs hold" in text

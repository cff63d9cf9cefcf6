"""Scenario files as tests, and the fixtures of the plugin that comes with the package."""

from __future__ import annotations

import pytest

from ahrs_fmu.toolchain import cache_folder

pytest_plugins = ["pytester"]

# Pytester has another home folder.
CACHE = cache_folder().parent

SCENARIO = """
template = "estimation"
duration = 10.0
seeds = [1, 2]
[components.estimator]
parameters.kp = 1.0
[[expect]]
signal = "attitude_error.total"
measure = "max"
from = 5.0
at_most = "{limit}"
"""
FIXTURES = """
def test_a_system(cosim_system):
    system = cosim_system("rest.cosim.toml", {"components.estimator.model": "mahony"}, seed=5)
    assert system.run(1.0, ["estimator.q"])["estimator.q"].shape == (100, 4)
    other = cosim_system("rest.cosim.toml")
    assert other.components["estimator"] is not system.components["estimator"]


def test_fmus(fmu):
    first, second = fmu("gcf", {"kp": 1.0}, fmi="2"), fmu("gcf")
    first.step(0.01)
    assert float(first.get("kp")) == 1.0
    assert float(second.get("kp")) == 0.5
"""


@pytest.fixture
def folder(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A folder of tests; the compiled library is still found where it is kept."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(CACHE))
    pytester.makeini("[pytest]\n")
    return pytester


def write(folder: pytest.Pytester, name: str, text: str) -> None:
    (folder.path / name).write_text(text)


def test_every_case_of_a_scenario_is_a_test(folder: pytest.Pytester) -> None:
    write(folder, "rest.cosim.toml", SCENARIO.format(limit="3 deg"))
    result = folder.runpytest("-v")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["rest.cosim.toml::seed:1 PASSED*", "rest.cosim.toml::seed:2 PASSED*"])


def test_a_failure_shows_clause_value_limit_moment_and_plot(folder: pytest.Pytester) -> None:
    write(folder, "rest.cosim.toml", SCENARIO.format(limit="0.001 deg"))
    result = folder.runpytest("-k", "seed:1", "--cosim-output", "plots")
    result.assert_outcomes(failed=1, deselected=1)
    result.stdout.fnmatch_lines(
        ["max of attitude_error.total from 5 s: * deg; expected ≤ 0.001 deg, at 5.00 s", "plot: *"]
    )
    assert (folder.path / "plots" / "rest-seed=1.png").stat().st_size > 10_000
    assert "Traceback" not in result.stdout.str()
    assert "running.py" not in result.stdout.str()


def test_a_wrong_file_is_an_error_of_one_line(folder: pytest.Pytester) -> None:
    write(folder, "rest.cosim.toml", SCENARIO.replace("duration", "duratoin"))
    result = folder.runpytest()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["rest.cosim.toml: *unknown field `duratoin`*"])
    assert "Traceback" not in result.stdout.str()


def test_what_goes_wrong_when_it_is_run_is_told_in_one_line_too(folder: pytest.Pytester) -> None:
    write(folder, "rest.cosim.toml", SCENARIO.format(limit="1 uT"))
    result = folder.runpytest("-k", "seed:1")
    result.assert_outcomes(failed=1, deselected=1)
    result.stdout.fnmatch_lines(["rest.cosim.toml: *'uT' does not measure what 'rad' measures"])
    assert "running.py" not in result.stdout.str()


def test_the_fixtures_open_systems_and_fmus(folder: pytest.Pytester) -> None:
    write(folder, "rest.cosim.toml", SCENARIO.format(limit="3 deg"))
    write(folder, "test_it.py", FIXTURES)
    folder.runpytest("test_it.py").assert_outcomes(passed=2)

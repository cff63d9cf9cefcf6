"""What docs/cosim.md shows runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.toolchain import cache_folder

pytest_plugins = ["pytester"]

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "cosim.md").read_text(encoding="utf-8")
# Pytester has another home folder; the compiled library is still found where it is kept.
CACHE = cache_folder().parent


def block(language: str, number: int = 0) -> str:
    """A block of code of the page."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)[number]


def test_the_scenario_of_the_page_holds_for_all_its_seeds(tmp_path: Path) -> None:
    (tmp_path / "gust.cosim.toml").write_text(block("toml"))
    outcomes = running.run_file(tmp_path / "gust.cosim.toml")
    assert len(outcomes) == 3
    assert all(outcome.passed for outcome in outcomes)


def test_the_tests_of_the_page_pass(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(CACHE))
    pytester.makeini("[pytest]\n")
    (pytester.path / "gust.cosim.toml").write_text(block("toml"))
    (pytester.path / "test_page.py").write_text(block("python", 0))
    pytester.runpytest("test_page.py").assert_outcomes(passed=2)


def test_every_field_of_a_scenario_is_on_the_page() -> None:
    fields = set(scenario.Scenario.__struct_fields__) - {"description", "sensor_of"}
    assert {name for name in fields if not re.search(rf"\b{name}\b", PAGE)} == set()

"""Plugin of pytest: every ``NAME.cosim.toml`` is a set of tests; fixtures open components and systems.

It comes with the package and needs no switch. What it needs beyond pytest is imported when the first scenario
or fixture is met, so that other test runs do not wait for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from ahrs_fmu.cosim.fmu import FmuStepper, Value
    from ahrs_fmu.cosim.system import System

_SUFFIX = ".cosim.toml"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--cosim-output``."""
    group = parser.getgroup("ahrs-fmu")
    group.addoption(
        "--cosim-output",
        metavar="DIR",
        default="build/cosim",
        help="folder for the plots of scenarios that fail (default: build/cosim below the root folder)",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect scenario files."""
    if not file_path.name.endswith(_SUFFIX):
        return None
    collected: pytest.Collector = _items().ScenarioCollector.from_parent(parent, path=file_path)
    return collected


@pytest.fixture
def cosim_system(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[..., System]]:
    """Make systems of scenario files: ``cosim_system("gust.cosim.toml", {"wind.turbulence": 2.0}, seed=3)``.

    The file is looked for beside the test. Without a seed it is the first one of the file.
    """
    with _items().opened(tmp_path) as make:

        def system(
            file: str | Path, changes: Mapping[str, object] = MappingProxyType({}), seed: int | None = None
        ) -> System:
            made: System = make.system(request.path.parent / file, changes, seed)
            return made

        yield system


@pytest.fixture
def fmu(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[..., FmuStepper]]:
    """Open FMUs: ``fmu("gcf", {"kp": 1.0})`` builds a model, ``fmu("my.fmu")`` is beside the test."""
    with _items().opened(tmp_path) as make:

        def stepper(
            source: str | Path, parameters: Mapping[str, Value] = MappingProxyType({}), fmi: str = "3"
        ) -> FmuStepper:
            opened: FmuStepper = make.fmu(request.path.parent, source, parameters, fmi)
            return opened

        yield stepper


def _items() -> Any:
    return import_module("ahrs_fmu.cosim.pytest_items")

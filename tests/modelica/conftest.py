"""Fixtures of the Modelica tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from modelica_libraries import ROOT, Simulation, simulated

from loop_fmus import LoopFmus


@pytest.fixture(scope="session")
def simulate() -> Callable[[str], Simulation]:
    """Simulate a model as its experiment says."""
    return simulated


@pytest.fixture(scope="session")
def plots() -> Path:
    """Where the plotted comparisons go."""
    folder = ROOT / "build" / "modelica"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def loop_fmu(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopFmus]:
    """The FMUs of the loop."""
    fmus = LoopFmus(tmp_path_factory.mktemp("loop"))
    yield fmus
    fmus.close()

"""Fixtures of the Modelica tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from modelica_libraries import ROOT, Simulation, simulated


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

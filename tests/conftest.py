"""Fixtures shared by all tests: where the recordings and the golden traces are, when they are at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def _outside(variable: str, default: Path, what: str) -> Path:
    folder = Path(os.environ.get(variable, default))
    if not folder.is_dir():
        pytest.skip(f"{what} not found: set {variable} to their folder")
    return folder


@pytest.fixture(scope="session")
def golden_dir() -> Path:
    """Independent traces of every filter."""
    return _outside("AHRS_GOLDEN", ROOT.parent / "shared" / "golden", "golden traces")


@pytest.fixture(scope="session")
def broad_dir() -> Path:
    """Recordings of the BROAD data set with optical truth."""
    return _outside("BROAD_DIR", ROOT.parent / "shared" / "data" / "broad", "BROAD recordings")

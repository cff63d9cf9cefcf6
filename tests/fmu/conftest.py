"""FMUs built once for all tests, and recordings to run through them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from host import Instance, Library, Replay
from numpy.typing import NDArray

from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.variant import Fmi
from ahrs_fmu.toolchain import compile_library, host_platform, suffix

VARIANTS: tuple[Fmi, ...] = ("2", "3", "3-scalar")


@pytest.fixture(scope="session")
def build_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("build")


@pytest.fixture(scope="session")
def fmu_file(build_folder: Path) -> Callable[..., Path]:
    """Path of a host FMU of GCF, built on the first call."""
    built: dict[tuple[str, str], Path] = {}

    def file(fmi: Fmi, precision: str = "double") -> Path:
        key = (fmi, precision)
        if key not in built:
            built[key] = build_fmu("gcf", fmi=fmi, precision=precision, output=build_folder / precision)
        return built[key]

    return file


@pytest.fixture(scope="session")
def load(fmu_file: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Library]:
    """A host FMU of GCF, loaded."""
    loaded: dict[tuple[str, str], Library] = {}

    def library(fmi: Fmi, precision: str = "double") -> Library:
        key = (fmi, precision)
        if key not in loaded:
            loaded[key] = Library(fmu_file(fmi, precision), tmp_path_factory.mktemp("fmu"))
        return loaded[key]

    return library


@pytest.fixture(params=VARIANTS)
def library(request: pytest.FixtureRequest, load: Callable[..., Library]) -> Library:
    """Each of the three FMUs in double precision."""
    return load(request.param)


@pytest.fixture(scope="session")
def rows() -> NDArray[np.float64]:
    """Nine columns of a lively made-up recording: gyro, accel, mag."""
    rng = np.random.default_rng(20240607)
    n = 3000
    t = np.arange(n) * 0.01
    gyro = np.stack([np.sin(0.7 * t), 0.8 * np.cos(0.5 * t), 0.3 * np.sin(0.2 * t)], axis=1)
    accel = np.stack([np.sin(t), 0.5 * np.cos(t), -9.8 + 0.1 * np.sin(3 * t)], axis=1)
    mag = 1e-6 * np.stack([25 + 5 * np.cos(t), 8 * np.sin(t), 40 + np.sin(2 * t)], axis=1)
    noise = rng.standard_normal((n, 9)) * np.repeat([1e-3, 1e-2, 1e-7], 3)
    return np.hstack([gyro, accel, mag]) + noise


@pytest.fixture(scope="session")
def replay_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Instance], Replay]:
    """Makes the loop that runs recordings through an instance."""
    source = Path(__file__).resolve().parents[1] / "c" / "replay.c"
    path = tmp_path_factory.mktemp("replay") / f"replay{suffix(host_platform())}"
    loop = ctypes.CDLL(str(compile_library([source], path, hide_symbols=False)))
    return lambda instance: Replay(loop, instance)

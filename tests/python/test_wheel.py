"""The wheel is complete, and works in an environment that knows nothing of the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

from ahrs_fmu.toolchain import cache_folder

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = "Scripts" if sys.platform == "win32" else "bin"

SESSION = """
from pathlib import Path
import ahrs_fmu
from ahrs_fmu import records
from ahrs_fmu.cli import main
from ahrs_fmu.demo_flight import demo_flight

print(ahrs_fmu.__file__)
records.write(demo_flight(duration=8.0), Path("flight.csv"))
for command in ("replay flight.csv", "replay flight.csv --via fmu3", "validate build/fmi3/GCF.fmu"):
    print("---")
    assert main(command.split()) == 0
"""

pytest.importorskip("hatchling", reason="hatchling, which builds the wheel, is not installed")


def output_of(*command: str | Path, folder: Path, **environment: str) -> str:
    """What a command prints, which must work."""
    known = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "BROAD_DIR")}
    done = subprocess.run(
        command, cwd=folder, env=known | environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet")
    output_of(*pip, "--no-deps", "--no-index", "--no-build-isolation", "-w", folder, ROOT, folder=folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def fresh(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with the wheel; its dependencies are those of the tests: no network is needed."""
    folder = tmp_path_factory.mktemp("fresh") / "venv"
    venv.create(folder)
    (site_packages,) = folder.rglob("site-packages")
    (site_packages / "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    pip = (
        sys.executable,
        "-m",
        "pip",
        "--disable-pip-version-check",
        "--python",
        folder,
        "install",
        "--quiet",
    )
    output_of(*pip, "--no-deps", "--no-index", wheel, folder=folder)
    return folder


def test_the_wheel_holds_sources_libraries_and_licence_and_nothing_else(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == {"ahrs_fmu", next(top for top in tops if top.endswith(".dist-info"))}
    assert {"ahrs_fmu/py.typed", "ahrs_fmu/fmu_src/models/gcf/gcf.toml"} <= set(names)
    assert sum(name.startswith("ahrs_fmu/lib/libahrs_") for name in names) == 2
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert "none-any" not in wheel.name


def test_the_wheel_replays_a_recording_and_builds_an_fmu_outside_the_checkout(
    fresh: Path, tmp_path: Path
) -> None:
    zig = str(cache_folder() / "zig")
    caches = {
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
        "ZIG_GLOBAL_CACHE_DIR": zig,
        "ZIG_LOCAL_CACHE_DIR": zig,
    }
    text = output_of(fresh / PROGRAMS / "python", "-c", SESSION, folder=tmp_path, **caches)
    place, core, through, validated = text.split("---\n")
    assert Path(place.strip()).is_relative_to(fresh)
    assert "RMS error" in core
    assert through.splitlines()[1:] == core.splitlines()[1:]
    assert "no problem" in validated
    assert not list((tmp_path / "cache").rglob("libahrs_*")), "the library in the wheel was not used"
    assert list((fresh / PROGRAMS).glob("ahrs-fmu*"))

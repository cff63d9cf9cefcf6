"""The C models compiled for this machine: shipped with an installed package, compiled from a checkout."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ahrs_fmu.sources import fmu_src
from ahrs_fmu.toolchain import cache_folder, compile_library, fingerprint, host_platform, suffix

Precision = Literal["double", "single"]

INCLUDE_FOLDERS = ("core", "include", "estimator", "fmi", "native")
"""Folders of ``fmu_src`` that hold headers."""


def library_name(precision: Precision) -> str:
    """File name of the host library."""
    return f"libahrs_{precision}{suffix(host_platform())}"


def library_sources() -> list[Path]:
    """C files of the host library: every model with its table, and what runs them."""
    root = fmu_src()
    return [*sorted(root.glob("models/*/*.c")), *sorted(root.glob("native/*.c"))]


def library_file(precision: Precision) -> Path:
    """Find the host library: the installed one, or one that fits the sources, compiled when missing.

    Raises
    ------
    BuildError
        If it has to be compiled and that fails.
    """
    installed = Path(__file__).resolve().parent / "lib" / library_name(precision)
    if installed.is_file():
        return installed
    library = cache_folder() / "lib" / library_fingerprint(precision) / library_name(precision)
    return library if library.is_file() else compile_host_library(precision, library)


def library_fingerprint(precision: Precision) -> str:
    """Short hash of everything that the host library is made of."""
    root = fmu_src()
    headers = [header for folder in INCLUDE_FOLDERS for header in root.glob(f"{folder}/*.h")]
    return fingerprint([*library_sources(), *headers], precision)


def compile_host_library(precision: Precision, output: Path) -> Path:
    """Compile the host library in one precision to `output`."""
    return compile_library(
        library_sources(),
        output,
        include=[fmu_src() / folder for folder in INCLUDE_FOLDERS],
        define=["AHRS_SINGLE"] if precision == "single" else [],
        hide_symbols=False,
    )

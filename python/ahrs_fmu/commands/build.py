"""``ahrs-fmu build``."""

from __future__ import annotations

import sys
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from ahrs_fmu import descriptors
from ahrs_fmu.commands import terminal
from ahrs_fmu.estimators.model import FILTERS
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.variant import Backend, Fmi
from ahrs_fmu.host_library import Precision
from ahrs_fmu.toolchain import TARGETS, host_platform

EXAMPLES = """
Examples:
  ahrs-fmu build                          every model, FMI 2 and 3, this machine
  ahrs-fmu build gcf --platforms all      one model for Windows, Linux and macOS
  ahrs-fmu build gcf --fmi 3-scalar       for importers that know no arrays
  ahrs-fmu build gcf --backend python     the numpy class, run by Python
"""


class FmiVersion(Enum):
    """`Fmi` as the command line takes it; a list of options cannot be of a literal type."""

    TWO = "2"
    THREE = "3"
    THREE_SCALAR = "3-scalar"


def build(
    models: Annotated[
        list[str] | None, typer.Argument(metavar="MODEL", help="Models to build; default: all of them.")
    ] = None,
    fmi: Annotated[
        list[FmiVersion] | None,
        typer.Option(metavar="2|3|3-scalar", help="FMI version; may be repeated; default: 2 and 3."),
    ] = None,
    platforms: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help=f"{', '.join(TARGETS)}, all or host; may be repeated; default: host."
        ),
    ] = None,
    precision: Annotated[Precision, typer.Option(help="Floating-point type inside the FMU.")] = "double",
    backend: Annotated[
        Backend, typer.Option(help="Compiled code, or the numpy class in a Python process.")
    ] = "c",
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the FMUs.")] = Path("build"),
) -> None:
    """Build FMUs of the models.

    They become build/fmi2/TITLE.fmu, build/fmi3/TITLE.fmu and build/fmi3-scalar/TITLE.fmu; with the Python
    back-end build/python/fmi2/TITLE.fmu and so on.
    """
    names = models or (sorted(FILTERS) if backend == "python" else descriptors.names())
    for name in names:
        descriptors.load(name)  # A misspelt name is told before anything is built.
    versions: list[Fmi] = [version.value for version in fmi or (FmiVersion.TWO, FmiVersion.THREE)]
    jobs = [(name, version) for name in names for version in versions]
    targets = targets_of(platforms or ["host"])
    shown = terminal.table(["FMU", "FMI", "platforms"], ["kB"])
    with terminal.progress() as progress:
        task = progress.add_task("building", total=len(jobs))
        for name, version in jobs:
            progress.update(task, description=f"{name}, FMI {version}")
            path = build_fmu(
                name, fmi=version, platforms=targets, precision=precision, backend=backend, output=output
            )
            size = path.stat().st_size / 1000.0
            shown.add_row(str(path), version, ", ".join(targets), f"{size:.0f}")
            progress.advance(task)
    terminal.OUT.print(shown)
    if backend == "python":
        terminal.OUT.print(f"they need Python with ahrs-fmu: {sys.executable}, or what AHRS_FMU_PYTHON names")


def targets_of(names: list[str]) -> list[str]:
    """Platforms that names, ``host`` and ``all`` mean."""
    expanded = {"all": list(TARGETS), "host": [host_platform()]}
    return list(dict.fromkeys(target for name in names for target in expanded.get(name, [name])))

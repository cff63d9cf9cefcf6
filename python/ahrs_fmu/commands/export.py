"""``ahrs-fmu export``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from ahrs_fmu.commands import terminal
from ahrs_fmu.commands.build import targets_of
from ahrs_fmu.export.package import export_component
from ahrs_fmu.export.variant import Fmi
from ahrs_fmu.toolchain import TARGETS

EXAMPLES = """
Examples:
  ahrs-fmu export my_filter.py:MyFilter                     MyFilter.fmu, FMI 3
  ahrs-fmu export my_filter.py:MyFilter --fmi 2 -o mine.fmu

docs/python-fmu.md shows how such a class is written.
"""


def export(
    source: Annotated[str, typer.Argument(metavar="FILE:CLASS", help="Python file and the class in it.")],
    fmi: Annotated[Fmi, typer.Option(help="FMI version.")] = "3",
    platforms: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help=f"{', '.join(TARGETS)}, all or host; may be repeated; default: host."
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The FMU; default: CLASS.fmu here.")
    ] = None,
) -> None:
    """Make an FMU of a Python class.

    It runs in a Python process beside the importer.
    """
    file, _, name = source.rpartition(":")
    if not file or not name.isidentifier():
        raise typer.BadParameter(f"'{source}' is not of the form FILE:CLASS, such as my_filter.py:MyFilter")
    path = output or Path(f"{name}.fmu")
    if path.suffix != ".fmu":
        raise typer.BadParameter(f"'{path}': the name of an FMU ends with .fmu", param_hint="--output")
    export_component(Path(file), name, fmi=fmi, platforms=targets_of(platforms or ["host"]), output=path)
    terminal.OUT.print(f"{path}: {path.stat().st_size / 1000.0:.0f} kB, FMI {fmi}")
    terminal.OUT.print(f"it needs Python with ahrs-fmu: {sys.executable}, or what AHRS_FMU_PYTHON names")

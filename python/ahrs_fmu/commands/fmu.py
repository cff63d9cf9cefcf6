"""``ahrs-fmu info`` and ``ahrs-fmu validate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ahrs_fmu.commands import terminal
from ahrs_fmu.export.info import FmuInfo, read_info
from ahrs_fmu.export.validate import validate_fmu

INFO_EXAMPLES = """
Examples:
  ahrs-fmu info build/fmi3/GCF.fmu
"""
VALIDATE_EXAMPLES = """
Examples:
  ahrs-fmu validate build/fmi2/GCF.fmu build/fmi3/GCF.fmu

The exit code is 1 when an FMU has a problem.
"""


def info(fmu: Annotated[Path, typer.Argument(metavar="FMU", help="The .fmu file.")]) -> None:
    """Show what an FMU is, and its variables."""
    held = read_info(fmu)
    out = terminal.OUT
    terminal.prose(f"{held.model}: {held.description}")
    out.print(f"FMI {held.fmi_version} co-simulation, {held.size / 1000.0:.0f} kB, made by {held.tool}")
    out.print(f"platforms: {', '.join(held.platforms) or 'none'}")
    out.print(f"capabilities: {', '.join(held.capabilities) or 'none'}")
    for causality in ("input", "output", "parameter"):
        _print_variables(held, causality)


def validate(fmus: Annotated[list[Path], typer.Argument(metavar="FMU", help="The .fmu files.")]) -> None:
    """Check FMUs as strict importers do."""
    failed = False
    for path in fmus:
        problems = validate_fmu(path)
        failed = failed or bool(problems)
        count = {0: "no problem", 1: "1 problem"}.get(len(problems), f"{len(problems)} problems")
        terminal.OUT.print(f"{path}: {count}")
        for problem in problems:
            terminal.OUT.print(f"  {problem}")
    if failed:
        raise typer.Exit(1)


def _print_variables(held: FmuInfo, causality: str) -> None:
    variables = [v for v in held.variables if v.causality == causality]
    if variables:
        terminal.OUT.print(f"\n{causality}s")
    for v in variables:
        value = " ".join(part for part in (v.start, v.unit) if part)
        facts = [value, v.limits, v.variability if causality == "parameter" else ""]
        told = ", ".join(fact for fact in facts if fact)
        terminal.prose(f"{v.name}: {told}" if told else v.name, indent=2, hanging=2)
        terminal.prose(v.description, indent=6)

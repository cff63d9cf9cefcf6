"""Numbers with units on the terminal and in JSON files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path

import typer

from ahrs_fmu.analysis.quantity import Row
from ahrs_fmu.commands import terminal


def print_rows(rows: Iterable[Row], title: str) -> None:
    """Print numbers with their unit and meaning; angles in degrees, frequencies in rad/s."""
    shown = terminal.table([title], ["value"])
    shown.add_column("unit")
    shown.add_column("meaning")
    for row in rows:
        if not math.isnan(row.value):
            value, unit = displayed(row.value, "" if row.unit == "1" else row.unit)
            shown.add_row(
                row.name.replace("_", " "), f"{value:.4g}", "" if unit == "1" else unit, row.meaning
            )
    terminal.OUT.print(shown, soft_wrap=False)


def displayed(value: float, unit: str) -> tuple[float, str]:
    """Turn an angle or its density into degrees, a field into microtesla; rad/s is a frequency and stays."""
    if unit.startswith("rad") and unit != "rad/s":
        return math.degrees(value), unit.replace("rad", "deg", 1)
    if unit.startswith("T"):
        return 1e6 * value, f"u{unit}"
    return value, unit


def number(name: str, text: object) -> float:
    """Read a number.

    Raises
    ------
    typer.BadParameter
        It is none.
    """
    try:
        return float(str(text))
    except ValueError:
        raise typer.BadParameter(f"{name} = {text}: it is not a number") from None


def positive(name: str, value: float, unit: str) -> float:
    """Return a value above zero.

    Raises
    ------
    typer.BadParameter
        It is not.
    """
    if not value > 0.0 or math.isinf(value):
        raise typer.BadParameter(f"{name} = {value:g} {unit}: it must be positive")
    return value


def not_negative(name: str, value: float, unit: str) -> float:
    """Return a value that is zero or above.

    Raises
    ------
    typer.BadParameter
        It is not.
    """
    if not value >= 0.0 or math.isinf(value):
        raise typer.BadParameter(f"{name} = {value:g} {unit}: it must be zero or positive")
    return value


def write_json(data: Mapping[str, object], path: Path | None) -> None:
    """Write a result as JSON, if there is a file to write it to."""
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
        terminal.OUT.print(f"written: {path}")

"""Results that know the unit and the meaning of each of their numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any

from ahrs_fmu.errors import DesignError


@dataclass(frozen=True, slots=True)
class Row:
    """One number of a result, ready for a table."""

    name: str
    value: float
    unit: str
    meaning: str


def quantity(unit: str, meaning: str) -> Any:
    """Declare a dataclass field that is a float in `unit` and means `meaning`."""
    return field(metadata={"unit": unit, "meaning": meaning})


def rows(result: Any) -> tuple[Row, ...]:
    """List the numbers of a result dataclass in the order of its declaration."""
    return tuple(
        Row(f.name, float(getattr(result, f.name)), f.metadata["unit"], f.metadata["meaning"])
        for f in fields(result)
        if "unit" in f.metadata
    )


def as_json(result: Any) -> dict[str, dict[str, float | str | None]]:
    """Turn a result into plain data: name -> value and unit; a value without limit becomes null."""
    return {
        row.name: {"value": row.value if math.isfinite(row.value) else None, "unit": row.unit}
        for row in rows(result)
    }


def require_positive(name: str, value: float, unit: str, zero_allowed: bool = False) -> float:
    """Return `value`, or say which quantity has to be positive.

    Raises
    ------
    DesignError
        The value is negative, not finite, or zero where zero makes no sense.
    """
    if not math.isfinite(value) or value < 0.0 or (value == 0.0 and not zero_allowed):
        limit = "zero or positive" if zero_allowed else "positive"
        shown = "" if unit == "1" else f" {unit}"
        raise DesignError(f"{name} = {value:g}{shown}: give a {limit}, finite value")
    return value

"""Units as importers want them: powers of the SI base units and the factor to a display unit."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ahrs_fmu.errors import UnitError

_SYMBOLS: dict[str, tuple[float, dict[str, int]]] = {
    "1": (1.0, {}),
    "rad": (1.0, {"rad": 1}),
    "deg": (math.pi / 180.0, {"rad": 1}),
    "s": (1.0, {"s": 1}),
    "ms": (1e-3, {"s": 1}),
    "m": (1.0, {"m": 1}),
    "kg": (1.0, {"kg": 1}),
    "A": (1.0, {"A": 1}),
    "K": (1.0, {"K": 1}),
    "Hz": (1.0, {"s": -1}),
    "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "V": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "W": (1.0, {"kg": 1, "m": 2, "s": -3}),
    "T": (1.0, {"kg": 1, "s": -2, "A": -1}),
    "uT": (1e-6, {"kg": 1, "s": -2, "A": -1}),
}
_FACTOR = re.compile(r"([A-Za-z]+|1)(-?\d+(?:\.\d+)?)?")
_PRODUCT = re.compile(r"\.(?=[A-Za-z])")


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit as a multiple of a product of SI base units.

    Attributes
    ----------
    scale : float
        How many of the product one unit is.
    powers : dict of str to int
        Exponents of kg, m, s, A, K, rad.
    """

    scale: float
    powers: dict[str, float]

    @property
    def has_whole_powers(self) -> bool:
        """Whether FMI can say what the unit is made of: not for a noise density such as ``rad/s0.5``."""
        return all(float(power).is_integer() for power in self.powers.values())


def parse(text: str) -> Unit:
    """Read a unit such as ``rad2/s2`` or ``N.m``: what follows a slash divides.

    Raises
    ------
    UnitError
        If a symbol is unknown.
    """
    scale, powers = 1.0, dict[str, float]()
    for position, part in enumerate(text.split("/")):
        sign = -1 if position else 1
        for factor in _PRODUCT.split(part):
            match = _FACTOR.fullmatch(factor)
            if match is None or match[1] not in _SYMBOLS:
                raise UnitError(f"unit '{text}' has the unknown symbol '{factor}': use {', '.join(_SYMBOLS)}")
            exponent = sign * float(match[2] or 1)
            symbol_scale, symbol_powers = _SYMBOLS[match[1]]
            scale *= symbol_scale**exponent
            for name, power in symbol_powers.items():
                powers[name] = powers.get(name, 0) + power * exponent
    return Unit(scale, {name: power for name, power in powers.items() if power})


def factor(unit: str, target: str) -> float:
    """By what a value in `unit` is multiplied to be in `target`; an empty unit is a pure number.

    Raises
    ------
    UnitError
        If the two measure different things.
    """
    from_unit, to_unit = parse(unit or "1"), parse(target or "1")
    if from_unit.powers != to_unit.powers:
        raise UnitError(f"'{unit or '1'}' does not measure what '{target or '1'}' measures")
    return from_unit.scale / to_unit.scale


def quantity(value: float | str, unit: str) -> float:
    """Read a number given in `unit`, or a text with its own unit such as ``"0.5 deg/s"``, as one in `unit`.

    Raises
    ------
    UnitError
        If the text is no number with a unit, or its unit measures something else.
    """
    if not isinstance(value, str):
        return float(value)
    number, _, own = value.strip().partition(" ")
    try:
        return float(number) * factor(own.strip(), unit)
    except ValueError as error:
        if isinstance(error, UnitError):
            raise UnitError(f"'{value}': {error}") from None
        raise UnitError(f"'{value}' is not a number and a unit, such as '0.5 deg/s'") from None

"""What an SSP package says, in the scalars of the standard: one connector for each element of an array."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ahrs_fmu.cosim.fmu import ELEMENT
from ahrs_fmu.cosim.system import Method

STRUCTURE_FILE = "SystemStructure.ssd"
FMU_TYPE = "application/x-fmu-sharedlibrary"
PARAMETER_TYPE = "application/x-ssp-parameter-set"
ANNOTATION_TYPE = "ahrs-fmu"

Type = Literal["Real", "Integer", "Boolean", "Enumeration"]
Scalar = bool | int | float | str


@dataclass(frozen=True, slots=True)
class Connector:
    """One scalar of the interface of a component or of the system."""

    name: str
    kind: str
    """``input`` or ``output``; a package from elsewhere may have others."""
    type: str = ""
    """A `Type`; empty where the package leaves it to the FMU."""
    unit: str = ""
    enumeration: str = ""


@dataclass(frozen=True, slots=True)
class End:
    """A connector of a component, or of the system itself, whose name is empty."""

    element: str
    connector: str

    def __str__(self) -> str:
        return f"{self.element}.{self.connector}" if self.element else self.connector


@dataclass(frozen=True, slots=True)
class Link:
    """A connection between two scalars."""

    start: End
    end: End
    converts_units: bool = True

    def __str__(self) -> str:
        return f"{self.start} -> {self.end}"


@dataclass(frozen=True, slots=True)
class Value:
    """Value of a parameter, or what an input starts with; an enumeration by the name of its item."""

    type: str
    value: Scalar
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Component:
    """An FMU of the system."""

    name: str
    source: str
    """Path of the FMU in the package."""
    connectors: Sequence[Connector]
    values: Mapping[str, Value] = field(default_factory=dict)
    """Of parameters and inputs, by the names of their scalars."""


@dataclass(frozen=True, slots=True)
class Stepping:
    """What SSP has no place for: communication step in seconds, and who sees whose values when."""

    step: float
    method: Method


@dataclass(frozen=True, slots=True)
class Structure:
    """Content of a package; with a `Stepping`, the components stand in the order in which they step."""

    name: str
    components: Sequence[Component]
    links: Sequence[Link]
    connectors: Sequence[Connector] = ()
    values: Mapping[str, Value] = field(default_factory=dict)
    """Of the system's own connectors, by name."""
    enumerations: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    units: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Exponents of the base units, ``factor`` and ``offset``, as in FMI."""
    stop_time: float | None = None
    stepping: Stepping | None = None


def scalars(name: str, shape: Sequence[int]) -> list[str]:
    """Names of a variable's elements in the order of its memory: ``q[1]`` ... ``q[4]``, or just its own."""
    if not shape:
        return [name]
    return [f"{name}[{','.join(str(i + 1) for i in index)}]" for index in np.ndindex(*shape)]


def whole(name: str) -> str:
    """Name of the variable that a scalar is an element of."""
    element = ELEMENT.fullmatch(name)
    return element["name"] if element else name

"""Steppers as contexts, which other processes can open as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from ahrs_fmu import descriptors
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.fmu import Fmu, FmuStepper, Value


@contextmanager
def core(model: str, parameters: Mapping[str, object]) -> Iterator[CoreStepper]:
    """Open the C core of a model with parameters that differ from their defaults."""
    yield CoreStepper(descriptors.load(model), parameters)


@contextmanager
def fmu(path: str | Path, parameters: Mapping[str, Value]) -> Iterator[FmuStepper]:
    """Open an FMU with parameters that differ from their defaults, and close it at the end."""
    with Fmu(path) as opened:
        yield opened.instantiate(parameters)

"""Signals computed from recorded ones, such as the error of an estimate."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ahrs_fmu import units
from ahrs_fmu.cosim.recording import Recording
from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.errors import ScenarioError, UnitError
from ahrs_fmu.metrics import attitude_error
from ahrs_fmu.trajectories import Data

_ELEMENT = re.compile(r"(?P<name>.+)\[(?P<index>\d+)\]")


class AttitudeDifference(Data, frozen=True, tag="attitude-error", tag_field="kind"):
    """Rotation from one attitude to another: `total`, `heading`, `inclination`, `roll`, `pitch`, `yaw`, rad.

    Attributes
    ----------
    estimate, truth : str
        Recorded quaternions, ``component.variable``.
    """

    estimate: str
    truth: str

    @property
    def sources(self) -> tuple[str, ...]:
        """Signals that it is computed from."""
        return self.estimate, self.truth

    def values(self, recording: Recording) -> Mapping[str, tuple[Array, str]]:
        """Columns (N,) and their unit, by part."""
        error = attitude_error(recording[self.estimate], recording[self.truth])
        parts = {"total": error.total, "heading": error.heading, "inclination": error.inclination}
        parts |= {name: error.euler[:, axis] for axis, name in enumerate(("roll", "pitch", "yaw"))}
        return {name: (column, "rad") for name, column in parts.items()}


class Difference(Data, frozen=True, tag="difference", tag_field="kind"):
    """One recorded signal minus another of the same shape, in the unit of the first."""

    of: str
    minus: str

    @property
    def sources(self) -> tuple[str, ...]:
        """Signals that it is computed from."""
        return self.of, self.minus

    def values(self, recording: Recording) -> Mapping[str, tuple[Array, str]]:
        """Column (N, ...) and its unit, under the empty name.

        Raises
        ------
        ScenarioError
            If the two do not fit together.
        """
        first, second = recording[self.of], recording[self.minus]
        unit = recording.units[self.of]
        try:
            factor = units.factor(recording.units[self.minus], unit)
        except UnitError as error:
            raise ScenarioError(f"{self.of} minus {self.minus}: {error}") from None
        if first.shape != second.shape:
            raise ScenarioError(f"{self.of} has shape {first.shape[1:]}, {self.minus} {second.shape[1:]}")
        return {"": (first - factor * second, unit)}


Derived = AttitudeDifference | Difference


def with_derived(recording: Recording, derived: Mapping[str, Derived]) -> Recording:
    """Add computed signals: ``name.part``, or ``name`` where there is one part only.

    Raises
    ------
    ScenarioError
        If a source was not recorded or does not fit.
    """
    signals, given = dict(recording.signals), dict(recording.units)
    for name, what in derived.items():
        for part, (column, unit) in what.values(recording).items():
            key = f"{name}.{part}" if part else name
            signals[key], given[key] = column, unit
    return Recording(recording.time, signals, given, recording.wall_time)


def magnitude(recording: Recording, signal: str) -> Array:
    """Size (N,) of a signal: the element that is named, ``gyro[3]``, or the norm; a scalar keeps its sign.

    Raises
    ------
    ScenarioError
        If it was not recorded or has no such element.
    """
    element = _ELEMENT.fullmatch(signal)
    values = recording[element["name"] if element else signal]
    if element:
        index = int(element["index"])
        if values.ndim != 2 or not 1 <= index <= values.shape[1]:
            raise ScenarioError(f"signal '{signal}': there is no such element; the first is [1]")
        return values[:, index - 1]
    if values.ndim == 1:
        return values
    norm: Array = np.linalg.norm(values.reshape(len(values), -1), axis=1)
    return norm


def source_of(signal: str) -> str:
    """Name of a signal without the index of an element."""
    element = _ELEMENT.fullmatch(signal)
    return element["name"] if element else signal

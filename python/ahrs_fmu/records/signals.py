"""The signals of a recording as files hold them: arrays with units, before they become a Record."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu.errors import RecordError
from ahrs_fmu.records.record import FloatArray, Record

STANDARD_GRAVITY = 9.80665
"""Length of one g in m/s2."""

_XYZ = ("x", "y", "z")
_WXYZ = ("w", "x", "y", "z")
_HEADER = re.compile(r"\s*(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*")


@dataclass(frozen=True, slots=True)
class Kind:
    """What a signal of a given name is.

    Attributes
    ----------
    components : tuple of str
        Suffixes of its columns; empty for a scalar.
    units : mapping of str to float
        Accepted units and what one of them is in SI; the first is the SI unit. Empty: no unit.
    required : bool
        Whether a recording without it is refused.
    """

    components: tuple[str, ...] = ()
    units: Mapping[str, float] = field(default_factory=dict)
    required: bool = False

    @property
    def si_unit(self) -> str | None:
        """Name of the SI unit; None for a signal without unit."""
        return next(iter(self.units), None)


KINDS: Mapping[str, Kind] = {
    "time": Kind((), {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}, required=True),
    "gyro": Kind(_XYZ, {"rad/s": 1.0, "deg/s": np.pi / 180.0, "mdeg/s": np.pi / 180e3}, required=True),
    "accel": Kind(
        _XYZ,
        {"m/s2": 1.0, "m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY * 1e-3},
        required=True,
    ),
    "mag": Kind(
        _XYZ, {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "µT": 1e-6, "nT": 1e-9, "G": 1e-4, "gauss": 1e-4, "mG": 1e-7}
    ),
    "accel_valid": Kind(),
    "mag_valid": Kind(),
    "q_true": Kind(_WXYZ),
    "evaluate": Kind(),
}
"""Every signal a file can hold, in the order in which it is written."""

FLAGS = frozenset({"accel_valid", "mag_valid", "evaluate"})
"""Signals whose values are 0 or 1."""


@dataclass(frozen=True, slots=True)
class Signal:
    """Values (N,) or (N, components) and the unit the file declares, None when it is silent."""

    values: NDArray[np.generic]
    unit: str | None = None


@dataclass(frozen=True, slots=True)
class RawRecording:
    """What one file holds: known signals, the declared frame and the name of the recording."""

    signals: Mapping[str, Signal]
    frame: str | None = None
    name: str | None = None


def column_names(signal: str) -> list[str]:
    """Names of the columns of a signal, such as gyro_x, gyro_y, gyro_z."""
    components = KINDS[signal].components
    return [f"{signal}_{c}" for c in components] if components else [signal]


def to_columns(record: Record) -> dict[str, NDArray[np.generic]]:
    """Split a record into columns whose headers name the unit, such as ``gyro_x [rad/s]``."""
    columns: dict[str, NDArray[np.generic]] = {}
    for name, signal in to_signals(record).items():
        names = column_names(name)
        unit = f" [{signal.unit}]" if signal.unit else ""
        parts = signal.values.reshape(len(record), len(names)).T
        columns |= {f"{column}{unit}": part for column, part in zip(names, parts, strict=True)}
    return columns


def to_signals(record: Record) -> dict[str, Signal]:
    """Signals of a record in SI; what the record does not have is left out."""
    present = {
        "mag": record.has_mag,
        "q_true": record.q_true is not None,
        "evaluate": record.evaluate is not None,
        "accel_valid": not record.accel_valid.all(),
        "mag_valid": not record.mag_valid.all(),
    }
    return {
        name: Signal(getattr(record, name), kind.si_unit)
        for name, kind in KINDS.items()
        if present.get(name, True)
    }


def split_header(header: str) -> tuple[str, str | None]:
    """Name and unit of a header such as ``gyro_x [rad/s]``."""
    match = _HEADER.fullmatch(header)
    if match is None:
        return header.strip(), None
    unit = match["unit"]
    return match["name"], unit.strip() if unit is not None else None


def from_columns(columns: Mapping[str, NDArray[np.generic]]) -> dict[str, Signal]:
    """Join columns (N,) with headers such as ``gyro_x [rad/s]`` into signals; others are left out.

    Raises
    ------
    RecordError
        A column appears twice, a signal lacks one of its columns, or they differ in unit.
    """
    found: dict[str, tuple[NDArray[np.generic], str | None]] = {}
    for header, values in columns.items():
        name, unit = split_header(header)
        if name in found:
            raise RecordError(f"column {name} appears twice")
        found[name] = values, unit
    signals = {}
    for signal, kind in KINDS.items():
        names = column_names(signal)
        missing = [n for n in names if n not in found]
        if len(missing) == len(names) and not kind.required:
            continue
        if missing:
            raise RecordError(f"column {_listed(missing)} is missing; found {_listed(found)}")
        units = {found[n][1] for n in names}
        if len(units) > 1:
            raise RecordError(f"the columns of {signal} declare different units: {_listed(map(str, units))}")
        values = np.stack([found[n][0] for n in names], axis=-1)
        signals[signal] = Signal(values if kind.components else values[:, 0], units.pop())
    return signals


def in_si(name: str, signal: Signal, declared: str | None) -> FloatArray:
    """Values of a signal in SI; `declared`, the word of the caller, stands above the file's unit.

    Raises
    ------
    RecordError
        Values that are not numbers, a flag that is not 0 or 1, or a unit that the signal cannot have.
    """
    kind = KINDS[name]
    if signal.values.dtype.kind not in "biuf":
        raise RecordError(f"{name} holds values of type {signal.values.dtype}; it must hold numbers")
    values = np.asarray(signal.values, dtype=np.float64)
    if name in FLAGS and not np.isin(values, (0.0, 1.0)).all():
        wrong = values[~np.isin(values, (0.0, 1.0))][0]
        raise RecordError(f"{name} holds {wrong:g}; it must be 0 or 1")
    unit = declared or signal.unit
    if unit is None or not (kind.units or unit):
        return values
    if unit not in kind.units:
        raise RecordError(f"{name} cannot have the unit {unit!r}; known are {_listed(kind.units) or 'none'}")
    return values * kind.units[unit]


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)

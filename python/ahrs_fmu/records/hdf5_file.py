"""Recordings as HDF5: one dataset per signal with a `units` attribute (docs/records.md)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ahrs_fmu import extras
from ahrs_fmu.errors import RecordError
from ahrs_fmu.records.record import Record
from ahrs_fmu.records.signals import KINDS, RawRecording, Signal, to_signals


def read(path: Path) -> RawRecording:
    """Read the signals of an HDF5 file.

    Raises
    ------
    RecordError
        It is damaged or not HDF5.
    MissingExtraError
        h5py is not installed.
    """
    h5py = extras.require("h5py", "records", "reading HDF5")
    try:
        with h5py.File(path, "r") as file:
            signals = {
                name: Signal(np.asarray(file[name]), _text(file[name].attrs.get("units")))
                for name in KINDS
                if isinstance(file.get(name), h5py.Dataset)
            }
            return RawRecording(signals, _text(file.attrs.get("frame")), _text(file.attrs.get("name")))
    except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise RecordError(f"is not a readable HDF5 file: {error}") from None


def write(record: Record, path: Path) -> None:
    """Write a record as HDF5.

    Raises
    ------
    MissingExtraError
        h5py is not installed.
    """
    h5py = extras.require("h5py", "records", "writing HDF5")
    with h5py.File(path, "w") as file:
        file.attrs["frame"] = record.frame.value
        file.attrs["name"] = record.name
        for name, signal in to_signals(record).items():
            dataset = file.create_dataset(name, data=signal.values)
            if signal.unit:
                dataset.attrs["units"] = signal.unit


def _text(value: object) -> str | None:
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return None if value is None else str(value)

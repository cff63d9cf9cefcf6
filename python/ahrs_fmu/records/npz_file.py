"""Recordings as NPZ: one array per signal (docs/records.md)."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu.errors import RecordError
from ahrs_fmu.records.record import Record
from ahrs_fmu.records.signals import KINDS, RawRecording, Signal, to_signals


def read(path: Path) -> RawRecording:
    """Read the signals of an NPZ file.

    Raises
    ------
    RecordError
        It is damaged, or an array in it holds Python objects.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            held = {name: file[name] for name in file.files}
    except (
        OSError,
        ValueError,
        EOFError,
        KeyError,
        NotImplementedError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise RecordError(f"is not a readable NPZ file: {error}") from None
    signals = {name: Signal(held[name], _text(held, f"{name}_unit")) for name in KINDS if name in held}
    return RawRecording(signals, _text(held, "frame"), _text(held, "name"))


def write(record: Record, path: Path) -> None:
    """Write a record as compressed NPZ."""
    arrays: dict[str, NDArray[np.generic]] = {
        "frame": np.array(record.frame.value),
        "name": np.array(record.name),
    }
    for name, signal in to_signals(record).items():
        arrays[name] = signal.values
        if signal.unit:
            arrays[f"{name}_unit"] = np.array(signal.unit)
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _text(held: dict[str, NDArray[np.generic]], name: str) -> str | None:
    return str(held[name]) if name in held and held[name].ndim == 0 else None

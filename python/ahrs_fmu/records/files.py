"""Read and write recordings; the file name's extension chooses the format."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ahrs_fmu.errors import MissingExtraError, RecordError
from ahrs_fmu.frames import Frame
from ahrs_fmu.records import csv_file, hdf5_file, mat_file, npz_file, parquet_file, plausibility
from ahrs_fmu.records.record import Record
from ahrs_fmu.records.signals import KINDS, RawRecording, in_si

_NORM_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class _Format:
    read: Callable[[Path], RawRecording]
    write: Callable[[Record, Path], None]


_FORMATS: Mapping[str, _Format] = {
    ".csv": _Format(csv_file.read, csv_file.write),
    ".mat": _Format(mat_file.read, mat_file.write),
    ".h5": _Format(hdf5_file.read, hdf5_file.write),
    ".hdf5": _Format(hdf5_file.read, hdf5_file.write),
    ".parquet": _Format(parquet_file.read, parquet_file.write),
    ".npz": _Format(npz_file.read, npz_file.write),
}

EXTENSIONS: tuple[str, ...] = tuple(_FORMATS)
"""Extensions that `read` and `write` know."""


def read(
    path: str | Path, *, frame: Frame | str | None = None, units: Mapping[str, str] | None = None
) -> Record:
    """Read a recording.

    Parameters
    ----------
    path : str or Path
        A file with one of `EXTENSIONS`.
    frame : Frame or str, optional
        "ned" or "enu". None: what the file declares, else what gravity shows.
    units : mapping of str to str, optional
        Units by signal (time, gyro, accel, mag), such as ``{"accel": "g"}``. They stand above what the
        file declares, and a signal named here is not judged for plausibility.

    Returns
    -------
    Record
        In SI, in the frame of the file.

    Raises
    ------
    RecordError
        The extension is unknown, or the content cannot be used: missing columns, an implausible unit,
        time that does not increase, cells that are not numbers, too few samples.
    MissingExtraError
        The format needs a package that is not installed.
    OSError
        The file cannot be opened.
    """
    path = Path(path)
    read_raw = _format(path).read
    # Opening first lets a missing file be the operating system's error in every format.
    path.open("rb").close()
    try:
        return _to_record(read_raw(path), path.stem, frame, units or {})
    except MissingExtraError:
        raise
    except RecordError as error:
        raise RecordError(f"{path.name}: {error}") from None


def write(record: Record, path: str | Path) -> None:
    """Write a recording; everything in SI, except MAT, which keeps the units and the frame of BROAD.

    Parameters
    ----------
    record : Record
        What to write.
    path : str or Path
        A file with one of `EXTENSIONS`; it is replaced when it exists.

    Raises
    ------
    RecordError
        The extension is unknown.
    MissingExtraError
        The format needs a package that is not installed.
    OSError
        The file cannot be written.
    """
    path = Path(path)
    _format(path).write(record, path)


def _format(path: Path) -> _Format:
    known = _FORMATS.get(path.suffix.lower())
    if known is None:
        raise RecordError(
            f"{path.name}: unknown extension {path.suffix!r}; known are {', '.join(EXTENSIONS)}"
        )
    return known


def _to_record(raw: RawRecording, name: str, frame: Frame | str | None, units: Mapping[str, str]) -> Record:
    missing = [signal for signal, kind in KINDS.items() if kind.required and signal not in raw.signals]
    if missing:
        raise RecordError(f"{', '.join(missing)} is missing; found {', '.join(raw.signals) or 'nothing'}")
    unknown = [signal for signal in units if not KINDS.get(signal) or not KINDS[signal].units]
    if unknown:
        raise RecordError(f"no unit can be declared for {unknown[0]!r}; only for time, gyro, accel, mag")
    si = {signal: in_si(signal, held, units.get(signal)) for signal, held in raw.signals.items()}
    declared = _frame(frame if frame is not None else raw.frame)
    record = Record(
        time=si["time"],
        gyro=si["gyro"],
        accel=si["accel"],
        mag=si.get("mag", np.empty((0, 3))),
        frame=declared or Frame.NED,
        accel_valid=si.get("accel_valid", np.empty(0)) != 0.0,
        mag_valid=si.get("mag_valid", np.empty(0)) != 0.0,
        q_true=si.get("q_true"),
        evaluate=si["evaluate"] != 0.0 if "evaluate" in si else None,
        name=raw.name or name,
    )
    # Absurdly large numbers overflow on the way to being refused.
    with np.errstate(over="ignore", invalid="ignore"):
        plausibility.check_units(record, frozenset(units))
        if declared is None:
            record = replace(record, frame=plausibility.detect_frame(record))
        plausibility.check_gravity_sign(record)
        _check_length_of_truth(record)
    return record


def _frame(value: Frame | str | None) -> Frame | None:
    try:
        return None if value is None else Frame(value)
    except ValueError:
        raise RecordError(f"unknown frame {value!r}; known are {', '.join(f.value for f in Frame)}") from None


def _check_length_of_truth(record: Record) -> None:
    if record.q_true is None:
        return
    length = np.linalg.norm(record.q_true, axis=-1)
    wrong = np.flatnonzero(np.abs(length - 1.0) > _NORM_TOLERANCE)
    if wrong.size:
        raise RecordError(f"row {wrong[0]}: q_true has length {length[wrong[0]]:.4g}; it must be 1")

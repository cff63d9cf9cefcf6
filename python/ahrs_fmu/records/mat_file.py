"""Recordings as MATLAB files in the layout of the BROAD data set (docs/records.md)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.io
from numpy.typing import NDArray

from ahrs_fmu.errors import RecordError
from ahrs_fmu.frames import Frame
from ahrs_fmu.records.record import Record
from ahrs_fmu.records.signals import RawRecording, Signal

_FIELDS = {
    "gyro": ("imu_gyr", "rad/s"),
    "accel": ("imu_acc", "m/s2"),
    "mag": ("imu_mag", "uT"),
    "q_true": ("opt_quat", None),
    "evaluate": ("movement", None),
    "accel_valid": ("accel_valid", None),
    "mag_valid": ("mag_valid", None),
}
_COLUMN_VECTORS = frozenset({"evaluate", "accel_valid", "mag_valid"})
_MICROTESLA = 1e6


def read(path: Path) -> RawRecording:
    """Read a MAT file with the fields of BROAD; its frame is ENU.

    Raises
    ------
    RecordError
        It is damaged, of version 7.3, or lacks a field.
    """
    try:
        held = scipy.io.loadmat(path)
    except NotImplementedError:
        raise RecordError("is a MAT file of version 7.3; save it with -v7") from None
    # Damage shows in scipy's reader as errors of a dozen unrelated types.
    except Exception as error:
        raise RecordError(f"is not a readable MAT file: {error}") from None
    missing = [f for f in ("imu_gyr", "imu_acc") if f not in held]
    if "time" not in held and "sampling_rate" not in held:
        missing.append("sampling_rate")
    if missing:
        raise RecordError(f"field {', '.join(missing)} is missing; the layout is that of BROAD")
    signals = {
        signal: Signal(held[name].ravel() if signal in _COLUMN_VECTORS else held[name], unit)
        for signal, (name, unit) in _FIELDS.items()
        if name in held
    }
    signals["time"] = Signal(held["time"].ravel() if "time" in held else _regular_time(held), "s")
    return RawRecording(signals, Frame.ENU.value)


def write(record: Record, path: Path) -> None:
    """Write a record in the layout of BROAD, turned to ENU.

    BROAD knows a sampling rate only; the field ``time`` is added, so that irregular steps survive.
    """
    enu = record.in_frame(Frame.ENU)
    fields: dict[str, NDArray[np.generic] | float] = {
        "time": enu.time[:, None],
        "sampling_rate": 1.0 / enu.sample_time,
        "imu_gyr": enu.gyro,
        "imu_acc": enu.accel,
        "imu_mag": enu.mag * _MICROTESLA,
        "accel_valid": enu.accel_valid[:, None].astype(np.uint8),
        "mag_valid": enu.mag_valid[:, None].astype(np.uint8),
    }
    if enu.q_true is not None:
        fields["opt_quat"] = enu.q_true
    if enu.evaluate is not None:
        fields["movement"] = enu.evaluate[:, None].astype(np.uint8)
    scipy.io.savemat(path, fields, do_compression=True)


def _regular_time(held: dict[str, NDArray[np.generic]]) -> NDArray[np.float64]:
    try:
        rate = float(np.asarray(held["sampling_rate"], dtype=np.float64).squeeze())
    except (TypeError, ValueError):
        rate = np.nan
    if not 0.0 < rate < np.inf:
        raise RecordError("sampling_rate must be one positive number in Hz")
    return np.arange(held["imu_gyr"].shape[0]) / rate

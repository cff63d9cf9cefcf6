"""Recordings as Parquet: the columns of the CSV format, frame and name in the schema (docs/records.md)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import extras
from ahrs_fmu.errors import RecordError
from ahrs_fmu.records.record import Record
from ahrs_fmu.records.signals import RawRecording, from_columns, to_columns


def read(path: Path) -> RawRecording:
    """Read the signals of a Parquet file.

    Raises
    ------
    RecordError
        It is damaged or not Parquet.
    MissingExtraError
        pyarrow is not installed.
    """
    arrow = extras.require("pyarrow", "records", "reading Parquet")
    parquet = extras.require("pyarrow.parquet", "records", "reading Parquet")
    try:
        table = parquet.read_table(path)
        names = table.column_names
        metadata = table.schema.metadata or {}
        frame, title = (metadata[key].decode() if key in metadata else None for key in (b"frame", b"name"))
    except (OSError, ValueError, arrow.ArrowException) as error:
        raise RecordError(f"is not a readable Parquet file: {_first_line(error)}") from None
    columns: dict[str, NDArray[np.generic]] = {}
    for name, column in zip(names, table.columns, strict=True):
        if name in columns:
            raise RecordError(f"column {name} appears twice")
        columns[name] = np.asarray(column.to_numpy())
    return RawRecording(from_columns(columns), frame, title)


def write(record: Record, path: Path) -> None:
    """Write a record as Parquet.

    Raises
    ------
    MissingExtraError
        pyarrow is not installed.
    """
    arrow = extras.require("pyarrow", "records", "writing Parquet")
    parquet = extras.require("pyarrow.parquet", "records", "writing Parquet")
    table = arrow.table({name: np.ascontiguousarray(c) for name, c in to_columns(record).items()})
    metadata = {"frame": record.frame.value, "name": record.name}
    parquet.write_table(table.replace_schema_metadata(metadata), path)


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0]

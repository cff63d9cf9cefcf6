"""Recordings as CSV: one header line that names units, one line per sample (docs/records.md)."""

from __future__ import annotations

import csv
from itertools import chain
from pathlib import Path

import numpy as np

from ahrs_fmu.errors import RecordError
from ahrs_fmu.records.record import FloatArray, Record, time_fault
from ahrs_fmu.records.signals import (
    FLAGS,
    KINDS,
    RawRecording,
    column_names,
    from_columns,
    split_header,
    to_columns,
)

_DELIMITERS = (",", ";", "\t")
_WORDS = {"true": 1.0, "false": 0.0}
_KNOWN = frozenset(chain.from_iterable(map(column_names, KINDS)))


def read(path: Path) -> RawRecording:
    """Read the signals of a CSV file.

    Raises
    ------
    RecordError
        The file is empty, not text, ragged, or holds a cell that is not a number; the message names
        the line.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return _parse(file.read())
    except UnicodeDecodeError:
        raise RecordError("is not a text file in UTF-8") from None
    except csv.Error as error:
        raise RecordError(f"is not a CSV file: {error}") from None


def write(record: Record, path: Path) -> None:
    """Write a record as CSV; numbers are written so that reading gives the same bits."""
    columns = to_columns(record)
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# frame: {record.frame.value}\n# name: {' '.join(record.name.split())}\n")
        writer = csv.writer(file)
        writer.writerow(columns)
        # int() of a Boolean column gives 0 and 1; repr of a float is its shortest exact form.
        lists = [(c.astype(int) if c.dtype == np.bool_ else c).tolist() for c in columns.values()]
        writer.writerows(zip(*lists, strict=True))


def _parse(text: str) -> RawRecording:
    lines = text.splitlines()
    remarks = {}
    head = 0
    while head < len(lines) and (not lines[head].strip() or lines[head].lstrip().startswith("#")):
        key, _, value = lines[head].lstrip("# \t").partition(":")
        remarks[key.strip()] = value.strip()
        head += 1
    if head == len(lines):
        raise RecordError("is empty: a header line with the column names is missing")
    delimiter = max(_DELIMITERS, key=lines[head].count)
    header, *rows = csv.reader(lines[head:], delimiter=delimiter)
    while rows and not rows[-1]:
        rows.pop()
    first_line = head + 2
    for line, row in enumerate(rows, first_line):
        if len(row) != len(header):
            raise RecordError(f"line {line} has {len(row)} cells; the header has {len(header)} columns")
    columns: dict[str, FloatArray] = {}
    for index, name in enumerate(header):
        stem, _ = split_header(name)
        known = stem in _KNOWN
        if known and name in columns:
            raise RecordError(f"column {stem} appears twice")
        columns[name] = _numbers([row[index] for row in rows], stem, first_line) if known else np.empty(0)
    signals = from_columns(columns)
    fault = time_fault(np.asarray(signals["time"].values, dtype=np.float64))
    if fault:
        raise RecordError(f"line {first_line + fault.row}: {fault.reason}")
    return RawRecording(signals, remarks.get("frame") or None, remarks.get("name") or None)


def _numbers(cells: list[str], name: str, first_line: int) -> FloatArray:
    values = np.empty(len(cells))
    for row, cell in enumerate(cells):
        word = cell.strip()
        try:
            # An empty cell is a sample that was not taken.
            values[row] = float(word) if word else np.nan
        except ValueError:
            if name not in FLAGS or word.lower() not in _WORDS:
                raise RecordError(f"line {first_line + row}: {name} is {word[:40]!r}, not a number") from None
            values[row] = _WORDS[word.lower()]
    return values

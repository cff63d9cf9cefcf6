"""Results on disk: one Parquet file per chunk, so that a campaign that was killed goes on where it was.

A file gets its name when it is complete, and each row carries the key of its case: what is under the folder
is always true, however it ended. Rows of cases that are no longer planned are left alone.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ahrs_fmu.campaign import requirements
from ahrs_fmu.campaign.axes import level_in_words
from ahrs_fmu.campaign.plan import PlannedCase
from ahrs_fmu.campaign.results import CaseResult, Measured, Results
from ahrs_fmu.errors import ScenarioError

RESULTS = "results.parquet"

_PARTS = "parts"
_LOCK = "running.lock"
_FIXED = ("case", "changes", "seed", "passed", "failure", "violated", "limit_used", "runtime")
_UNIT = re.compile(r"(?P<clause>.*) \[(?P<unit>.*)\]")


class Store:
    """Folder of a campaign's results.

    Parameters
    ----------
    folder : Path
        Made if it is not there.

    Raises
    ------
    MissingExtraError
        If pyarrow is not installed.
    """

    def __init__(self, folder: Path) -> None:
        self._arrow = requirements.require("pyarrow")
        self._parquet = requirements.require("pyarrow.parquet")
        self.folder = folder
        self._parts = folder / _PARTS
        self._parts.mkdir(parents=True, exist_ok=True)
        self._next = 1 + max((int(path.stem) for path in self._files()), default=0)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep others from writing to the folder; the lock ends with the process, however it ends.

        Raises
        ------
        ScenarioError
            If another process has it.
        """
        filelock = requirements.require("filelock")
        try:
            with filelock.FileLock(self.folder / _LOCK, timeout=0):
                yield
        except filelock.Timeout:
            raise ScenarioError(
                f"{self.folder}: a campaign is writing there: wait for it, or give another --output"
            ) from None

    def append(self, cases: Sequence[PlannedCase], results: Sequence[CaseResult]) -> None:
        """Add the results of a chunk, all or none of them."""
        final = self._parts / f"{self._next:08d}.parquet"
        self._next += 1
        self._write(self._table(cases, results), final)

    def known(self, keys: Iterable[str]) -> dict[str, CaseResult]:
        """Results that are there of those cases, by key.

        Raises
        ------
        ScenarioError
            If a file is damaged.
        """
        wanted = set(keys)
        rows = (row for path in self._files() for row in self._rows(path))
        return {row["case"]: _result(row) for row in rows if row["case"] in wanted}

    def count(self) -> int:
        """Number of results that are there, of planned cases and others."""
        return sum(self._parquet.read_metadata(path).num_rows for path in self._files())

    def clear(self) -> None:
        """Remove all results."""
        for path in self._files():
            path.unlink()

    def write_table(self, results: Results) -> Path:
        """Write all results as one table: a row for each case in the order of the campaign."""
        path = self.folder / RESULTS
        table = self._table(results.campaign.cases, results.cases)
        for name, values in _levels(results.campaign.cases).items():
            table = table.append_column(name, self._arrow.array(values))
        self._write(table, path)
        return path

    def _files(self) -> list[Path]:
        return sorted(self._parts.glob("*.parquet"))

    def _rows(self, path: Path) -> list[dict[str, Any]]:
        try:
            rows: list[dict[str, Any]] = self._parquet.read_table(path).to_pylist()
        except self._arrow.ArrowInvalid as error:
            raise ScenarioError(f"{path} is damaged ({error}): remove it, and its cases run again") from None
        return rows

    def _table(self, cases: Sequence[PlannedCase], results: Sequence[CaseResult]) -> Any:
        arrow = self._arrow
        text, number = arrow.string(), arrow.float64()
        types = (text, text, arrow.int64(), arrow.bool_(), text, arrow.list_(text), number, number)
        rows = [_row(*pair) for pair in zip(cases, results, strict=True)]
        clauses = dict.fromkeys(name for row in rows for name in row if name not in _FIXED)
        fields = [*zip(_FIXED, types, strict=True), *((name, number) for name in clauses)]
        schema = arrow.schema(fields)
        return arrow.Table.from_pylist(rows, schema=schema)

    def _write(self, table: Any, final: Path) -> None:
        temporary = final.with_suffix(".incomplete")
        with temporary.open("wb") as file:
            self._parquet.write_table(table, file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(final)


def _row(case: PlannedCase, result: CaseResult) -> dict[str, object]:
    return {
        "case": result.key,
        "changes": json.dumps(dict(case.changes), default=str),
        "seed": case.seed,
        "passed": result.passed,
        "failure": result.failure,
        "violated": list(result.violated),
        "limit_used": result.limit_used,
        "runtime": result.runtime,
        **{_column(clause, found.unit): found.value for clause, found in result.measured.items()},
    }


def _result(row: Mapping[str, Any]) -> CaseResult:
    measured = {}
    for name, value in row.items():
        if name not in _FIXED and value is not None:
            clause, unit = _clause(name)
            measured[clause] = Measured(value, unit)
    return CaseResult(
        row["case"],
        row["passed"],
        row["failure"],
        tuple(row["violated"]),
        row["limit_used"],
        measured,
        row["runtime"],
    )


def _column(clause: str, unit: str) -> str:
    return f"{clause} [{unit}]" if unit else clause


def _clause(column: str) -> tuple[str, str]:
    found = _UNIT.fullmatch(column)
    return (found["clause"], found["unit"]) if found else (column, "")


def _levels(cases: Sequence[PlannedCase]) -> dict[str, list[Any]]:
    """Where each case is on every axis: numbers where all of them are, else words."""
    found: dict[str, list[Any]] = {}
    for name in dict.fromkeys(name for case in cases for name in case.levels):
        column = [case.levels.get(name) for case in cases]
        numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in column)
        found[name] = [float(str(v)) for v in column] if numbers else [level_in_words(v) for v in column]
    return found

"""What a co-simulation recorded: signals over time, with units, and as tables of other libraries."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ahrs_fmu import extras
from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.errors import ScenarioError


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Signals over time.

    Attributes
    ----------
    time : ndarray, shape (N,)
        Ends of the steps, s.
    signals : mapping of str to ndarray, shape (N, ...)
        By ``component.variable``.
    units : mapping of str to str
        Unit of each signal.
    wall_time : float
        How long the run took, s.
    """

    time: Array
    signals: Mapping[str, Array]
    units: Mapping[str, str]
    wall_time: float

    def __getitem__(self, name: str) -> Array:
        """Return a signal by name.

        Raises
        ------
        ScenarioError
            If it was not recorded.
        """
        if name not in self.signals:
            raise ScenarioError(f"signal '{name}' was not recorded; there are {', '.join(self.signals)}")
        return self.signals[name]

    def __len__(self) -> int:
        return len(self.time)

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per second of the clock on the wall."""
        simulated = float(self.time[-1] - self.time[0]) if len(self) > 1 else 0.0
        return simulated / self.wall_time if self.wall_time > 0.0 else float("inf")

    def columns(self) -> dict[str, Array]:
        """Every element as a column (N,), named ``time [s]``, ``imu.gyro[1] [rad/s]``."""
        found = {"time [s]": self.time}
        for name, values in self.signals.items():
            unit = f" [{self.units[name]}]" if self.units[name] not in ("", "1") else ""
            flat = values.reshape(len(values), -1)
            for i in range(flat.shape[1]):
                element = f"[{i + 1}]" if values.ndim > 1 else ""
                found[f"{name}{element}{unit}"] = flat[:, i]
        return found

    def write_csv(self, path: str | Path) -> None:
        """Write all columns as comma-separated values, with every digit."""
        columns = self.columns()
        with Path(path).open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            writer.writerows(np.column_stack(list(columns.values())).tolist())

    def write_parquet(self, path: str | Path) -> None:
        """Write all columns as Parquet.

        Raises
        ------
        MissingExtraError
            If pyarrow is not installed.
        """
        arrow = extras.require("pyarrow", "records", "Parquet")
        parquet = extras.require("pyarrow.parquet", "records", "Parquet")
        parquet.write_table(arrow.table(self.columns()), path)

    def to_pandas(self) -> Any:
        """Return a pandas DataFrame with the time as its index; pandas must be installed."""
        pandas = extras.require("pandas", "tables", "a pandas table")
        columns = self.columns()
        index = pandas.Index(columns.pop("time [s]"), name="time [s]")
        return pandas.DataFrame(columns, index=index)

    def to_xarray(self) -> Any:
        """Return an xarray Dataset over the dimension ``time``; xarray must be installed."""
        xarray = extras.require("xarray", "tables", "an xarray data set")
        variables = {
            name: (
                ("time", *(f"{name}_{i}" for i in range(values.ndim - 1))),
                values,
                {"units": self.units[name]},
            )
            for name, values in self.signals.items()
        }
        return xarray.Dataset(variables, coords={"time": self.time})

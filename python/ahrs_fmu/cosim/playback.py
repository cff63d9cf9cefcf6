"""Signals known beforehand as a component: a manoeuvre, a wind, a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.errors import ParameterError, SimulationError

_GRID = 1e-6
"""How far from a whole number of rows a step may be, in rows."""


class Playback:
    """A component without inputs whose outputs are columns of numbers.

    Parameters
    ----------
    columns : mapping of str to array (N, ...)
        Row k is the output at k times `step`; row 0 is the initial one.
    units : mapping of str to str
        Unit of each column; one that is left out is a pure number.
    step : float
        Time between rows, s.
    """

    never_fails = True
    inputs: Mapping[str, Port] = MappingProxyType({})

    def __init__(self, columns: Mapping[str, Array], units: Mapping[str, str], step: float) -> None:
        self._columns = {name: np.asarray(column, dtype=np.float64) for name, column in columns.items()}
        self.outputs: Mapping[str, Port] = {
            name: Port(units.get(name, ""), column.shape[1:]) for name, column in self._columns.items()
        }
        self.step_size = step
        self._last = min(len(column) for column in self._columns.values()) - 1
        self._row = 0

    def set(self, name: str, value: ArrayLike) -> None:  # noqa: ARG002
        """Refuse: there are no inputs."""
        raise ParameterError(f"a playback has no input '{name}'")

    def get(self, name: str) -> Array:
        """Return an output as it is now."""
        column: Array = self._columns[name][self._row]
        return column

    def step(self, dt: float) -> None:
        """Go on by `dt` seconds, a whole number of rows.

        Raises
        ------
        SimulationError
            If there are no rows left.
        """
        self._row = self._after(dt, 1)

    def replay(
        self,
        inputs: Mapping[str, Array],  # noqa: ARG002
        outputs: Sequence[str],
        dt: float,
        rows: int | None = None,
    ) -> dict[str, Array]:
        """Return the columns of the next `rows` steps; see `ahrs_fmu.cosim.stepper.Replayer`."""
        start, end = self._row, self._after(dt, rows or 0)
        every = max(1, (end - start) // max(1, rows or 0))
        self._row = end
        return {name: self._columns[name][start + every : end + 1 : every] for name in outputs}

    def save(self) -> object:
        """Return the present row, for `restore`."""
        return self._row

    def restore(self, state: int) -> None:
        """Continue from what `save` returned."""
        self._row = state

    def reset(self) -> None:
        """Return to the first row."""
        self._row = 0

    def _after(self, dt: float, steps: int) -> int:
        rows = round(dt / self.step_size)
        if rows < 1 or abs(dt / self.step_size - rows) > _GRID:
            raise ParameterError(f"step of {dt:g} s: the rows are {self.step_size:g} s apart; take multiples")
        end = self._row + rows * steps
        if end > self._last:
            raise SimulationError(f"the playback ends at {self._last * self.step_size:g} s")
        return end

"""Random numbers of a fault: functions of seed, name and sample alone, whatever else is drawn."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from ahrs_fmu.cosim.stepper import Array

_BLOCK = 256


class Chance:
    """Rows of independent random numbers by time.

    Parameters
    ----------
    draw : callable
        `ahrs_fmu.counter_random.uniform_pair` or `normal_pair`.
    seed : int
    name : str
        Faults of different names see different numbers.
    columns : int
        How many numbers a sample has.
    step : float
        Time between samples, s.
    """

    def __init__(self, draw: Callable[..., Array], seed: int, name: str, columns: int, step: float) -> None:
        self._draw, self._seed, self._columns, self._step = draw, np.uint64(seed), columns, step
        # Streams of a component count from zero; those of a fault are far away from them.
        first = np.uint64(zlib.crc32(name.encode()) << 8)
        self._streams = first + np.arange((columns + 1) // 2, dtype=np.uint64)
        self._began = -1
        self._block: Array = np.empty((0, columns))

    def __call__(self, time: Array) -> Array:
        """Numbers (N, columns) of the samples at times (N,)."""
        rows = np.rint(time / self._step).astype(np.uint64)
        if len(rows) > 1:
            return self._of(rows)
        # Step by step a block is drawn at once, which costs little more than one sample.
        began, at = divmod(int(rows[0]), _BLOCK)
        if began != self._began:
            self._began = began
            self._block = self._of(np.arange(began * _BLOCK, (began + 1) * _BLOCK, dtype=np.uint64))
        return self._block[at : at + 1]

    def _of(self, rows: np.ndarray[Any, np.dtype[np.uint64]]) -> Array:
        drawn = self._draw(self._seed, self._streams, rows[:, None])
        return drawn.reshape(len(rows), -1)[:, : self._columns]

"""What may become of a signal on its way from an output to those who see it.

A tap gets rows of successive steps, one at a time or a whole run at once, and gives the same bits either way.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu.cosim.stepper import Array

Flags = NDArray[np.bool_]


class Tap(Protocol):
    """What becomes of a signal on its way."""

    def __call__(self, time: Array, values: Array) -> Array:
        """Return what others see of `values` (N, ...) at the ends (N,) of successive steps, s."""

    def save(self) -> object:
        """Return what is remembered of earlier steps."""

    def restore(self, state: Any) -> None:
        """Continue from what `save` returned."""

    def reset(self) -> None:
        """Forget all steps."""


class Memoryless:
    """A tap that is a function of time and value.

    Parameters
    ----------
    function : callable
        Of the times (N,) and rows of elements (N, size); it returns rows and changes none of them in place.
    """

    def __init__(self, function: Callable[[Array, Array], Array]) -> None:
        self._function = function

    def __call__(self, time: Array, values: Array) -> Array:
        """Apply the function to rows of elements."""
        return self._function(time, values.reshape(len(time), -1)).reshape(values.shape)

    def save(self) -> object:
        """Return nothing: nothing is remembered."""
        return None

    def restore(self, state: None) -> None:
        """Do nothing."""

    def reset(self) -> None:
        """Do nothing."""


class Remembering:
    """A tap that sees as many samples before the present one as it asks for.

    Parameters
    ----------
    function : callable
        Of the times (N,) and of rows of elements (memory + N, size), of which the first `memory` came before;
        it returns N rows. Before the start the first sample stands for those that never were.
    memory : int
        How many, at least one.
    """

    def __init__(self, function: Callable[[Array, Array], Array], memory: int) -> None:
        self._function, self._memory = function, memory
        self._before: Array | None = None

    def __call__(self, time: Array, values: Array) -> Array:
        """Apply the function to the rows before and these."""
        rows = values.reshape(len(time), -1)
        before = np.repeat(rows[:1], self._memory, axis=0) if self._before is None else self._before
        seen = np.concatenate((before, rows))
        self._before = seen[len(seen) - self._memory :].copy()
        return self._function(time, seen).reshape(values.shape)

    def save(self) -> object:
        """Return the rows remembered."""
        return self._before

    def restore(self, state: Array | None) -> None:
        """Remember the rows that `save` returned."""
        self._before = state

    def reset(self) -> None:
        """Forget them."""
        self._before = None


class Holding:
    """A tap that passes on the last value of before wherever `holds(time)` is true.

    The first sample of all is passed on in any case: there is nothing else to show.
    """

    def __init__(self, holds: Callable[[Array], Flags]) -> None:
        self._holds = holds
        self._last: Array | None = None

    def __call__(self, time: Array, values: Array) -> Array:
        """Replace held rows by the last one that was not."""
        last = values[0] if self._last is None else self._last
        rows = np.concatenate((last[None], values))
        free = np.concatenate((np.ones(1, dtype=np.bool_), ~self._holds(time)))
        source = np.maximum.accumulate(np.where(free, np.arange(len(rows)), 0))
        seen: Array = rows[source]
        self._last = np.array(seen[-1])
        return seen[1:]

    def save(self) -> object:
        """Return the value held."""
        return self._last

    def restore(self, state: Array | None) -> None:
        """Hold the value that `save` returned."""
        self._last = state

    def reset(self) -> None:
        """Forget it."""
        self._last = None


class Watching:
    """A tap that changes nothing and tells the value of a signal to others."""

    def __init__(self) -> None:
        self._time: Array = np.empty(0)
        self._values: Array = np.empty(0)

    def __call__(self, time: Array, values: Array) -> Array:
        """Keep these rows."""
        self._time, self._values = time.copy(), values.copy()
        return values

    def at(self, time: Array) -> Array | None:
        """Value (N, ...) at times (N,) of these rows, the last one for later times; None before any row."""
        if not self._time.size:
            return None
        found: Array = self._values[np.minimum(np.searchsorted(self._time, time), len(self._time) - 1)]
        return found

    def save(self) -> object:
        """Return the last row."""
        return self._time[-1:], self._values[-1:]

    def restore(self, state: tuple[Array, Array]) -> None:
        """Continue with the row that `save` returned."""
        self._time, self._values = state

    def reset(self) -> None:
        """Forget all rows."""
        self._time, self._values = np.empty(0), np.empty(0)

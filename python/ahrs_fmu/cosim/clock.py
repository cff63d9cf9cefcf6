"""When a sampled component takes its samples: at multiples of its sample time, whatever the steps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu.errors import ParameterError

_TOLERANCE = 1e-6
"""A tick counts as reached this many ticks early, as in an FMU (fmu_src/fmi/component.c)."""


class SampleClock:
    """Counts the ticks inside steps of any length.

    Parameters
    ----------
    sample_time : float
        Time between ticks, s.

    Attributes
    ----------
    fraction : float
        Ticks from the last one to now.
    """

    def __init__(self, sample_time: float) -> None:
        self.sample_time = sample_time
        self.fraction = 0.0

    def advance(self, dt: float) -> int:
        """Go on by `dt` seconds and return the number of ticks on the way, the end included.

        Raises
        ------
        ParameterError
            If the time does not go forward.
        """
        if not (math.isfinite(dt) and dt > 0.0):
            raise ParameterError(f"step of {dt:g} s: it must be positive")
        position = self.fraction + dt / self.sample_time
        ticks = int(max(position + _TOLERANCE, 0.0))
        self.fraction = position - ticks
        return ticks

    def advance_often(self, dt: float, steps: int) -> NDArray[np.intp]:
        """Do as many steps of `dt` seconds and return the ticks (N,) of each.

        Raises
        ------
        ParameterError
            If the time does not go forward.
        """
        if steps and self.fraction == 0.0 and (dt / self.sample_time).is_integer():
            return np.full(steps, self.advance(dt), dtype=np.intp)
        return np.array([self.advance(dt) for _ in range(steps)], dtype=np.intp)

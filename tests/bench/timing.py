"""Timing of many cases in turn, so that their ratios hold on a machine that has other things to do."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from statistics import median
from time import perf_counter_ns

WARM_UP = 3


@dataclass(frozen=True)
class Case:
    """Something that is timed: a call that handles a number of rows."""

    name: str
    call: Callable[[], object]
    rows: int
    times: list[float] = field(default_factory=list)

    @property
    def ns(self) -> float:
        """Nanoseconds per row at its fastest: all that another process adds is left out."""
        return min(self.times)

    @property
    def median_ns(self) -> float:
        """Nanoseconds per row as it mostly was."""
        return median(self.times)


@dataclass(frozen=True)
class Ratio:
    """What one case costs in units of another."""

    case: str
    base: str
    limit: float | None = None

    def value(self, cases: dict[str, Case]) -> float | None:
        """The ratio; None when one of the two did not take part."""
        if self.case not in cases or self.base not in cases:
            return None
        return cases[self.case].ns / cases[self.base].ns


def measure(cases: Iterable[Case], rounds: Iterable[int]) -> None:
    """Time all cases in turn, once per round."""
    cases = list(cases)
    for case in cases:
        for _ in range(WARM_UP):
            case.call()
    gc.disable()
    for _ in rounds:
        for case in cases:
            start = perf_counter_ns()
            case.call()
            case.times.append((perf_counter_ns() - start) / case.rows)
    gc.enable()

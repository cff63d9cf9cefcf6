"""Timing of many cases in turn, so that their ratios hold on a machine that has other things to do.

What counts is processor time, of which the shortest is the least disturbed.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median
from time import monotonic, thread_time_ns

from rich.console import Console
from rich.progress import Progress

LEAST_ROUNDS = 10
REPEATS = 3


@dataclass(frozen=True)
class Case:
    """Something that is timed: a call that handles a number of rows."""

    name: str
    call: Callable[[], object]
    rows: int
    times: list[float] = field(default_factory=list)

    @property
    def ns(self) -> float:
        """Nanoseconds per row at its fastest."""
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


def measure(cases: Sequence[Case], seconds: float, console: Console) -> int:
    """Time all cases in turn, again and again for some seconds; returns how often."""
    gc.disable()
    rounds = 0
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("timing", total=seconds)
        end = monotonic() + seconds
        while rounds < LEAST_ROUNDS or monotonic() < end:
            for case in cases:
                case.call()  # so that what ran before does not matter
                for _ in range(REPEATS):
                    start = thread_time_ns()
                    case.call()
                    case.times.append((thread_time_ns() - start) / case.rows)
            rounds += 1
            progress.update(task, completed=seconds - max(end - monotonic(), 0.0))
    gc.enable()
    return rounds

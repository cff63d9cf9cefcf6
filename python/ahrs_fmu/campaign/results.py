"""What came out of the cases of a campaign."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ahrs_fmu import units
from ahrs_fmu.campaign.plan import Campaign, PlannedCase


@dataclass(frozen=True, slots=True)
class Measured:
    """What a clause measured: a number in `unit`; NaN or infinite where there was nothing to measure."""

    value: float
    unit: str

    @property
    def shown(self) -> tuple[float, str]:
        """Number and unit as people read them: degrees, microtesla."""
        target = display_unit(self.unit)
        return self.value * units.factor(self.unit, target), target

    @property
    def text(self) -> str:
        """Number and unit in words."""
        number, unit = self.shown
        return f"{number:.3g} {unit}".rstrip()


@dataclass(frozen=True, slots=True)
class CaseResult:
    """What came out of one case.

    Attributes
    ----------
    key : str
        Of the `PlannedCase`.
    passed : bool
        Whether the run came to its end and every clause holds.
    failure : str
        Why the run stopped; empty if it did not.
    violated : sequence of str
        The clauses that do not hold, as `statement` words them.
    limit_used : float
        The largest part of its limit that a clause used: 1 is at the limit, infinity where a run stopped or
        a clause without a number is violated.
    measured : mapping of str to Measured
        By the text of the clause; none after a failure.
    runtime : float
        s.
    """

    key: str
    passed: bool
    failure: str
    violated: Sequence[str]
    limit_used: float
    measured: Mapping[str, Measured]
    runtime: float

    def told(self) -> Iterator[tuple[str, bool]]:
        """Every clause with what it measured, in words, and whether it holds."""
        for clause, found in self.measured.items():
            limits = [said.removeprefix(clause) for said in self.violated if said.startswith(f"{clause} ")]
            broken = f", expected{' and'.join(limits)}" if limits else ""
            yield f"{clause}: {found.text}{broken}", not limits


@dataclass(frozen=True, slots=True)
class Results:
    """What came out of a campaign.

    Attributes
    ----------
    campaign : Campaign
    cases : sequence of CaseResult
        One for each case of the campaign, in its order.
    """

    campaign: Campaign
    cases: Sequence[CaseResult]

    @property
    def passed(self) -> bool:
        """Whether every case passed."""
        return all(case.passed for case in self.cases)

    @property
    def stopped(self) -> int:
        """Number of cases in which a component failed."""
        return sum(bool(case.failure) for case in self.cases)

    @property
    def violating(self) -> int:
        """Number of cases that came to their end and violate a clause."""
        return sum(not case.passed and not case.failure for case in self.cases)

    def worst(self, count: int) -> list[tuple[PlannedCase, CaseResult]]:
        """Cases that stopped, then those nearest to or farthest beyond a limit.

        One of each combination of levels comes before others that differ from it by their seed or their
        point of the ranges only.
        """
        both = list(zip(self.campaign.cases, self.cases, strict=True))
        both.sort(key=lambda pair: (not pair[1].failure, -pair[1].limit_used))
        seen: set[tuple[object, ...]] = set()
        first: list[tuple[PlannedCase, CaseResult]] = []
        others: list[tuple[PlannedCase, CaseResult]] = []
        for case, result in both:
            levels = (case.file, *(str(v) for k, v in case.levels.items() if k not in self.campaign.ranges))
            (others if levels in seen else first).append((case, result))
            seen.add(levels)
        return (first + others)[:count]


def display_unit(unit: str) -> str:
    """Unit in which people read what is measured in `unit`."""
    if unit.startswith("rad"):
        return unit.replace("rad", "deg", 1)
    return "uT" if unit == "T" else unit

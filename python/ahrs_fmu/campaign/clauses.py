"""The clauses of a campaign: what each measured over all cases, against its limit."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from ahrs_fmu import units
from ahrs_fmu.campaign.results import Measured, Results, display_unit
from ahrs_fmu.cosim.expectations import Expectation, Verdict


@dataclass(slots=True)
class Clause:
    """One clause over the cases that have it.

    Attributes
    ----------
    expectation : Expectation
    measured : dict of int to Measured
        By the index of the case in the campaign.
    violated : set of int
        Indices of the cases that violate it.
    """

    expectation: Expectation
    measured: dict[int, Measured] = field(default_factory=dict)
    violated: set[int] = field(default_factory=set)

    @property
    def unit(self) -> str:
        """Unit in which people read what it measures."""
        return display_unit(next((found.unit for found in self.measured.values()), ""))

    @property
    def bounds(self) -> tuple[float, float]:
        """Its bounds in `unit`, infinite where there is none."""
        return bounds(self.expectation, self.unit)

    def finite(self) -> dict[int, float]:
        """What was measured in `unit`, by case, where it is a number."""
        return {at: found.shown[0] for at, found in self.measured.items() if math.isfinite(found.value)}


def clauses(results: Results) -> list[Clause]:
    """Clauses of all scenarios in the order of their files; the same one in two scenarios is one."""
    found: dict[str, Clause] = {}
    known: dict[tuple[int, str], Sequence[Expectation]] = {}
    campaign = results.campaign
    for at, (case, result) in enumerate(zip(campaign.cases, results.cases, strict=True)):
        # A variant may bring expectations of its own.
        key = case.file, json.dumps(case.changes.get("expect"), default=str)
        if key not in known:
            known[key] = campaign.scenarios[case.file].scenario(case.changes).expect
        for expectation in known[key]:
            said = statement(expectation)
            clause = found.setdefault(said, Clause(expectation))
            if expectation.text in result.measured:
                clause.measured[at] = result.measured[expectation.text]
            if said in result.violated:
                clause.violated.add(at)
    return list(found.values())


def statement(expectation: Expectation) -> str:
    """A clause with its limit, in words."""
    return f"{expectation.text} {expectation.limit}"


def bounds(expectation: Expectation, unit: str) -> tuple[float, float]:
    """Bounds of a measure in `unit`, infinite where there is none.

    Raises
    ------
    UnitError
        If a bound has a unit that measures something else.
    """
    low, high = expectation.at_least, expectation.at_most
    return (
        -math.inf if low is None else units.quantity(low, unit),
        math.inf if high is None else units.quantity(high, unit),
    )


def limit_used(expectation: Expectation, verdict: Verdict) -> float:
    """Part of its limit that a clause uses: 1 is at the limit, more is beyond it."""
    low, high = bounds(expectation, verdict.unit)
    used = [0.0 if verdict.passed else math.inf]
    if math.isfinite(verdict.measured):
        if 0.0 < high < math.inf:
            used = [verdict.measured / high]
        if low > 0.0 and verdict.measured > 0.0:
            used.append(low / verdict.measured)
    return max(used)

"""What a scenario expects of its signals, and what came out.

A clause names a signal, a measure and a bound::

    [[expect]]
    signal = "attitude_error.inclination"
    measure = "rms"
    at_most = "1.5 deg"
    from = 10.0

The size of a signal is the element that is named (``position[3]``), the norm of an array, or the magnitude of
a scalar.

=============  =========================================================================================
measure        what is measured in the window [from, until]
=============  =========================================================================================
rms            root mean square of the size
max            largest size
p95            size that 95 % of the samples do not exceed
mean           mean, with its sign
final          largest size in the last tenth of the window
settling       time from the beginning of the window after which the size stays within `band`
recovery       the same from the end of the last fault on
overshoot      how far the value passes its final one, relative to the change from the first, 1
reached        when the condition holds for the first time
never          when the condition holds for the first time, which must not be
phase_margin   rad; see `ahrs_fmu.cosim.loop_gain`
gain_margin    factor; likewise
=============  =========================================================================================

A condition is one of `above`, `below` and `equals`, the last with a number, a truth value or the name of an
enumeration's item.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import units
from ahrs_fmu.cosim.derived import magnitude, source_of
from ahrs_fmu.cosim.recording import Recording
from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.errors import ScenarioError, UnitError
from ahrs_fmu.trajectories import Data

Quantity = float | str
Flags = NDArray[np.bool_]
Measure = Literal[
    "rms",
    "max",
    "p95",
    "mean",
    "final",
    "settling",
    "recovery",
    "overshoot",
    "reached",
    "never",
    "phase_margin",
    "gain_margin",
]
MARGINS = ("phase_margin", "gain_margin")
_TIMES = ("settling", "recovery", "reached", "never")
_CONDITIONAL = ("reached", "never")
_BANDED = ("settling", "recovery")
_PERCENT = 95.0
LAST = 0.1
"""Part of the window that counts for `final`."""


class Expectation(Data, frozen=True, rename={"from_": "from"}):
    """One clause; see the module.

    Attributes
    ----------
    signal : str
        Recorded or derived.
    measure : str
    at_most, at_least : number or text with a unit, optional
        Bounds of the measure.
    from_, until : float
        Window, s.
    band : number or text with a unit, optional
        For `settling` and `recovery`.
    above, below, equals : optional
        Condition of `reached` and `never`.
    direction : tuple of float
        Of the disturbance among the elements of the signal, for the margins.
    """

    signal: str
    measure: Measure
    at_most: Quantity | None = None
    at_least: Quantity | None = None
    from_: float = 0.0
    until: float = math.inf
    band: Quantity | None = None
    above: Quantity | None = None
    below: Quantity | None = None
    equals: Quantity | bool | None = None
    direction: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a clause that says too little."""
        conditions = [c for c in (self.above, self.below, self.equals) if c is not None]
        where = f"expect: {self.measure} of {self.signal}"
        if self.measure in _CONDITIONAL and len(conditions) != 1:
            raise ValueError(f"{where} needs one of above, below, equals")
        if self.measure not in _CONDITIONAL and conditions:
            raise ValueError(f"{where} takes no condition: write at_most or at_least")
        if self.measure not in _CONDITIONAL and self.at_most is None and self.at_least is None:
            raise ValueError(f"{where} needs at_most or at_least")
        if (self.measure in _BANDED) != (self.band is not None):
            raise ValueError(f"{where} {'needs' if self.measure in _BANDED else 'takes no'} band")
        if self.measure in MARGINS and not any(self.direction):
            raise ValueError(f"{where} needs direction, such as [-1, 1, 1, -1] for the rotors that roll")

    @property
    def text(self) -> str:
        """The clause in words."""
        words = [self.measure.replace("_", " "), "of", self.signal]
        if self.band is not None:
            words.append(f"(within {_shown(self.band)})")
        for name, value in (("above", self.above), ("below", self.below), ("equals", self.equals)):
            if value is not None:
                words.append(f"{name} {_shown(value)}")
        if self.from_:
            words.append(f"from {self.from_:g} s")
        if self.until < math.inf:
            words.append(f"until {self.until:g} s")
        return " ".join(words)

    @property
    def limit(self) -> str:
        """The bound in words."""
        if self.at_most is None and self.at_least is None:
            return "at some time" if self.measure == "reached" else "at no time"
        low, high = (self._bound(bound) for bound in (self.at_least, self.at_most))
        if not low or not high:
            return f"≤ {high}" if high else f"≥ {low}"
        number, _, unit = low.partition(" ")
        return f"{number if high.partition(' ')[2] == unit else low} to {high}"

    def _bound(self, value: Quantity | None) -> str:
        if value is None:
            return ""
        return f"{value:g} s" if self.measure in _TIMES and not isinstance(value, str) else _shown(value)

    def unit(self, signal_unit: str) -> str:
        """Unit of the measure."""
        if self.measure in _TIMES:
            return "s"
        if self.measure == "phase_margin":
            return "rad"
        return "" if self.measure in ("overshoot", "gain_margin") else signal_unit


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came out of one clause.

    Attributes
    ----------
    clause, limit : str
        In words.
    measured : float
        In `unit`; NaN where a condition never held or a signal was not finite.
    unit : str
    passed : bool
    at : float or None
        When the bound was passed for the first time, or the worst moment, s.
    signal : str
        The signal it is about.
    measure : str
    """

    clause: str
    limit: str
    measured: float
    unit: str
    passed: bool
    at: float | None
    signal: str
    measure: str

    @property
    def value(self) -> str:
        """The measured value in words; angles in degrees."""
        if math.isnan(self.measured):
            return "did not happen" if self.measure in _CONDITIONAL else "not finite"
        if math.isinf(self.measured):
            if self.measure in _TIMES:
                return "never"
            return "unlimited" if self.measured > 0.0 else "unstable"
        number, unit = self.measured, self.unit
        if unit.startswith("rad"):
            number, unit = math.degrees(number), unit.replace("rad", "deg", 1)
        elif unit == "T":
            number, unit = number * 1e6, "uT"
        return f"{number:.3g} {unit}".rstrip()


def judge(
    expectation: Expectation,
    recording: Recording,
    items: Mapping[str, Mapping[str, int]],
    fault_end: float,
    margins: Mapping[str, float],
) -> Verdict:
    """Measure and compare.

    Parameters
    ----------
    expectation : Expectation
    recording : Recording
        With the derived signals.
    items : mapping
        Numbers of an enumeration's items by signal.
    fault_end : float
        When the last fault is over, s; infinity if one never is, -infinity if there is none.
    margins : mapping of str to float
        Measured margins by measure, where the clause asks for one.

    Raises
    ------
    ScenarioError
        If the clause does not fit the signal.
    """
    unit = recording.units.get(source_of(expectation.signal), "")
    own = expectation.unit(unit)
    if expectation.measure in MARGINS:
        return _compared(expectation, margins[expectation.measure], own, None)
    values = magnitude(recording, expectation.signal)
    start = expectation.from_
    if expectation.measure == "recovery":
        if not math.isfinite(fault_end):
            raise ScenarioError(f"expect: {expectation.text}: there is no fault that ends")
        start = max(start, fault_end)
    window = (recording.time >= start - 1e-9) & (recording.time <= expectation.until + 1e-9)
    if not window.any():
        raise ScenarioError(
            f"expect: {expectation.text}: the window is empty; the run ends at {recording.time[-1]:g} s"
        )
    time, values = recording.time[window], values[window]
    if expectation.measure in _CONDITIONAL:
        return _conditional(expectation, time, _condition(expectation, values, unit, items))
    measured, at = _measured(expectation, time, values, unit, start)
    return _compared(expectation, measured, own, at)


def _measured(
    expectation: Expectation, time: Array, values: Array, unit: str, start: float
) -> tuple[float, float | None]:
    size = np.abs(values)
    measure = expectation.measure
    if not np.isfinite(values).all():
        return math.nan, float(time[np.argmin(np.isfinite(values))])
    if measure in _BANDED:
        outside = np.flatnonzero(size > _quantity(expectation, expectation.band, unit))
        if not outside.size:
            return 0.0, None
        if outside[-1] == len(size) - 1:
            return math.inf, float(time[-1])
        return float(time[outside[-1] + 1] - start), float(time[outside[-1]])
    if measure == "overshoot":
        tail = values[-max(1, round(LAST * len(values))) :]
        change = float(tail.mean() - values[0])
        if change == 0.0:
            return 0.0, None
        beyond = (values - tail.mean()) / change
        return max(0.0, float(beyond.max())), float(time[np.argmax(beyond)])
    last = max(1, round(LAST * len(size)))
    found = {
        "rms": float(np.sqrt(np.mean(size**2))),
        "max": float(size.max()),
        "p95": float(np.percentile(size, _PERCENT)),
        "mean": float(values.mean()),
        "final": float(size[-last:].max()),
    }[measure]
    seen = slice(-last, None) if measure == "final" else slice(None)
    return found, _worst(expectation, time[seen], size[seen], unit)


def _worst(expectation: Expectation, time: Array, size: Array, unit: str) -> float:
    """When the size first passes the bound; if it never does, when it is largest."""
    if expectation.at_most is not None:
        passing = np.flatnonzero(size > _quantity(expectation, expectation.at_most, unit))
        if passing.size:
            return float(time[passing[0]])
    return float(time[np.argmax(size)])


def _condition(
    expectation: Expectation, values: Array, unit: str, items: Mapping[str, Mapping[str, int]]
) -> Flags:
    if expectation.above is not None:
        return values > _quantity(expectation, expectation.above, unit)
    if expectation.below is not None:
        return values < _quantity(expectation, expectation.below, unit)
    wanted = expectation.equals
    known = items.get(expectation.signal, {})
    if isinstance(wanted, str) and known:
        if wanted not in known:
            raise ScenarioError(
                f"expect: equals = '{wanted}': {expectation.signal} is one of {', '.join(known)}"
            )
        wanted = known[wanted]
    equal: Flags = values == _quantity(expectation, wanted, unit)
    return equal


def _conditional(expectation: Expectation, time: Array, holds: Flags) -> Verdict:
    first = float(time[np.argmax(holds)]) if holds.any() else None
    measured = math.nan if first is None else first
    if expectation.measure == "never":
        return _verdict(expectation, measured, "s", first is None, first)
    passed = first is not None and _within(expectation, first, "s")
    return _verdict(expectation, measured, "s", passed, first)


def _compared(expectation: Expectation, measured: float, unit: str, at: float | None) -> Verdict:
    passed = not math.isnan(measured) and _within(expectation, measured, unit)
    return _verdict(expectation, measured, unit, passed, at)


def _verdict(expectation: Expectation, measured: float, unit: str, passed: bool, at: float | None) -> Verdict:
    return Verdict(
        expectation.text,
        expectation.limit,
        measured,
        unit,
        passed,
        at,
        expectation.signal,
        expectation.measure,
    )


def _within(expectation: Expectation, measured: float, unit: str) -> bool:
    high, low = expectation.at_most, expectation.at_least
    return (high is None or measured <= _quantity(expectation, high, unit)) and (
        low is None or measured >= _quantity(expectation, low, unit)
    )


def _quantity(expectation: Expectation, value: Any, unit: str) -> float:
    try:
        return units.quantity(value, unit)
    except UnitError as error:
        raise ScenarioError(f"expect: {expectation.text}: {error}") from None


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)

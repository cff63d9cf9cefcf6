"""Faults as data: what can go wrong with a signal on its way, when, and how badly.

A fault is read from a scenario file and turned into one or more taps of a `System`. It acts from `start` on
for `duration` seconds; how strongly, between 0 and 1, is its envelope::

    shape = "step"    1 while it lasts
    shape = "ramp"    rises linearly over `rise` seconds, and falls likewise before the end
    shape = "smooth"  the same with a raised cosine
    shape = "pulses"  1 in every second interval of `rise` seconds

`severity` multiplies what is written in the file: 0 is no fault, 1 the one that is written. Random numbers
are functions of seed, fault and sample alone (`ahrs_fmu.counter_random`), so that a run can be repeated,
restored in the middle and split among processes.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import counter_random, units
from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.cosim.system import Tap
from ahrs_fmu.errors import ScenarioError, UnitError
from ahrs_fmu.trajectories import Data

Level = Annotated[float, msgspec.Meta(ge=0.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Flags = NDArray[np.bool_]
Quantity = float | str
"""A number in the unit of the signal, or a text with its own unit."""
Quantities = Quantity | list[Quantity]
"""One for every element of the signal, or one for all of them."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where and in which run a fault acts.

    Attributes
    ----------
    name : str
        Of the fault; it decides the random numbers together with the seed.
    port : Port
        Unit and shape of the signal.
    step : float
        Time between samples, s.
    seed : int
    """

    name: str
    port: Port
    step: float
    seed: int

    @property
    def size(self) -> int:
        """Number of elements of the signal."""
        return int(np.prod(self.port.shape, dtype=int))

    def numbers(self, value: Quantities) -> Array:
        """Read numbers in the unit of the signal, one per element (size,).

        Raises
        ------
        ScenarioError
            If their number or unit does not fit.
        """
        return self.numbers_in(value, self.port.unit)

    def numbers_in(self, value: Quantities, unit: str) -> Array:
        """Read numbers in `unit`, one per element (size,)."""
        given = value if isinstance(value, list) else [value] * self.size
        if len(given) != self.size:
            raise ScenarioError(
                f"faults.{self.name}: {len(given)} numbers for a signal of {self.size} elements"
            )
        try:
            return np.array([units.quantity(item, unit) for item in given])
        except UnitError as error:
            raise ScenarioError(f"faults.{self.name}: {error}") from None

    def rows(self, time: Array) -> Array:
        """Number of the sample (N,) at each time."""
        return np.rint(time / self.step)

    def uniform(self, time: Array, columns: int) -> Array:
        """Uniform numbers (N, columns) in (0, 1), a function of seed, fault and time."""
        pairs = counter_random.uniform_pair(*self._counters(time, columns))
        return pairs.reshape(len(time), -1)[:, :columns]

    def normal(self, time: Array, columns: int) -> Array:
        """Do as `uniform`, standard normal."""
        pairs = counter_random.normal_pair(*self._counters(time, columns))
        return pairs.reshape(len(time), -1)[:, :columns]

    def _counters(self, time: Array, columns: int) -> tuple[Any, Any, Any]:
        stream = zlib.crc32(self.name.encode()) << 8
        pairs = np.arange((columns + 1) // 2, dtype=np.uint64)
        # Streams of a component count from zero; those of a fault are far away from them.
        return np.uint64(self.seed), np.uint64(stream) + pairs, self.rows(time).astype(np.uint64)[:, None]


class Memoryless:
    """A tap that is a function of time and value."""

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
        How many.
    """

    def __init__(self, function: Callable[[Array, Array], Array], memory: int) -> None:
        self._function, self._memory = function, memory
        self._before: Array | None = None

    def __call__(self, time: Array, values: Array) -> Array:
        """Apply the function to the rows before and these."""
        rows = values.reshape(len(time), -1)
        before = np.repeat(rows[:1], self._memory, axis=0) if self._before is None else self._before
        seen = np.concatenate((before, rows))
        self._before = seen[len(seen) - self._memory :]
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
    """A tap that passes on the last value of before wherever `holds(time)` is true."""

    def __init__(self, holds: Callable[[Array], Flags]) -> None:
        self._holds = holds
        self._last: Array | None = None

    def __call__(self, time: Array, values: Array) -> Array:
        """Replace held rows by the last one that was not."""
        if self._last is None:
            self._last = values[0]
        rows = np.concatenate((self._last[None], values))
        free = np.concatenate((np.ones(1, dtype=np.bool_), ~self._holds(time)))
        source = np.maximum.accumulate(np.where(free, np.arange(len(rows)), 0))
        seen: Array = rows[source]
        self._last = seen[-1]
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


class Fault(Data, frozen=True, kw_only=True, tag_field="kind"):
    """What all faults have in common.

    Attributes
    ----------
    signal : str
        The output that it changes, ``component.output``, for everybody who sees it.
    start : float
        Beginning, s.
    duration : float
        s; by default to the end of the run.
    shape : {"step", "ramp", "smooth", "pulses"}
        Of the envelope.
    rise : float
        How long a ramp rises and falls, or a pulse lasts, s.
    severity : float
        Multiplies the size of the fault.
    """

    signal: str
    start: Level = 0.0
    duration: Positive = float("inf")
    shape: Literal["step", "ramp", "smooth", "pulses"] = "step"
    rise: Positive = 1.0
    severity: Level = 1.0

    @property
    def end(self) -> float:
        """When it is over, s."""
        return self.start + self.duration

    def strength(self, time: Array) -> Array:
        """Envelope times severity (N,) at times (N,); the end itself is free of the fault."""
        # Ends of steps carry rounding; a millionth of a second keeps a sample on its side of the border.
        since, left = time - self.start + 1e-6, self.end - time - 1e-6
        acts = (since >= 0.0) & (left > 0.0)
        if self.shape == "step":
            level = np.ones_like(time)
        elif self.shape == "pulses":
            level = (np.floor(since / self.rise) % 2.0 == 0.0).astype(np.float64)
        else:
            level = np.clip(np.minimum(since, left) / self.rise, 0.0, 1.0)
            if self.shape == "smooth":
                level = 0.5 - 0.5 * np.cos(np.pi * level)
        return np.where(acts, self.severity * level, 0.0)

    def acts(self, time: Array) -> Flags:
        """Whether (N,) there is anything of it at times (N,)."""
        active: Flags = self.strength(time) > 0.0
        return active

    def taps(self, place: Place) -> Mapping[str, Tap]:
        """What it does, by signal.

        Raises
        ------
        ScenarioError
            If it does not fit the signal.
        """
        return {self.signal: self._tap(place)}

    def _tap(self, place: Place) -> Tap:
        raise NotImplementedError


class Stuck(Fault, frozen=True, kw_only=True, tag="stuck"):
    """The value of before the fault is shown as long as it lasts."""

    def _tap(self, place: Place) -> Tap:  # noqa: ARG002
        return Holding(self.acts)


class Bias(Fault, frozen=True, kw_only=True, tag="bias"):
    """`amount` is added: a step of a bias, a hard iron that appears and leaves."""

    amount: Quantities

    def _tap(self, place: Place) -> Tap:
        amount = place.numbers(self.amount)
        return Memoryless(lambda time, values: values + self.strength(time)[:, None] * amount)


class Drift(Fault, frozen=True, kw_only=True, tag="drift"):
    """`rate` times the seconds since the start is added; with the end of the fault it is gone."""

    rate: Quantities

    def _tap(self, place: Place) -> Tap:
        rate = place.numbers_in(self.rate, f"{place.port.unit or '1'}/s")

        def grow(time: Array, values: Array) -> Array:
            grown: Array = values + (self.strength(time) * np.maximum(time - self.start, 0.0))[:, None] * rate
            return grown

        return Memoryless(grow)


class Scale(Fault, frozen=True, kw_only=True, tag="scale"):
    """The value is multiplied by 1 + `error`."""

    error: Quantities

    def _tap(self, place: Place) -> Tap:
        error = place.numbers_in(self.error, "1")
        return Memoryless(lambda time, values: values * (1.0 + self.strength(time)[:, None] * error))


class Noise(Fault, frozen=True, kw_only=True, tag="noise"):
    """White noise of standard deviation `std` is added."""

    std: Quantities

    def _tap(self, place: Place) -> Tap:
        std = place.numbers(self.std)

        def add(time: Array, values: Array) -> Array:
            return values + self.strength(time)[:, None] * std * place.normal(time, place.size)

        return Memoryless(add)


class Saturation(Fault, frozen=True, kw_only=True, tag="saturation"):
    """No element leaves ± `limit` divided by the severity."""

    limit: Quantities

    def _tap(self, place: Place) -> Tap:
        limit = np.abs(place.numbers(self.limit))

        def clip(time: Array, values: Array) -> Array:
            with np.errstate(divide="ignore"):
                bound = limit / self.strength(time)[:, None]
            return np.clip(values, -bound, bound)

        return Memoryless(clip)


class Dropout(Fault, frozen=True, kw_only=True, tag="dropout"):
    """Samples are lost, each with `probability`: they become NaN, or the signal `flag` says that they are."""

    probability: Annotated[float, msgspec.Meta(gt=0.0, le=1.0)] = 1.0
    flag: str | None = None

    def taps(self, place: Place) -> Mapping[str, Tap]:
        """Blank the signal, or lower its flag and keep the last value."""

        def lost(time: Array) -> Flags:
            gone: Flags = place.uniform(time, 1)[:, 0] < self.probability * np.minimum(
                self.strength(time), 1.0
            )
            return gone

        def blank(time: Array, values: Array) -> Array:
            return np.where(lost(time)[:, None], np.nan, values)

        def lower(time: Array, values: Array) -> Array:
            return np.where(lost(time)[:, None], 0.0, values)

        if self.flag is None:
            return {self.signal: Memoryless(blank)}
        return {self.signal: Holding(lost), self.flag: Memoryless(lower)}


class Delay(Fault, frozen=True, kw_only=True, tag="delay"):
    """The value of `time` seconds before is shown, to the nearest sample."""

    time: Positive

    def _tap(self, place: Place) -> Tap:
        memory = max(1, round(self.severity * self.time / place.step))

        def late(time: Array, seen: Array) -> Array:
            rows = np.arange(memory, len(seen))
            back = np.rint(self.strength(time) * self.time / place.step).astype(int)
            shown: Array = seen[rows - np.minimum(back, memory)]
            return shown

        return Remembering(late, memory)


class Jitter(Fault, frozen=True, kw_only=True, tag="jitter"):
    """Each sample is taken up to `time` seconds early: uniformly, interpolated between samples."""

    time: Positive

    def _tap(self, place: Place) -> Tap:
        memory = int(np.ceil(self.severity * self.time / place.step)) + 1

        def early(time: Array, seen: Array) -> Array:
            back = np.minimum(
                self.strength(time) * self.time / place.step * place.uniform(time, 1)[:, 0], memory - 1.0
            )
            whole = back.astype(int)
            part = (back - whole)[:, None]
            rows = np.arange(memory, len(seen))
            between: Array = (1.0 - part) * seen[rows - whole] + part * seen[rows - whole - 1]
            return between

        return Remembering(early, memory)


class Outliers(Fault, frozen=True, kw_only=True, tag="outliers"):
    """With `probability` a sample is off by `amount`, in a random direction for each element."""

    amount: Quantities
    probability: Annotated[float, msgspec.Meta(gt=0.0, le=1.0)] = 0.01

    def _tap(self, place: Place) -> Tap:
        amount = place.numbers(self.amount)

        def hit(time: Array, values: Array) -> Array:
            drawn = place.uniform(time, place.size + 1)
            where = (drawn[:, 0] < self.probability) * self.strength(time)
            signs = np.where(drawn[:, 1:] < 0.5, -1.0, 1.0)
            return values + where[:, None] * signs * amount

        return Memoryless(hit)


class Vibration(Fault, frozen=True, kw_only=True, tag="vibration"):
    """A sine of `amplitude` is added; one above half of the sampling rate shows as its alias."""

    amplitude: Quantities
    frequency: Positive
    phase: float = 0.0

    def _tap(self, place: Place) -> Tap:
        amplitude = place.numbers(self.amplitude)

        def shake(time: Array, values: Array) -> Array:
            wave = np.sin(2.0 * np.pi * self.frequency * time + self.phase)
            return values + (self.strength(time) * wave)[:, None] * amplitude

        return Memoryless(shake)


class Swap(Fault, frozen=True, kw_only=True, tag="swap"):
    """Elements come in another order: [2, 1, 3] exchanges the first two; severity only switches it off."""

    order: list[int]

    def _tap(self, place: Place) -> Tap:
        if sorted(self.order) != list(range(1, place.size + 1)):
            raise ScenarioError(
                f"faults.{place.name}: order = {self.order} must hold each of 1 to {place.size} once"
            )
        source = np.array(self.order) - 1
        return Memoryless(lambda time, values: np.where(self.acts(time)[:, None], values[:, source], values))


class Flip(Fault, frozen=True, kw_only=True, tag="flip"):
    """The sign of some elements, counted from 1, is turned around; severity only switches it off."""

    elements: list[int]

    def _tap(self, place: Place) -> Tap:
        if not set(self.elements) <= set(range(1, place.size + 1)):
            raise ScenarioError(
                f"faults.{place.name}: elements = {self.elements} must be among 1 to {place.size}"
            )
        signs = np.ones(place.size)
        signs[np.array(self.elements, dtype=int) - 1] = -1.0
        return Memoryless(lambda time, values: np.where(self.acts(time)[:, None], signs * values, values))


class QuaternionOrder(Fault, frozen=True, kw_only=True, tag="quaternion-order"):
    """A quaternion is misread: its scalar is given last, or it is given as the inverse rotation."""

    mistake: Literal["scalar-last", "inverse"] = "scalar-last"

    def _tap(self, place: Place) -> Tap:
        if place.size != 4:
            raise ScenarioError(f"faults.{place.name}: {self.signal} is no quaternion")

        def misread(time: Array, values: Array) -> Array:
            wrong = values[:, [1, 2, 3, 0]] if self.mistake == "scalar-last" else values * [1, -1, -1, -1]
            return np.where(self.acts(time)[:, None], wrong, values)

        return Memoryless(misread)


AnyFault = (
    Stuck
    | Bias
    | Drift
    | Scale
    | Noise
    | Saturation
    | Dropout
    | Delay
    | Jitter
    | Outliers
    | Vibration
    | Swap
    | Flip
    | QuaternionOrder
)


def taps(
    faults: Mapping[str, AnyFault], ports: Callable[[str], Port], step: float, seed: int
) -> dict[str, Sequence[Tap]]:
    """Taps of a `System` for faults by name, one after the other in the order of the file.

    Parameters
    ----------
    faults : mapping of str to fault
    ports : callable
        Gives the port of a signal.
    step : float
        Communication step, s.
    seed : int
        Of the random numbers.

    Raises
    ------
    ScenarioError
        If a signal is unknown, or a fault does not fit its signal.
    """
    found: dict[str, list[Tap]] = {}
    for name, fault in faults.items():
        place = Place(name, ports(fault.signal), step, seed)
        for signal, tap in fault.taps(place).items():
            found.setdefault(signal, []).append(tap)
    return dict(found)

"""Faults as data: what can go wrong with a signal on its way, when, and how badly (docs/faults.md).

A fault is read from a scenario file and turned into one or more taps of a `System`. It acts from `start` on
for `duration` seconds; how strongly, between 0 and 1, is its envelope::

    shape = "step"    1 while it lasts
    shape = "ramp"    rises linearly over `rise` seconds, and falls likewise before the end
    shape = "smooth"  the same with a raised cosine
    shape = "pulses"  1 in every second interval of `rise` seconds, beginning with the first

`severity` multiplies what is written in the file: 0 is no fault, 1 the one that is written. Where nothing of
a fault is left, before, after and at severity 0, a signal keeps its bits. Random numbers are functions of
seed, name of the fault and sample alone (`ahrs_fmu.counter_random`), so that a run can be repeated, restored
in the middle and split among processes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, get_args

import msgspec
import numpy as np

from ahrs_fmu import counter_random, quaternion, units
from ahrs_fmu.cosim.chance import Chance
from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.cosim.taps import Flags, Holding, Memoryless, Remembering, Tap, Watching
from ahrs_fmu.errors import ScenarioError, UnitError
from ahrs_fmu.trajectories import Data, Positive

Level = Annotated[float, msgspec.Meta(ge=0.0)]
Severity = Annotated[float, msgspec.Meta(ge=0.0, le=1000.0)]
Lag = Annotated[float, msgspec.Meta(gt=0.0, le=10.0)]
Probability = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Quantity = float | str
"""A number in the unit of the signal, or a text with its own unit."""
Quantities = Quantity | list[Quantity]
"""One for every element of the signal, or one for all of them."""
Change = Callable[[Array, Array, Array], Array]
"""From times (N,), strengths (N, 1) and rows of elements (N, size) to the rows that a fault makes of them."""

_NUMBER, _TRUTH_VALUE, _ENUMERATION = "a number", "a truth value", "an enumeration"
_ROUNDING = 1e-6
"""Ends of steps carry rounding; this keeps a sample on its side of a border, s."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where and in which run a fault acts.

    Attributes
    ----------
    name : str
        Of the fault.
    signal : str
        ``component.output``.
    ports : mapping of str to Port
        Of all signals.
    step : float
        Time between samples, s.
    seed : int
    """

    name: str
    signal: str
    ports: Mapping[str, Port]
    step: float
    seed: int

    @property
    def port(self) -> Port:
        """Unit and shape of the signal."""
        return self.port_of("signal", self.signal)

    @property
    def size(self) -> int:
        """Number of elements of the signal."""
        return int(np.prod(self.port.shape, dtype=int))

    @property
    def kind(self) -> str:
        """What the signal is: a number (also several of them), a truth value or an enumeration."""
        if self.port.boolean:
            return _TRUTH_VALUE
        return _ENUMERATION if self.port.items else _NUMBER

    def port_of(self, key: str, signal: str) -> Port:
        """Unit and shape of the signal that a key names.

        Raises
        ------
        ScenarioError
            If there is none.
        """
        if signal in self.ports:
            return self.ports[signal]
        component, _, output = signal.partition(".")
        of_it = [name for name in self.ports if name.startswith(f"{component}.")]
        if of_it and output:
            outputs = ", ".join(name.partition(".")[2] for name in of_it)
            raise self.error(key, f" = '{signal}': {component} has no such output; it has {outputs}")
        components = dict.fromkeys(name.partition(".")[0] for name in self.ports)
        raise self.error(
            key, f" = '{signal}' is no component.output; the components are {', '.join(components)}"
        )

    def error(self, key: str, says: str) -> ScenarioError:
        """What is wrong with a key of the fault."""
        return ScenarioError(f"faults.{self.name}: {key}{says}")

    def numbers(self, key: str, value: Quantities, unit: str | None = None) -> Array:
        """Read numbers, one per element (size,), in the unit of the signal unless another is given.

        Raises
        ------
        ScenarioError
            If their number or unit does not fit.
        """
        given = value if isinstance(value, list) else [value] * self.size
        if len(given) != self.size:
            raise self.error(
                key,
                f" has {len(given)} numbers, {self.signal} {self.size}: "
                f"give {self.size}, or one for all elements",
            )
        try:
            return np.array(
                [units.quantity(item, self.port.unit if unit is None else unit) for item in given]
            )
        except UnitError as error:
            raise self.error(key, f": {error}") from None

    def elements(self, key: str, value: Sequence[int]) -> list[int]:
        """Positions, from 0, of elements that are counted from 1.

        Raises
        ------
        ScenarioError
            If the signal has no such element.
        """
        if not value or not set(value) <= set(range(1, self.size + 1)):
            raise self.error(key, f" = {list(value)}: the elements of {self.signal} are 1 to {self.size}")
        return [element - 1 for element in value]

    def require_quaternion(self, key: str, signal: str) -> None:
        """Refuse a signal that cannot be a quaternion.

        Raises
        ------
        ScenarioError
            If it has not four pure numbers.
        """
        port = self.port_of(key, signal)
        if port.shape != (4,) or port.unit not in ("", "1"):
            raise self.error(key, f" = '{signal}' is no quaternion: name one such as estimator.q")

    def uniform(self, columns: int) -> Chance:
        """Uniform numbers in (0, 1), `columns` for each sample."""
        return Chance(counter_random.uniform_pair, self.seed, self.name, columns, self.step)

    def normal(self, columns: int) -> Chance:
        """Do as `uniform`, standard normal."""
        return Chance(counter_random.normal_pair, self.seed, self.name, columns, self.step)


class Fault(Data, frozen=True, kw_only=True, tag_field="kind"):
    """What all faults have in common.

    Attributes
    ----------
    signal : str
        The output that it changes, ``component.output``, for everybody who sees it.
    start : float
        Beginning, s: the sample of this time is the first.
    duration : float
        s; by default to the end of the run. The sample at the end is free of the fault.
    shape : {"step", "ramp", "smooth", "pulses"}
        Of the envelope.
    rise : float
        How long a ramp rises and falls, or a pulse lasts, s.
    severity : float
        Multiplies the size of the fault.
    """

    fits: ClassVar[tuple[str, ...]] = (_NUMBER,)
    """What it can be applied to."""

    signal: str
    start: Level = 0.0
    duration: Positive = float("inf")
    shape: Literal["step", "ramp", "smooth", "pulses"] = "step"
    rise: Positive = 1.0
    severity: Severity = 1.0

    @property
    def kind(self) -> str:
        """Name of the kind in a file."""
        return str(self.__struct_config__.tag)

    @property
    def end(self) -> float:
        """When it is over, s."""
        return self.start + self.duration

    def strength(self, time: Array) -> Array:
        """Envelope times severity (N,) at times (N,)."""
        since, left = time - self.start, self.end - time
        if self.shape == "step":
            level = np.ones_like(time)
        elif self.shape == "pulses":
            level = (np.floor((since + _ROUNDING) / self.rise) % 2.0 == 0.0).astype(np.float64)
        else:
            level = np.clip(np.minimum(since, left) / self.rise, 0.0, 1.0)
            if self.shape == "smooth":
                level = 0.5 - 0.5 * np.cos(np.pi * level)
        return np.where((since > -_ROUNDING) & (left > _ROUNDING), self.severity * level, 0.0)

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
        return self._where_it_acts(self._change(place))

    def _change(self, place: Place) -> Change:
        raise NotImplementedError

    def _where_it_acts(self, change: Change) -> Tap:
        """Tap that leaves all other samples as they are, bit for bit."""

        def changed(time: Array, rows: Array) -> Array:
            strength = self.strength(time)
            at = np.flatnonzero(strength > 0.0)
            if not at.size:
                return rows
            seen = rows.copy()
            seen[at] = change(time[at], strength[at, None], rows[at])
            return seen

        return Memoryless(changed)


class Stuck(Fault, frozen=True, kw_only=True, tag="stuck"):
    """The value of before the fault is shown as long as it lasts; severity only switches it off."""

    fits: ClassVar[tuple[str, ...]] = (_NUMBER, _TRUTH_VALUE, _ENUMERATION)

    def _tap(self, place: Place) -> Tap:  # noqa: ARG002
        return Holding(self.acts)


class Bias(Fault, frozen=True, kw_only=True, tag="bias"):
    """`amount` is added: a step of a bias, a hard iron that appears and leaves."""

    amount: Quantities

    def _change(self, place: Place) -> Change:
        amount = place.numbers("amount", self.amount)
        return lambda _, strength, rows: rows + strength * amount


class Drift(Fault, frozen=True, kw_only=True, tag="drift"):
    """`rate` times the seconds since the start is added; with the end of the fault it is gone."""

    rate: Quantities

    def _change(self, place: Place) -> Change:
        rate = place.numbers("rate", self.rate, f"{place.port.unit or '1'}/s")
        return lambda time, strength, rows: rows + strength * (time - self.start)[:, None] * rate


class Scale(Fault, frozen=True, kw_only=True, tag="scale"):
    """The value is multiplied by 1 + `error`."""

    error: Quantities

    def _change(self, place: Place) -> Change:
        error = place.numbers("error", self.error, "1")
        return lambda _, strength, rows: rows * (1.0 + strength * error)


class Noise(Fault, frozen=True, kw_only=True, tag="noise"):
    """White noise of standard deviation `std` is added."""

    std: Quantities

    def _change(self, place: Place) -> Change:
        std, normal = place.numbers("std", self.std), place.normal(place.size)
        return lambda time, strength, rows: rows + strength * std * normal(time)


class Saturation(Fault, frozen=True, kw_only=True, tag="saturation"):
    """No element leaves ± `limit` divided by the strength: half the severity is twice the range."""

    limit: Quantities

    def _change(self, place: Place) -> Change:
        limit = place.numbers("limit", self.limit)
        if (limit < 0.0).any():
            raise place.error("limit", f" = {self.limit} is negative: the range is ± limit")
        return lambda _, strength, rows: np.clip(rows, -limit / strength, limit / strength)


class Dropout(Fault, frozen=True, kw_only=True, tag="dropout"):
    """Samples are lost, each with `probability` times the strength.

    They become NaN. With `flag`, a truth value, they keep the last value instead and the flag says that they
    are not valid. A truth value that is lost is false.
    """

    fits: ClassVar[tuple[str, ...]] = (_NUMBER, _TRUTH_VALUE)

    probability: Probability = 1.0
    flag: str | None = None

    def taps(self, place: Place) -> Mapping[str, Tap]:
        """Blank the signal, or lower its flag and keep the last value."""
        uniform = place.uniform(1)

        def lost(time: Array) -> Flags:
            gone = self.acts(time)
            at = np.flatnonzero(gone)
            if at.size:
                gone[at] = uniform(time[at])[:, 0] < self.probability * self.strength(time[at])
            return gone

        def replaced_by(nothing: float) -> Tap:
            return Memoryless(lambda time, rows: np.where(lost(time)[:, None], nothing, rows))

        if self.flag is None:
            return {self.signal: replaced_by(0.0 if place.port.boolean else np.nan)}
        if not place.port_of("flag", self.flag).boolean:
            raise place.error("flag", f" = '{self.flag}' is no truth value: name one such as imu.mag_valid")
        return {self.signal: Holding(lost), self.flag: replaced_by(0.0)}


class Delay(Fault, frozen=True, kw_only=True, tag="delay"):
    """The value of `time` seconds before is shown, to the nearest sample."""

    fits: ClassVar[tuple[str, ...]] = (_NUMBER, _TRUTH_VALUE, _ENUMERATION)

    time: Lag

    def _tap(self, place: Place) -> Tap:
        if self.time < 0.5 * place.step:
            raise place.error(
                "time",
                f" = {self.time:g} s is less than half a step of {place.step:g} s, and would delay nothing",
            )
        lag = self.time / place.step
        memory = max(1, round(self.severity * lag))

        def late(time: Array, seen: Array) -> Array:
            back = np.rint(self.strength(time) * lag).astype(int)
            shown: Array = seen[memory + np.arange(len(time)) - back]
            return shown

        return Remembering(late, memory)


class Jitter(Fault, frozen=True, kw_only=True, tag="jitter"):
    """Each sample is taken up to `time` seconds early: uniformly, interpolated between samples."""

    time: Lag

    def _tap(self, place: Place) -> Tap:
        lag, uniform = self.time / place.step, place.uniform(1)
        memory = int(np.ceil(self.severity * lag)) + 1

        def early(time: Array, seen: Array) -> Array:
            strength = self.strength(time)
            shown = seen[memory:].copy()
            at = np.flatnonzero(strength > 0.0)
            if at.size:
                back = strength[at] * lag * uniform(time[at])[:, 0]
                whole = back.astype(int)
                part = (back - whole)[:, None]
                rows = memory + at - whole
                shown[at] = (1.0 - part) * seen[rows] + part * seen[rows - 1]
            return shown

        return Remembering(early, memory)


class Outliers(Fault, frozen=True, kw_only=True, tag="outliers"):
    """With `probability` a sample is off by `amount`, up or down at random for each element."""

    amount: Quantities
    probability: Probability = 0.01

    def _change(self, place: Place) -> Change:
        amount, uniform = place.numbers("amount", self.amount), place.uniform(place.size + 1)

        def hit(time: Array, strength: Array, rows: Array) -> Array:
            drawn = uniform(time)
            signs = np.where(drawn[:, 1:] < 0.5, -1.0, 1.0)
            return np.where(drawn[:, :1] < self.probability, rows + strength * signs * amount, rows)

        return hit


class Vibration(Fault, frozen=True, kw_only=True, tag="vibration"):
    """A sine of `amplitude` is added; one above half of the sampling rate shows as its alias."""

    amplitude: Quantities
    frequency: Positive
    phase: float = 0.0

    def _change(self, place: Place) -> Change:
        amplitude = place.numbers("amplitude", self.amplitude)

        def shake(time: Array, strength: Array, rows: Array) -> Array:
            wave = np.sin(2.0 * np.pi * self.frequency * time + self.phase)
            return rows + strength * wave[:, None] * amplitude

        return shake


class Field(Fault, frozen=True, kw_only=True, tag="field"):
    """`amount` (north, east, down) is added to a magnetometer: iron or a current in the room.

    A `bias` turns with the vehicle; this stays where it is, and therefore needs the true `attitude`.
    """

    amount: Quantities
    attitude: str

    def taps(self, place: Place) -> Mapping[str, Tap]:
        """Watch the attitude, and add the field as the body sees it."""
        amount = place.numbers("amount", self.amount)
        if place.size != 3:
            raise place.error("signal", f" = '{self.signal}' has {place.size} elements; a field has 3")
        place.require_quaternion("attitude", self.attitude)
        truth = Watching()

        def add(time: Array, strength: Array, rows: Array) -> Array:
            q = truth.at(time)
            if q is None:
                raise place.error(
                    "attitude",
                    f" = '{self.attitude}' comes after {self.signal}: name what the sensor is given",
                )
            return rows + strength * quaternion.rotate(quaternion.conjugate(q), amount)

        return {self.attitude: truth, self.signal: self._where_it_acts(add)}


class Swap(Fault, frozen=True, kw_only=True, tag="swap"):
    """Elements come in another order: [2, 1, 3] exchanges the first two; severity only switches it off."""

    order: list[int]

    def _change(self, place: Place) -> Change:
        source = place.elements("order", self.order)
        if len(source) != place.size or len(set(source)) != place.size:
            raise place.error("order", f" = {self.order} must hold each of 1 to {place.size} once")
        return lambda _, __, rows: rows[:, source]


class Flip(Fault, frozen=True, kw_only=True, tag="flip"):
    """The sign of some elements, counted from 1, is turned around; severity only switches it off."""

    elements: list[int]

    def _change(self, place: Place) -> Change:
        signs = np.ones(place.size)
        signs[place.elements("elements", self.elements)] = -1.0
        return lambda _, __, rows: signs * rows


class QuaternionOrder(Fault, frozen=True, kw_only=True, tag="quaternion-order"):
    """A quaternion is misread; severity only switches it off.

    Its scalar is given last, or it is given as the inverse rotation.
    """

    mistake: Literal["scalar-last", "inverse"] = "scalar-last"

    def _change(self, place: Place) -> Change:
        place.require_quaternion("signal", self.signal)
        if self.mistake == "scalar-last":
            return lambda _, __, rows: rows[:, [1, 2, 3, 0]]
        return lambda _, __, rows: quaternion.conjugate(rows)


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
    | Field
    | Swap
    | Flip
    | QuaternionOrder
)
KINDS: Mapping[str, type[Fault]] = {str(cls.__struct_config__.tag): cls for cls in get_args(AnyFault)}
"""Kinds of faults by the names that files use."""


def taps(
    faults: Mapping[str, AnyFault], ports: Mapping[str, Port], step: float, seed: int
) -> dict[str, Sequence[Tap]]:
    """Taps of a `System` for faults by name, one after the other in the order of the file.

    Parameters
    ----------
    faults : mapping of str to fault
    ports : mapping of str to Port
        Of all outputs, ``component.output``.
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
        place = Place(name, fault.signal, ports, step, seed)
        if place.kind not in fault.fits:
            fitting = ", ".join(kind for kind, cls in KINDS.items() if place.kind in cls.fits)
            raise place.error(
                "kind", f" = '{fault.kind}' does not fit {fault.signal}, {place.kind}: use one of {fitting}"
            )
        for signal, tap in fault.taps(place).items():
            found.setdefault(signal, []).append(tap)
    return dict(found)

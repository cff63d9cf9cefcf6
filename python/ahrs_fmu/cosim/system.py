"""Several components stepped together: connections by name, data-flow order, recording.

No component's output depends on its inputs of the same instant, so one sweep in the order of the data flow
hands every new output to those that come later (Gauss-Seidel). Where components form a loop, one connection
must hand over the value of the step before: `System.delayed` names it.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ahrs_fmu import units
from ahrs_fmu.cosim.recording import Recording
from ahrs_fmu.cosim.stepper import Array, Grouping, Port, Replayer, Stepper
from ahrs_fmu.cosim.taps import Tap
from ahrs_fmu.errors import AhrsError, ScenarioError, SimulationError, UnitError

Method = Literal["gauss-seidel", "jacobi"]
Signal = Callable[[float], ArrayLike]
"""An input over time: the value that holds during the step that ends at a time in seconds."""


@dataclass(frozen=True, slots=True)
class Connection:
    """From an output to an input, both as ``component.variable``."""

    source: str
    target: str

    @classmethod
    def parse(cls, text: str) -> Connection:
        """Read ``"imu.gyro -> estimator.gyro"``.

        Raises
        ------
        ScenarioError
            If the text has another form.
        """
        parts = [part.strip() for part in text.split("->")]
        if len(parts) != 2 or not all(part.count(".") == 1 for part in parts):
            raise ScenarioError(f"connection '{text}' is not of the form component.output -> component.input")
        return cls(*parts)

    def __str__(self) -> str:
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True, slots=True)
class SavedSystem:
    """State of a `System`."""

    steps: int
    values: Mapping[tuple[str, str], Array]
    states: Mapping[str, object]
    taps: Mapping[tuple[str, str], Sequence[object]]


@dataclass(frozen=True, slots=True)
class _Link:
    """A checked connection."""

    connection: Connection
    source: str
    output: str
    target: str
    input: str
    factor: float


class System:
    """Components that step together.

    Parameters
    ----------
    components : mapping of str to Stepper
        By the name that connections use.
    connections : sequence of Connection or str
        ``"imu.gyro -> estimator.gyro"``; an input takes one connection or one drive.
    step : float
        Communication step, s.
    drives : mapping of str to value or callable
        Inputs that no component drives, as ``component.input``: a constant, or a function of the time at
        which a step ends.
    start_values : sequence of str
        Inputs that may stay at the value they start with.
    taps : mapping of str to sequence of Tap, optional
        By output, ``component.output``: what becomes of it, one after the other, before anybody else sees it.
    order : sequence of str, optional
        Order of the sweep; by default that of the data flow.
    method : {"gauss-seidel", "jacobi"}
        Jacobi hands over every value one step late, whatever the order.

    Raises
    ------
    ScenarioError
        Unknown component or variable, shapes or units that do not fit, an input driven twice or not at all.
    """

    def __init__(
        self,
        components: Mapping[str, Stepper],
        connections: Sequence[Connection | str],
        *,
        step: float,
        drives: Mapping[str, ArrayLike | Signal] = MappingProxyType({}),
        start_values: Sequence[str] = (),
        taps: Mapping[str, Sequence[Tap]] = MappingProxyType({}),
        order: Sequence[str] | None = None,
        method: Method = "gauss-seidel",
    ) -> None:
        if not (np.isfinite(step) and step > 0.0):
            raise ScenarioError(f"step = {step} s; the communication step must be positive")
        self.components = dict(components)
        self._grouping = {name: s for name, s in self.components.items() if isinstance(s, Grouping)}
        self._drives = dict(drives)
        self.step_size = step
        self.method = method
        parsed = [c if isinstance(c, Connection) else Connection.parse(c) for c in connections]
        self._links = links = [self._link(connection) for connection in parsed]
        self._links_to = {name: [link for link in links if link.target == name] for name in self.components}
        self._drives_of: dict[str, list[tuple[str, Signal]]] = {name: [] for name in self.components}
        for name, drive in drives.items():
            component, variable = self._split(name, "inputs")
            self._drives_of[component].append((variable, _signal(drive)))
        self._taps = {self._split(name, "outputs"): list(chain) for name, chain in taps.items()}
        self._check_inputs(start_values)
        self.order = list(order) if order is not None else self._data_flow()
        if sorted(self.order) != sorted(self.components):
            raise ScenarioError(
                f"order {', '.join(self.order)} must name {', '.join(self.components)} once each"
            )
        self._read = {
            name: list(dict.fromkeys(link.output for link in links if link.source == name))
            for name in self.components
        }
        # A tap sees every sample, whether or not somebody else does: it may tell another tap of it.
        for component, output in self._taps:
            if output not in self._read[component]:
                self._read[component].append(output)
        self._values: dict[tuple[str, str], Array] = {}
        self._steps = 0

    @property
    def time(self) -> float:
        """Time that all components have reached, s."""
        return self._steps * self.step_size

    @property
    def connections(self) -> list[Connection]:
        """All connections."""
        return [link.connection for link in self._links]

    @property
    def drives(self) -> Mapping[str, ArrayLike | Signal]:
        """Constants and functions of time by the input they drive, ``component.input``."""
        return MappingProxyType(self._drives)

    @property
    def tapped_outputs(self) -> list[str]:
        """The outputs, ``component.output``, that a tap changes."""
        return [f"{component}.{output}" for (component, output), chain in self._taps.items() if chain]

    @property
    def delayed(self) -> list[Connection]:
        """The connections that hand over the value of the step before."""
        position = {name: i for i, name in enumerate(self.order)}
        return [
            link.connection
            for link in self._links
            if self.method == "jacobi" or position[link.source] >= position[link.target]
        ]

    def advance(self) -> None:
        """Step every component once.

        Raises
        ------
        SimulationError
            If a component refuses; it names the component and the time, and carries the component's words.
        """
        end = (self._steps + 1) * self.step_size
        if self._steps == 0:
            self._values = self._initial_values()
        values = dict(self._values)
        seen = self._values if self.method == "jacobi" else values
        for name in self.order:
            stepper = self.components[name]
            try:
                self._set(name, self._inputs_of(name, seen, end))
                stepper.step(self.step_size)
                for output, value in self._get(name, self._read[name]).items():
                    values[name, output] = self._tapped(name, output, value, end)
            except AhrsError as error:
                raise SimulationError(f"{name} failed in the step to {end:.9g} s: {error}") from error
        self._values = values
        self._steps += 1

    def run(
        self,
        duration: float,
        record: Iterable[str],
        progress: Callable[[int], None] | None = None,
    ) -> Recording:
        """Step over `duration` seconds and record signals.

        Parameters
        ----------
        duration : float
            Seconds; rounded to whole steps.
        record : iterable of str
            Outputs as ``component.output``, after their taps.
        progress : callable, optional
            Called with 1 after every step.

        Returns
        -------
        Recording
            Row k holds the outputs after step k + 1. When a component fails, the rows before are in the
            exception's ``recording``.

        Raises
        ------
        SimulationError
            If a component refuses.
        """
        names = list(record)
        wanted = [self._split(name, "outputs") for name in names]
        rows = round(duration / self.step_size)
        time: Array = self.step_size * np.arange(self._steps + 1, self._steps + rows + 1, dtype=np.float64)
        for component, output in wanted:
            if output not in self._read[component]:
                self._read[component].append(output)
        began = clock.perf_counter()
        if rows and self._is_a_chain():
            found = self._run_chain(time)
            if progress is not None:
                progress(rows)
            return _recording(time, names, [found[key] for key in wanted], self, began)
        columns = [np.full((rows, *self.port(name).shape), np.nan) for name in names]
        for row in range(rows):
            try:
                self.advance()
            except SimulationError as error:
                error.recording = _recording(time[:row], names, columns, self, began)
                raise
            for key, column in zip(wanted, columns, strict=True):
                column[row] = self._values[key]
            if progress is not None:
                progress(1)
        return _recording(time, names, columns, self, began)

    @contextmanager
    def tapped(self, signal: str, tap: Tap) -> Iterator[None]:
        """Let an output, ``component.output``, go through one more tap within this context.

        Raises
        ------
        ScenarioError
            If there is no such output.
        """
        key = self._split(signal, "outputs")
        before = self._taps.get(key)
        self._taps[key] = [*(before or ()), tap]
        try:
            yield
        finally:
            del self._taps[key]
            if before is not None:
                self._taps[key] = before

    def save(self) -> SavedSystem:
        """Return the state of all components, for `restore`."""
        states = {name: stepper.save() for name, stepper in self.components.items()}
        taps = {key: [tap.save() for tap in chain] for key, chain in self._taps.items()}
        return SavedSystem(self._steps, dict(self._values), states, taps)

    def restore(self, saved: SavedSystem) -> None:
        """Continue from what `save` returned."""
        self._steps = saved.steps
        self._values = dict(saved.values)
        for name, stepper in self.components.items():
            stepper.restore(saved.states[name])
        for key, chain in self._taps.items():
            for tap, state in zip(chain, saved.taps[key], strict=True):
                tap.restore(state)

    def reset(self) -> None:
        """Bring every component back to its start."""
        for stepper in self.components.values():
            stepper.reset()
        for chain in self._taps.values():
            for tap in chain:
                tap.reset()
        self._steps = 0

    def port(self, signal: str) -> Port:
        """Unit and shape of an output, ``component.output``.

        Raises
        ------
        ScenarioError
            If there is no such output.
        """
        component, output = self._split(signal, "outputs")
        return self.components[component].outputs[output]

    def _split(self, name: str, kind: Literal["inputs", "outputs"]) -> tuple[str, str]:
        component, _, variable = name.partition(".")
        if component not in self.components:
            raise ScenarioError(
                f"'{name}': there is no component '{component}'; there are {', '.join(self.components)}"
            )
        ports = self.components[component].inputs if kind == "inputs" else self.components[component].outputs
        if variable not in ports:
            raise ScenarioError(f"'{name}': {component} has no such {kind[:-1]}; it has {', '.join(ports)}")
        return component, variable

    def _link(self, connection: Connection) -> _Link:
        source, output = self._split(connection.source, "outputs")
        target, variable = self._split(connection.target, "inputs")
        given, taken = self.components[source].outputs[output], self.components[target].inputs[variable]
        if given.shape != taken.shape:
            raise ScenarioError(f"{connection}: the output has shape {given.shape}, the input {taken.shape}")
        try:
            factor = units.factor(given.unit, taken.unit)
        except UnitError as error:
            raise ScenarioError(f"{connection}: {error}") from error
        return _Link(connection, source, output, target, variable, factor)

    def _check_inputs(self, start_values: Sequence[str]) -> None:
        driven = [link.connection.target for link in self._links]
        driven += [f"{name}.{variable}" for name, drives in self._drives_of.items() for variable, _ in drives]
        if twice := [name for name in driven if driven.count(name) > 1]:
            raise ScenarioError(f"{twice[0]} is driven twice: leave one connection or drive")
        for name in start_values:
            self._split(name, "inputs")
        inputs = [
            f"{name}.{variable}" for name, stepper in self.components.items() for variable in stepper.inputs
        ]
        if missing := [name for name in inputs if name not in driven and name not in start_values]:
            raise ScenarioError(
                f"nothing drives {', '.join(missing)}: connect it, drive it or list it as start value"
            )

    def _data_flow(self) -> list[str]:
        """Sources first; in a loop the component that was named first leads."""
        order: list[str] = []
        waiting = list(self.components)
        while waiting:
            free = [
                n
                for n in waiting
                if all(link.source not in waiting or link.source == n for link in self._links_to[n])
            ]
            order.append((free or waiting)[0])
            waiting.remove(order[-1])
        return order

    def _inputs_of(self, name: str, values: Mapping[tuple[str, str], Array], end: float) -> dict[str, Array]:
        given: dict[str, Array] = {}
        for link in self._links_to[name]:
            value = values.get((link.source, link.output))
            if value is not None:
                given[link.input] = value if link.factor == 1.0 else link.factor * value
        for variable, signal in self._drives_of[name]:
            given[variable] = np.asarray(signal(end), dtype=np.float64)
        return given

    def _set(self, name: str, values: Mapping[str, Array]) -> None:
        if name in self._grouping:
            self._grouping[name].set_all(values)
        else:
            for variable, value in values.items():
                self.components[name].set(variable, value)

    def _get(self, name: str, outputs: Sequence[str]) -> Mapping[str, Array]:
        if name in self._grouping:
            return self._grouping[name].get_all(outputs)
        return {output: self.components[name].get(output) for output in outputs}

    def _initial_values(self) -> dict[tuple[str, str], Array]:
        """Outputs before the first step that somebody uses a step late."""
        delayed = {connection.source for connection in self.delayed}
        keys = {(link.source, link.output) for link in self._links if link.connection.source in delayed}
        # In the order of the sweep: a tap may need what another has seen.
        ordered = [(name, output) for name in self.order for output in self._read[name]]
        return {
            (name, output): self._tapped(name, output, self.components[name].get(output), 0.0)
            for name, output in ordered
            if (name, output) in keys
        }

    def _tapped(self, component: str, output: str, value: Array, end: float) -> Array:
        chain = self._taps.get((component, output))
        if chain is None:
            return value
        seen: Array = _through(chain, np.array([end]), np.asarray(value)[None])[0]
        return seen

    def _is_a_chain(self) -> bool:
        """Whether no signal returns to where it came from and no component can fail on the way."""
        return not self.delayed and all(
            isinstance(stepper, Replayer) and stepper.never_fails for stepper in self.components.values()
        )

    def _run_chain(self, time: Array) -> dict[tuple[str, str], Array]:
        """Take all steps of one component after the other, which gives what stepping all of them gives."""
        rows = len(time)
        found: dict[tuple[str, str], Array] = {}
        for name in self.order:
            stepper = self.components[name]
            assert isinstance(stepper, Replayer)
            given = {}
            for link in self._links_to[name]:
                column = found[link.source, link.output]
                given[link.input] = column if link.factor == 1.0 else link.factor * column
            for variable, signal in self._drives_of[name]:
                given[variable] = np.array([signal(end) for end in time.tolist()], dtype=np.float64)
            try:
                columns = stepper.replay(given, self._read[name], self.step_size, rows)
                for output, column in columns.items():
                    found[name, output] = _through(self._taps.get((name, output), ()), time, column)
            except AhrsError as error:
                raise SimulationError(f"{name} failed before {time[-1]:.9g} s: {error}") from error
        self._values = {key: column[-1] for key, column in found.items()}
        self._steps += rows
        return found


def _through(chain: Sequence[Tap], time: Array, values: Array) -> Array:
    for tap in chain:
        values = tap(time, values)
    return values


def _signal(drive: ArrayLike | Signal) -> Signal:
    if callable(drive):
        return drive
    constant = np.asarray(drive, dtype=np.float64)
    return lambda _: constant


def _recording(
    time: Array, names: Sequence[str], columns: Sequence[Array], system: System, began: float
) -> Recording:
    rows = len(time)
    return Recording(
        time=time,
        signals={name: column[:rows] for name, column in zip(names, columns, strict=True)},
        units={name: system.port(name).unit for name in names},
        wall_time=clock.perf_counter() - began,
    )

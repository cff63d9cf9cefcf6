"""The C core, or its numpy twin, as a stepper: the code of an FMU without the FMU."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu.cosim.clock import SampleClock
from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.descriptors import Descriptor, Variable
from ahrs_fmu.errors import ParameterError, known_names
from ahrs_fmu.estimators.model import NumpyModel
from ahrs_fmu.host_library import Precision
from ahrs_fmu.native import NativeModel


@dataclass(frozen=True, slots=True)
class SavedCore:
    """State of a `CoreStepper`."""

    memory: bytes
    started: bool
    fraction: float


class CoreStepper:
    """An instance of a model behind the `Stepper` protocol, with the timing of its FMU.

    Parameters
    ----------
    descriptor : Descriptor
        The model.
    parameters : mapping of str to value, optional
        Parameters that differ from their defaults; an enumeration by the name of its item.
    precision : {"double", "single"}, optional
        Floating-point type of the C code.
    back_end : {"c", "numpy"}, optional
        What computes.

    Raises
    ------
    ParameterError
        A parameter is unknown or refused, or the model has no such back-end.
    """

    never_fails = True

    def __init__(
        self,
        descriptor: Descriptor,
        parameters: Mapping[str, object] | None = None,
        precision: Precision = "double",
        back_end: Literal["c", "numpy"] = "c",
    ) -> None:
        self.descriptor = descriptor
        self.precision = precision
        self.back_end = back_end
        given = parameters or {}
        values = {v.name: descriptor.numbers(v, given.get(v.name, v.default)) for v in descriptor.parameters}
        for name in given:
            descriptor.parameter(name)
        descriptor.check(values)
        self._model = NativeModel(descriptor, precision) if back_end == "c" else NumpyModel(descriptor)
        for name, value in values.items():
            self._model.set(name, value)
        self.sample_time = float(values["sample_time"][0])
        self._clock = SampleClock(self.sample_time)
        self._variables = {v.name: _port(descriptor, v) for v in descriptor.variables}
        self._inputs = {v.name: self._variables[v.name] for v in descriptor.inputs}
        self._outputs = {v.name: self._variables[v.name] for v in descriptor.outputs}
        self._fresh = self._model.save()
        self.reset()

    @property
    def inputs(self) -> Mapping[str, Port]:
        """The input variables."""
        return self._inputs

    @property
    def outputs(self) -> Mapping[str, Port]:
        """The output variables."""
        return self._outputs

    def set(self, name: str, value: ArrayLike) -> None:
        """Set an input."""
        port = self._port(name, self._inputs, "input")
        array = np.asarray(value, dtype=np.float64)
        if array.shape != port.shape:
            raise ParameterError(f"{name} has shape {array.shape}; expected {port.shape}")
        self._model.set(name, np.atleast_1d(array))

    def get(self, name: str) -> Array:
        """Return a variable as it is now."""
        port = self._port(name, self._variables, "variable")
        if not self._started:
            self._initialise()
            self._model.compute_outputs()
        return np.asarray(self._model.get(name), dtype=np.float64).reshape(port.shape)

    def step(self, dt: float) -> None:
        """Run the samples of the next `dt` seconds with the same inputs; outputs hold between samples."""
        ticks = self._clock.advance(dt)
        self._start()
        for _ in range(ticks):
            self._model.update(self.sample_time)
        self._model.compute_outputs()

    def save(self) -> SavedCore:
        """Return the complete state."""
        return SavedCore(self._model.save(), self._started, self._clock.fraction)

    def restore(self, state: SavedCore) -> None:
        """Continue from what `save` returned."""
        self._model.restore(state.memory)
        self._started = state.started
        self._clock.fraction = state.fraction

    def reset(self) -> None:
        """Return to the state of a fresh instance with the same parameters."""
        self._model.restore(self._fresh)
        self._model.reset()
        self._started = False
        self._clock.fraction = 0.0

    def replay(
        self, inputs: Mapping[str, Array], outputs: Sequence[str], dt: float, rows: int | None = None
    ) -> dict[str, Array]:
        """Take a whole record; see `ahrs_fmu.cosim.stepper.Replayer`."""
        rows = len(next(iter(inputs.values()))) if rows is None else rows
        for name in (*inputs, *outputs):
            self._port(name, self._variables, "variable")
        ticks = self._clock.advance_often(dt, rows)
        if rows and not self._started:
            for name, values in inputs.items():
                self.set(name, values[0])
            self._start()
        # The outputs before the first tick are the present ones.
        self._model.compute_outputs()
        before = {
            name: np.asarray(self._model.get(name), dtype=np.float64).reshape(self._variables[name].shape)
            for name in outputs
        }
        columns = {name: np.repeat(np.asarray(values), ticks, axis=0) for name, values in inputs.items()}
        found = self._model.run(np.full(ticks.sum(), self.sample_time), columns, outputs)
        last = np.cumsum(ticks) - 1
        return {
            name: _held(np.asarray(column, dtype=np.float64), last, before[name])
            for name, column in found.items()
        }

    def _start(self) -> None:
        if not self._started:
            self._initialise()
            self._started = True

    def _initialise(self) -> None:
        """Take the first state from the inputs present, as an FMU does when asked during initialisation."""
        self._model.reset()
        self._model.update(0.0)

    def _port(self, name: str, ports: Mapping[str, Port], role: str) -> Port:
        try:
            return ports[name]
        except KeyError:
            known = known_names(name, ports)
            raise ParameterError(f"{self.descriptor.title} has no {role} {name!r}; it has {known}") from None


def _held(column: Array, last: NDArray[np.intp], before: Array) -> Array:
    """Rows of a column by the number of the last sample, -1 where none has been taken."""
    if last.size and last[0] >= 0:
        return column[last]
    held: Array = np.concatenate((before[None], column))[last + 1]
    return held


def _port(descriptor: Descriptor, variable: Variable) -> Port:
    items = descriptor.enumeration_of(variable).items if variable.type == "enumeration" else []
    return Port(
        variable.unit,
        () if variable.size == 1 else (variable.size,),
        {item.name: item.value for item in items},
        variable.type == "boolean",
    )

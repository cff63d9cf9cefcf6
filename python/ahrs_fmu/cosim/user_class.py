"""A user's own class as a stepper: what its exported FMU does, without the FMU."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ahrs_fmu.component import Component, describe, numbers_of
from ahrs_fmu.cosim.clock import SampleClock
from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.descriptors import Variable
from ahrs_fmu.errors import ParameterError, ScenarioError, SimulationError
from ahrs_fmu.serve.resources import load_class


class ClassStepper:
    """An instance of a user's class behind the `Stepper` protocol.

    Parameters
    ----------
    cls : type
        Derived from `ahrs_fmu.component.Component`.
    parameters : mapping of str to value
        Those that differ from their defaults.

    Raises
    ------
    ParameterError
        A parameter is unknown or refused.
    """

    def __init__(self, cls: type[Component], parameters: Mapping[str, object]) -> None:
        self.cls, self._parameters = cls, dict(parameters)
        self.descriptor = describe(cls)
        given = {name: self.descriptor.parameter(name) for name in parameters}
        values = {v.name: self.descriptor.numbers(v, v.default) for v in self.descriptor.parameters}
        values |= {name: self.descriptor.numbers(given[name], value) for name, value in parameters.items()}
        self.descriptor.check(values)
        self._clock = SampleClock(values["sample_time"][0])
        self._variables = {v.name: v for v in self.descriptor.variables}
        self.inputs: Mapping[str, Port] = {v.name: self._port(v) for v in self.descriptor.inputs}
        self.outputs: Mapping[str, Port] = {v.name: self._port(v) for v in self.descriptor.outputs}
        self.reset()

    def set(self, name: str, value: ArrayLike) -> None:
        """Set an input."""
        variable, numbers = self._input(name), np.asarray(value, dtype=np.float64).reshape(-1)
        if variable.type != "real":
            value = bool(numbers[0]) if variable.type == "boolean" else int(numbers[0])
        elif variable.size == 1:
            value = float(numbers[0])
        setattr(self._instance, name, self._instance.accepted(name, value))

    def get(self, name: str) -> Array:
        """Return a variable as it is now."""
        if name in self.outputs:
            self._start()
        variable = self._variables[name]
        numbers = numbers_of(self.descriptor, variable, getattr(self._instance, name))
        return np.asarray(numbers, dtype=np.float64).reshape(self._port(variable).shape)

    def step(self, dt: float) -> None:
        """Update once for every sample time in `dt` seconds.

        Raises
        ------
        SimulationError
            If the class raises.
        """
        ticks = self._clock.advance(dt)
        self._start()
        for _ in range(ticks):
            self._guarded(lambda: self._instance.update(self._clock.sample_time))

    def save(self) -> object:
        """Return a copy of the instance."""
        return copy.deepcopy(self._instance), self._started, self._clock.fraction

    def restore(self, state: Any) -> None:
        """Continue from what `save` returned."""
        instance, self._started, self._clock.fraction = state
        self._instance = copy.deepcopy(instance)

    def reset(self) -> None:
        """Begin anew with a new instance."""
        self._instance = self.cls()
        self._started = False
        self._clock.fraction = 0.0
        for name, value in self._parameters.items():
            setattr(self._instance, name, self._instance.accepted(name, value))

    def _start(self) -> None:
        if not self._started:
            self._started = True
            self._guarded(self._instance.initialise)

    def _guarded(self, call: Any) -> None:
        try:
            call()
        # Whatever a user's class raises is the failure of this component.
        except Exception as error:
            raise SimulationError(f"{self.descriptor.title}: {type(error).__name__}: {error}") from error

    def _input(self, name: str) -> Variable:
        if name not in self.inputs:
            raise ParameterError(
                f"{self.descriptor.title} has no input '{name}'; it has {', '.join(self.inputs)}"
            )
        return self._variables[name]

    def _port(self, variable: Variable) -> Port:
        items = self.descriptor.enumeration_of(variable).items if variable.type == "enumeration" else []
        shape = () if variable.size == 1 else (variable.size,)
        names = {item.name: item.value for item in items}
        return Port(variable.unit, shape, names, variable.type == "boolean")


def load_class_of(folder: Path, source: str) -> type[Component]:
    """Load ``FILE:CLASS`` relative to a folder.

    Raises
    ------
    ScenarioError
        If the text is of another form.
    DescriptorError
        If the file has no such class.
    """
    file, _, name = source.rpartition(":")
    if not file:
        raise ScenarioError(f"'{source}' is not of the form FILE:CLASS, such as my_filter.py:MyFilter")
    return load_class((folder / file).resolve(), name)

"""A Python model as the FMU sees it: numbers in the order of the value references."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import descriptors
from ahrs_fmu.component import Component, declarations, describe, numbers_of, readable
from ahrs_fmu.descriptors import Descriptor, Role, Variable
from ahrs_fmu.errors import DescriptorError
from ahrs_fmu.estimators.model import NumpyModel
from ahrs_fmu.serve.resources import load_class, read

Numbers = NDArray[np.float64]
Slot = tuple[Variable, slice]


class Model(Protocol):
    """What the messages ask for."""

    descriptor: Descriptor

    def start(self, parameters: Numbers, inputs: Numbers) -> None:
        """State as at the first instant."""

    def tune(self, parameters: Numbers) -> None:
        """Take over parameters during a run."""

    def run(self, inputs: Numbers, ticks: int, dt: float) -> None:
        """Take in the inputs `ticks` times; the array is the model's to keep."""

    def outputs(self, into: Numbers) -> None:
        """Write the outputs."""

    def save(self) -> bytes:
        """Everything the run depends on."""

    def restore(self, saved: bytes) -> None:
        """Become what `save` kept."""


def slots(descriptor: Descriptor, role: Role) -> list[Slot]:
    """Variables of a role in the order of their value references, with the places of their elements."""
    found: list[Slot] = []
    position = 0
    for variable in descriptor.variables:
        if descriptor.role(variable) == role:
            found.append((variable, slice(position, position + variable.size)))
            position += variable.size
    return found


def size(found: list[Slot]) -> int:
    """Number of elements."""
    return found[-1][1].stop if found else 0


class ServedEstimator:
    """A numpy filter of this package."""

    def __init__(self, name: str) -> None:
        self.descriptor = descriptors.load(name)
        self._model = NumpyModel(self.descriptor)
        self._parameters = slots(self.descriptor, "parameter")
        self._tuned: Numbers | None = None
        self._outputs = [
            (v.name, at if v.size > 1 else at.start) for v, at in slots(self.descriptor, "output")
        ]
        self._inputs = [
            (v.name, at if v.size > 1 else at.start, v.type == "real")
            for v, at in slots(self.descriptor, "input")
        ]

    def start(self, parameters: Numbers, inputs: Numbers) -> None:
        """Initialise from the sensors, where they are usable."""
        self.tune(parameters)
        self._model.reset()
        self.run(inputs, 1, 0.0)

    def tune(self, parameters: Numbers) -> None:
        """Take over parameters."""
        for variable, at in self._parameters:
            if self._tuned is None or not np.array_equal(parameters[at], self._tuned[at]):
                self._model.set(variable.name, parameters[at])
        self._tuned = parameters

    def run(self, inputs: Numbers, ticks: int, dt: float) -> None:
        """Take in the inputs `ticks` times."""
        self._model.set_inputs(
            {
                name: inputs[at] if is_real else np.array(inputs[at] != 0.0)
                for name, at, is_real in self._inputs
            }
        )
        for _ in range(ticks):
            self._model.update(dt)

    def outputs(self, into: Numbers) -> None:
        """Write the outputs."""
        now = self._model.outputs()
        for name, at in self._outputs:
            into[at] = now[name]

    def save(self) -> bytes:
        """Parameters, inputs and state."""
        return self._model.save()

    def restore(self, saved: bytes) -> None:
        """Become what `save` kept."""
        self._model.restore(saved)
        self._tuned = None


class ServedComponent:
    """An instance of a user's class; every run has a new one."""

    def __init__(self, cls: type[Component]) -> None:
        self.descriptor = describe(cls)
        self._class = cls
        self._instance = cls()
        self._parameters = slots(self.descriptor, "parameter")
        self._inputs = slots(self.descriptor, "input")
        self._outputs = [(v, at if v.size > 1 else at.start) for v, at in slots(self.descriptor, "output")]
        self._attributes = 0

    def start(self, parameters: Numbers, inputs: Numbers) -> None:
        """Begin a run with a new instance."""
        self._instance = self._class()
        self._write(self._parameters, parameters)
        self._write(self._inputs, inputs)
        self._instance.initialise()
        self._attributes = len(vars(self._instance))

    def tune(self, parameters: Numbers) -> None:
        """Take over parameters."""
        self._write(self._parameters, parameters)

    def run(self, inputs: Numbers, ticks: int, dt: float) -> None:
        """Update `ticks` times with the inputs held."""
        self._write(self._inputs, inputs)
        for _ in range(ticks):
            self._instance.update(dt)
        if len(vars(self._instance)) > self._attributes:
            self._refuse_new_attribute()

    def outputs(self, into: Numbers) -> None:
        """Write the outputs."""
        values = vars(self._instance)
        for variable, at in self._outputs:
            value = values[variable.name]
            into[at] = value if type(value) is float else numbers_of(self.descriptor, variable, value)

    def save(self) -> bytes:
        """Declared variables, and what the class says its state is."""
        values = vars(self._instance)
        declared = {name: values[name] for name in declarations(self._class)}
        return pickle.dumps((declared, self._attributes, self._instance.save()))

    def restore(self, saved: bytes) -> None:
        """Become what `save` kept."""
        declared, attributes, state = pickle.loads(saved)
        instance = self._class()
        vars(instance).update(declared)
        instance.restore(state)
        self._instance, self._attributes = instance, attributes

    def _write(self, found: list[Slot], numbers: Numbers) -> None:
        values = vars(self._instance)
        for variable, at in found:
            if variable.type == "real":
                values[variable.name] = numbers[at].copy() if variable.size > 1 else float(numbers[at.start])
            else:
                values[variable.name] = readable(self.descriptor, variable, numbers[at].tolist())

    def _refuse_new_attribute(self) -> None:
        name = list(vars(self._instance))[self._attributes]
        raise AttributeError(
            f"update() has made the attribute '{name}', which is neither declared nor set in initialise(): "
            "set it there, or correct its name"
        )


def load(folder: Path) -> Model:
    """Load the model of an FMU's resources.

    Raises
    ------
    DescriptorError
        If it is not the model that the FMU was built from.
    """
    given = read(folder)
    model: Model = (
        ServedComponent(load_class(folder / given.module, given.model))
        if given.module
        else ServedEstimator(given.model)
    )
    if model.descriptor.fingerprint() != given.fingerprint:
        raise DescriptorError(
            f"{given.model} has other variables than when the FMU was built: "
            "build it again with the installed ahrs-fmu"
        )
    return model

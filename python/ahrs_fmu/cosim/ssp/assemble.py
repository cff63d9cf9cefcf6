"""From the `Structure` of a package and its FMUs to a `System`."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ahrs_fmu import units
from ahrs_fmu.cosim.fmu import Fmu, FmuStepper
from ahrs_fmu.cosim.ssp.interface import Interface
from ahrs_fmu.cosim.ssp.structure import Structure, Value, whole
from ahrs_fmu.cosim.ssp.wiring import Wiring
from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.cosim.system import Connection, Method, Signal, System
from ahrs_fmu.errors import AhrsError, ScenarioError, UnitError

Numbers = Mapping[str, float]
"""Numbers by scalar, in the units of the FMU."""


def assemble(
    structure: Structure,
    fmus: Mapping[str, Fmu],
    *,
    step: float | None,
    method: Method | None,
    inputs: Mapping[str, ArrayLike | Signal],
) -> System:
    """Instantiate the FMUs, by component, and connect them; see `ahrs_fmu.cosim.ssp.read_ssp`.

    Raises
    ------
    ScenarioError
        If the structure does not fit the FMUs, or something is missing.
    """
    stepping = structure.stepping
    if step is None:
        if stepping is None:
            raise ScenarioError("there is no communication step in the package: pass step, in seconds")
        step = stepping.step
    interfaces = {name: Interface(fmu) for name, fmu in fmus.items()}
    wiring = Wiring(structure, interfaces)
    numbers = _numbers(structure, interfaces)
    external = {whole(name) for name in wiring.inputs}
    if unknown := sorted(inputs.keys() - external):
        known = ", ".join(sorted(external)) or "none"
        raise ScenarioError(f"the package has no input '{unknown[0]}'; it has {known}")
    connections: list[Connection] = []
    drives: dict[str, ArrayLike | Signal] = {}
    start_values: list[str] = []
    for component, interface in interfaces.items():
        for variable in interface.variables("input"):
            target = f"{component}.{variable}"
            source = wiring.source(component, variable)
            if source is not None and source.element:
                connections.append(Connection(str(source), target))
            elif source is not None and source.connector in inputs:
                drives[target] = inputs[source.connector]
            elif source is not None:
                scalars = [name for name in wiring.inputs if whole(name) == source.connector]
                drives[target] = _given(structure, scalars, interface, variable)
            elif (value := _array(interface, variable, numbers[component])) is not None:
                drives[target] = value
            else:
                start_values.append(target)
    steppers = {
        name: _instantiate(name, fmu, _parameters(interfaces[name], numbers[name]))
        for name, fmu in fmus.items()
    }
    return System(
        steppers,
        connections,
        step=step,
        drives=drives,
        start_values=start_values,
        order=list(steppers) if stepping else None,
        method=method or (stepping.method if stepping else "gauss-seidel"),
    )


def _numbers(structure: Structure, interfaces: Mapping[str, Interface]) -> dict[str, Numbers]:
    """Values of parameters and inputs by component."""
    own = {connector.name for connector in structure.connectors}
    unknown = [name for name in structure.values if name not in own]
    found: dict[str, Numbers] = {}
    for component in structure.components:
        interface = interfaces[component.name]
        numbers = {}
        for scalar, value in component.values.items():
            name = f"{component.name}.{scalar}"
            if scalar not in interface:
                unknown.append(name)
            elif interface.causality(scalar) in ("parameter", "input"):
                numbers[scalar] = _number(interface, scalar, value, name)
            else:
                raise ScenarioError(f"parameter '{name}': the FMU's variable is no parameter and no input")
        found[component.name] = numbers
    if unknown:
        names = ", ".join(unknown)
        warnings.warn(f"parameters that name nothing in the system are ignored: {names}", stacklevel=2)
    return found


def _given(structure: Structure, scalars: list[str], interface: Interface, variable: str) -> Array:
    """What the package says of its own input, for the variable that it drives."""
    if missing := [scalar for scalar in scalars if scalar not in structure.values]:
        name = whole(missing[0])
        raise ScenarioError(
            f"nothing drives '{name}', an input of the package: pass inputs={{'{name}': value or function}}"
        )
    targets = interface.scalars(variable)
    numbers = {
        target: _number(interface, target, structure.values[scalar], scalar)
        for scalar, target in zip(scalars, targets, strict=True)
    }
    return np.reshape([numbers[target] for target in targets], interface.shape(variable))


def _instantiate(name: str, fmu: Fmu, parameters: Mapping[str, Array]) -> FmuStepper:
    try:
        return fmu.instantiate(parameters)
    except AhrsError as error:
        raise ScenarioError(f"component '{name}': {error}") from error


def _parameters(interface: Interface, numbers: Numbers) -> dict[str, Array]:
    found = {name: _array(interface, name, numbers) for name in interface.variables("parameter")}
    return {name: value for name, value in found.items() if value is not None}


def _array(interface: Interface, variable: str, numbers: Numbers) -> Array | None:
    """Value of a whole variable, where an element has a number; the others are as the FMU declares."""
    scalars = interface.scalars(variable)
    if not any(scalar in numbers for scalar in scalars):
        return None
    elements = [numbers[scalar] if scalar in numbers else interface.start(scalar) for scalar in scalars]
    return np.reshape(elements, interface.shape(variable))


def _number(interface: Interface, scalar: str, value: Value, name: str) -> float:
    """A value as the number that the FMU takes."""
    expected, given = interface.type(scalar), value.value
    if expected == "Enumeration" and isinstance(given, str):
        items = interface.items(scalar)
        if given not in items:
            raise ScenarioError(f"parameter '{name}' = '{given}' is not one of {', '.join(items)}")
        return float(items[given])
    fits = value.type == expected or (value.type == "Integer" and expected in ("Real", "Enumeration"))
    if not fits or isinstance(given, str):
        raise ScenarioError(f"parameter '{name}' is {value.type}; the FMU's variable is {expected}")
    try:
        return float(given) * _factor(value.unit, interface.unit(scalar))
    except UnitError as error:
        raise ScenarioError(f"parameter '{name}': {error}") from None


def _factor(unit: str, declared: str) -> float:
    # Units of other tools need not be known as long as there is nothing to convert.
    return 1.0 if unit in ("", declared or "1") else units.factor(unit, declared)

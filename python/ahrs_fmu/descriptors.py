"""The only reader of the model descriptors.

A descriptor is the TOML file ``fmu_src/models/NAME/NAME.toml``. It is the single place where a
model's parameters, inputs, outputs and states have their name, unit, default, limits and meaning.
Estimators share ``fmu_src/estimator/estimator.toml``, which a model names as its ``interface``.
"""

from __future__ import annotations

import hashlib
import math
import sys
import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Literal

import msgspec
from msgspec import Struct

from ahrs_fmu.errors import DescriptorError, ParameterError, known_names
from ahrs_fmu.rules import Rule
from ahrs_fmu.sources import fmu_src

Type = Literal["real", "integer", "boolean", "enumeration"]
Role = Literal["parameter", "input", "output"]
Scalar = bool | int | float | str
Value = Scalar | list[float]

TIME_VR = 0
"""Value reference of the independent variable in every model."""


class Item(Struct, frozen=True, forbid_unknown_fields=True):
    """One item of an enumeration."""

    name: str
    value: int
    description: str


class Enumeration(Struct, frozen=True, forbid_unknown_fields=True):
    """A named set of choices."""

    description: str
    items: list[Item]

    def names(self) -> list[str]:
        """Names of the items, in order."""
        return [item.name for item in self.items]


class Variable(Struct, frozen=True, forbid_unknown_fields=True):
    """A parameter, an input or an output.

    Attributes
    ----------
    name, description, unit, display_unit : str
        Unit is SI; the display unit is what people read.
    vr : int
        Value reference of the first element; element i has ``vr + i``.
    size : int
        Number of elements; 1 is a scalar.
    default : bool, int, float, str or list of float
        Start value; the item's name for an enumeration.
    min, max : float or None
        Limits; ``min_open`` and ``max_open`` exclude the limit itself.
    tunable : bool
        Whether a parameter may change during the run.
    optional : bool
        Whether a model may leave this output of the common interface out.
    """

    name: str
    vr: int
    default: Value
    description: str
    type: Type = "real"
    size: int = 1
    unit: str = ""
    display_unit: str = ""
    enumeration: str = ""
    min: float | None = None
    max: float | None = None
    min_open: bool = False
    max_open: bool = False
    allow_infinite: bool = False
    tunable: bool = False
    optional: bool = False


class Limit(Struct, frozen=True, forbid_unknown_fields=True):
    """A rule between parameters, with the reason and the way out."""

    rule: str
    says: str
    warning: bool = False


class State(Struct, frozen=True, forbid_unknown_fields=True):
    """A field of the state."""

    name: str
    description: str
    type: Literal["real", "integer"] = "real"
    size: int = 1
    unit: str = ""


class _File(Struct, frozen=True, forbid_unknown_fields=True):
    """A descriptor file as written."""

    name: str
    description: str
    title: str = ""
    summary: str = ""
    interface: str = ""
    provides: list[str] = []
    enumeration: dict[str, Enumeration] = {}
    parameter: list[Variable] = []
    input: list[Variable] = []
    output: list[Variable] = []
    limit: list[Limit] = []
    state: list[State] = []


class Interface(Struct, frozen=True):
    """What a family of models shares."""

    name: str
    enumerations: dict[str, Enumeration]
    parameters: list[Variable]
    inputs: list[Variable]
    outputs: list[Variable]
    limits: list[Limit]
    states: list[State]


class Descriptor(Struct, frozen=True):
    """A model: its own variables and those of its interface.

    Attributes
    ----------
    name, title : str
        ``gcf`` in files and C names, ``GCF`` for people and importers.
    interface : Interface or None
        The common part, whose variables come first in `parameters`, `inputs` and `outputs`.
    folder : Path
        Where the model's sources are.
    """

    name: str
    title: str
    summary: str
    description: str
    interface: Interface | None
    enumerations: dict[str, Enumeration]
    parameters: list[Variable]
    inputs: list[Variable]
    outputs: list[Variable]
    limits: list[Limit]
    states: list[State]
    folder: Path

    @property
    def variables(self) -> list[Variable]:
        """Every variable in ascending order of its value reference."""
        return sorted([*self.parameters, *self.inputs, *self.outputs], key=lambda variable: variable.vr)

    @property
    def default_sample_time(self) -> float:
        """Default of ``sample_time`` in seconds."""
        return _as_float(self.parameter("sample_time").default)

    def parameter(self, name: str) -> Variable:
        """Parameter by name.

        Raises
        ------
        ParameterError
            If the model has no such parameter; the message lists the known ones.
        """
        for variable in self.parameters:
            if variable.name == name:
                return variable
        known = known_names(name, (variable.name for variable in self.parameters))
        raise ParameterError(f"{self.title} has no parameter '{name}'; it has {known}")

    def role(self, variable: Variable) -> Role:
        """Whether `variable` is a parameter, an input or an output."""
        if variable in self.inputs:
            return "input"
        return "output" if variable in self.outputs else "parameter"

    def own(self, variables: Sequence[Variable]) -> list[Variable]:
        """Those of `variables` that the interface does not bring."""
        if self.interface is None:
            return list(variables)
        shared = {
            v.name for v in (*self.interface.parameters, *self.interface.inputs, *self.interface.outputs)
        }
        return [variable for variable in variables if variable.name not in shared]

    def enumeration_of(self, variable: Variable) -> Enumeration:
        """Enumeration that `variable` takes its values from."""
        return self.enumerations[variable.enumeration]

    def numbers(self, variable: Variable, value: object) -> list[float]:
        """Check one value and give its elements as numbers.

        Parameters
        ----------
        variable : Variable
            A parameter or an input of this model.
        value : bool, int, float, str or sequence of float
            The item's name, or its number, for an enumeration.

        Raises
        ------
        ParameterError
            If the value has the wrong type or size or is outside the limits.
        """
        elements = _elements(value) if variable.size > 1 else [value]
        if len(elements) != variable.size:
            raise ParameterError(
                f"{variable.name} = {value!r} has {len(elements)} elements; it takes {variable.size}"
            )
        return [self._number(variable, element) for element in elements]

    def _number(self, variable: Variable, value: object) -> float:
        if variable.type == "enumeration":
            return float(self._item(variable, value))
        if variable.type == "boolean":
            if not isinstance(value, bool) and value not in (0, 1):
                raise ParameterError(
                    f"{variable.name} = {value!r} is not a truth value; it takes true or false"
                )
            return float(bool(value))
        try:
            number = float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise ParameterError(f"{variable.name} = {value!r} is not a number") from None
        if variable.type == "integer" and not number.is_integer():
            raise ParameterError(f"{variable.name} = {value!r} is not a whole number")
        _check_range(variable, number)
        return number

    def _item(self, variable: Variable, value: object) -> int:
        enumeration = self.enumeration_of(variable)
        for item in enumeration.items:
            if value == item.name or (value == item.value and not isinstance(value, bool)):
                return item.value
        raise ParameterError(f"{variable.name} = {value!r} is not one of {', '.join(enumeration.names())}")

    def check(
        self, values: Mapping[str, Sequence[float]], epsilon: float = sys.float_info.epsilon
    ) -> list[Limit]:
        """Check the rules between parameters.

        Parameters
        ----------
        values : mapping of str to sequence of float
            The elements of every parameter, as `numbers` gives them.
        epsilon : float
            Relative rounding of the precision that the model will run in; double by default.

        Returns
        -------
        list of Limit
            The rules that only warn and do not hold.

        Raises
        ------
        ParameterError
            If another rule does not hold.
        """
        scope = {v.name: values[v.name] if v.size > 1 else values[v.name][0] for v in self.parameters}
        items = {item.name: item.value for e in self.enumerations.values() for item in e.items}
        broken = [limit for limit in self.limits if not Rule(limit.rule).holds(scope, items, epsilon)]
        for limit in broken:
            if not limit.warning:
                given = ", ".join(
                    f"{n} = {self._shown(n, scope[n])}" for n in Rule(limit.rule).names if n in scope
                )
                raise ParameterError(f"{limit.rule} does not hold ({given}): {limit.says}")
        return broken

    def fingerprint(self) -> str:
        """Hash of what two sides that exchange values without names must agree on."""
        rows = [(v.name, v.vr, v.size, v.type, self.role(v)) for v in self.variables]
        items = {name: enumeration.items for name, enumeration in self.enumerations.items()}
        return hashlib.sha256(msgspec.json.encode([rows, items], order="deterministic")).hexdigest()

    def _shown(self, name: str, value: object) -> str:
        variable = self.parameter(name)
        if variable.type == "enumeration":
            return next(item.name for item in self.enumeration_of(variable).items if item.value == value)
        return f"{value:g}" if isinstance(value, float) else str(value)


def _as_float(value: Value) -> float:
    if isinstance(value, (str, list)):
        raise DescriptorError(f"{value!r} is not a number")
    return float(value)


def _elements(value: object) -> list[object]:
    if isinstance(value, str):
        value = value.strip("[] ").replace(",", " ").split()
    try:
        return list(value)  # type: ignore[call-overload, no-any-return]
    except TypeError:
        return [value]


def _check_range(variable: Variable, number: float) -> None:
    infinite = math.isinf(number) and number > 0 and variable.allow_infinite
    low, high = variable.min, variable.max
    too_low = low is not None and (number <= low if variable.min_open else number < low)
    too_high = high is not None and (number >= high if variable.max_open else number > high)
    if not infinite and (not math.isfinite(number) or too_low or too_high):
        raise ParameterError(
            f"{variable.name} = {number:g} {variable.unit}".rstrip()
            + f" is refused: it must be {range_text(variable)}"
        )


def range_text(variable: Variable) -> str:
    """Words for the limits of `variable`."""
    low = "" if variable.min is None else f"{'above' if variable.min_open else 'at least'} {variable.min:g}"
    high = "" if variable.max is None else f"{'below' if variable.max_open else 'at most'} {variable.max:g}"
    return " and ".join(part for part in (low, high) if part) or "a finite number"


def _load(path: Path) -> _File:
    try:
        with path.open("rb") as file:
            return msgspec.convert(tomllib.load(file), _File)
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise DescriptorError(f"{path.name}: {error}") from error


@cache
def interface(name: str) -> Interface:
    """Common part `name` of a family of models."""
    file = _load(fmu_src() / name / f"{name}.toml")
    return Interface(
        name=name,
        enumerations=file.enumeration,
        parameters=file.parameter,
        inputs=file.input,
        outputs=file.output,
        limits=file.limit,
        states=file.state,
    )


def read(path: Path) -> Descriptor:
    """Read the descriptor file at `path`.

    Raises
    ------
    DescriptorError
        If the file is not a valid descriptor.
    """
    file = _load(path)
    shared = interface(file.interface) if file.interface else None
    outputs = (
        [] if shared is None else [o for o in shared.outputs if not o.optional or o.name in file.provides]
    )
    descriptor = Descriptor(
        name=file.name,
        title=file.title or file.name,
        summary=file.summary,
        description=" ".join(file.description.split()),
        interface=shared,
        enumerations={**(shared.enumerations if shared else {}), **file.enumeration},
        parameters=[*(shared.parameters if shared else []), *file.parameter],
        inputs=[*(shared.inputs if shared else []), *file.input],
        outputs=[*outputs, *file.output],
        limits=[*(shared.limits if shared else []), *file.limit],
        states=file.state,
        folder=path.parent,
    )
    _check_provided(descriptor, file)
    check_declarations(descriptor, f"{descriptor.name}.toml")
    return descriptor


def _check_provided(descriptor: Descriptor, file: _File) -> None:
    if descriptor.interface is not None:
        optional = {o.name for o in descriptor.interface.outputs if o.optional}
        if unknown := sorted(set(file.provides) - optional):
            raise DescriptorError(
                f"{descriptor.name}.toml: provides {unknown[0]}, which is no optional output of the interface"
            )


def check_declarations(descriptor: Descriptor, where: str) -> None:
    """Check that the declarations of a model agree with each other; `where` stands in the message.

    Raises
    ------
    DescriptorError
        If they do not.
    """
    names = [variable.name for variable in descriptor.variables]
    if twice := [name for name in names if names.count(name) > 1]:
        raise DescriptorError(f"{where}: {twice[0]} is declared twice")
    taken = {TIME_VR: "time"}
    for variable in descriptor.variables:
        for vr in range(variable.vr, variable.vr + variable.size):
            if vr in taken:
                raise DescriptorError(f"{where}: {variable.name} and {taken[vr]} share value reference {vr}")
            taken[vr] = variable.name
        if variable.type == "enumeration" and variable.enumeration not in descriptor.enumerations:
            raise DescriptorError(
                f"{where}: {variable.name} names the unknown enumeration '{variable.enumeration}'"
            )
        if (variable.type == "enumeration") != bool(variable.enumeration):
            raise DescriptorError(f"{where}: {variable.name} is no enumeration but names one")
        if variable.size > 1 and variable.type != "real":
            raise DescriptorError(f"{where}: {variable.name} is an array, which only a real variable can be")
        try:
            descriptor.numbers(variable, variable.default)
        except ParameterError as error:
            raise DescriptorError(f"{where}: default {error}") from error
    known = {p.name for p in descriptor.parameters} | {
        i.name for e in descriptor.enumerations.values() for i in e.items
    }
    for limit in descriptor.limits:
        if unknown := [name for name in Rule(limit.rule).names if name not in known]:
            raise DescriptorError(f"{where}: rule '{limit.rule}' names the unknown parameter '{unknown[0]}'")
    descriptor.check({p.name: descriptor.numbers(p, p.default) for p in descriptor.parameters})


def names() -> list[str]:
    """Every model that has a descriptor, in alphabetical order."""
    return sorted(path.parent.name for path in (fmu_src() / "models").glob("*/*.toml"))


@cache
def load(name: str) -> Descriptor:
    """Descriptor of the model `name`.

    Raises
    ------
    ParameterError
        If there is no such model; the message lists the known ones.
    """
    path = fmu_src() / "models" / name / f"{name}.toml"
    if not path.is_file():
        raise ParameterError(f"there is no model '{name}'; there are {', '.join(names())}")
    return read(path)

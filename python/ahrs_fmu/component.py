"""A user's own model as a Python class, ready to be exported as an FMU.

A class names its parameters, inputs and outputs; the methods `Component.initialise` and `Component.update`
compute the outputs::

    class Smoother(Component):
        \"\"\"First-order low-pass.\"\"\"

        crossover = Parameter(2.0, unit="rad/s", min=0.0, tunable=True, description="Crossover frequency")
        signal = Input(unit="m/s2", description="What is smoothed")
        smooth = Output(unit="m/s2", description="The smoothed signal")

        def initialise(self) -> None:
            self.smooth = self.signal

        def update(self, dt: float) -> None:
            self.smooth += self.crossover * dt * (self.signal - self.smooth)
"""

from __future__ import annotations

import inspect
import keyword
import pickle
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu.descriptors import (
    Descriptor,
    Enumeration,
    Item,
    Limit,
    Role,
    Type,
    Value,
    Variable,
    check_declarations,
)
from ahrs_fmu.errors import DescriptorError, ParameterError

FIRST_VR: Mapping[Role, int] = {"input": 1, "output": 10_001, "parameter": 20_001}
"""Value reference of a class's first input, output and parameter; what is declared later follows."""

_LARGEST_SIZE = 10_000
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
# fmt: off
_C_KEYWORDS = frozenset({
    "auto", "bool", "break", "case", "char", "const", "continue", "default", "do", "double", "else",
    "enum", "extern", "false", "float", "for", "goto", "if", "inline", "int", "long", "offsetof",
    "register", "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch", "true",
    "typedef", "union", "unsigned", "void", "volatile", "while", "time", "unused",
})
# fmt: on


class Declaration:
    """A variable of a `Component` class; use `Parameter`, `Input` or `Output`.

    Parameters
    ----------
    default : bool, float, str or sequence of float
        Start value. A truth value makes the variable Boolean, a name makes it one of `choices`.
    unit, display_unit : str
        SI unit such as ``rad/s``, and the unit for people, such as ``deg/s``.
    size : int, optional
        Number of elements; by default that of `default`.
    description : str
        What it means.
    min, max : float, optional
        Limits. Real inputs are never refused, whatever the limits: a sensor may say anything.
    integer : bool
        Whether the value is a whole number.
    choices : mapping of str to str, optional
        The names it can have, with what they mean.
    """

    role: ClassVar[Role]

    def __init__(
        self,
        default: Value | Sequence[float] = 0.0,
        *,
        unit: str = "",
        display_unit: str = "",
        size: int | None = None,
        description: str = "",
        min: float | None = None,  # noqa: A002
        max: float | None = None,  # noqa: A002
        integer: bool = False,
        choices: Mapping[str, str] | None = None,
    ) -> None:
        self.default = default
        self.unit = unit
        self.display_unit = display_unit
        self.size = size
        self.description = description
        self.min = min
        self.max = max
        self.integer = integer
        self.choices = choices
        self.tunable = False
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: object | None, owner: type) -> Any:
        return self if instance is None else instance.__dict__[self.name]

    def __set__(self, instance: Component, value: object) -> None:
        instance.__dict__[self.name] = instance.accepted(self.name, value)

    @property
    def type(self) -> Type:
        """Type of the variable."""
        if self.choices is not None:
            return "enumeration"
        if isinstance(self.default, bool):
            return "boolean"
        return "integer" if self.integer else "real"

    def variable(self, vr: int) -> Variable:
        """The variable as a descriptor has it, with its value reference."""
        elements = (
            None if isinstance(self.default, (bool, int, float, str)) else [float(x) for x in self.default]
        )
        size = self.size or (len(elements) if elements is not None else 1)
        default: Value = elements if elements is not None else self.default  # type: ignore[assignment]
        if size > 1 and elements is None:
            default = [float(default)] * size  # type: ignore[arg-type]
        return Variable(
            name=self.name,
            vr=vr,
            default=default[0] if size == 1 and isinstance(default, list) else default,
            description=_one_line(self.description),
            type=self.type,
            size=size,
            unit=self.unit,
            display_unit=self.display_unit,
            enumeration=self.name if self.choices is not None else "",
            min=self.min,
            max=self.max,
            tunable=self.tunable,
        )


class Parameter(Declaration):
    """A value that is set before a run; `tunable` lets it be changed during the run as well.

    The other arguments are those of `Declaration`.
    """

    role = "parameter"

    def __init__(
        self,
        default: Value | Sequence[float],
        *,
        unit: str = "",
        display_unit: str = "",
        size: int | None = None,
        description: str = "",
        min: float | None = None,  # noqa: A002
        max: float | None = None,  # noqa: A002
        integer: bool = False,
        choices: Mapping[str, str] | None = None,
        tunable: bool = False,
    ) -> None:
        super().__init__(
            default,
            unit=unit,
            display_unit=display_unit,
            size=size,
            description=description,
            min=min,
            max=max,
            integer=integer,
            choices=choices,
        )
        self.tunable = tunable


class Input(Declaration):
    """A value that comes from outside and holds until it is set again."""

    role = "input"


class Output(Declaration):
    """A value that `Component.initialise` and `Component.update` compute."""

    role = "output"


class Component:
    """Base of a user's own model.

    A derived class declares its variables as class attributes. Inside its methods a variable is an ordinary
    attribute: a float, a bool, an int, the name of a choice, or an array where it has several elements.
    Everything else that has to be kept from one update to the next is an attribute set in `initialise`.

    The first paragraph of the class's docstring becomes the summary, the rest the description of the FMU.

    Raises
    ------
    DescriptorError
        If a declaration is wrong.
    """

    sample_time = Parameter(
        0.01, unit="s", min=1e-5, max=10.0, description="Time from one update to the next"
    )

    limits: ClassVar[Sequence[Limit]] = ()
    """Rules between parameters, such as ``Limit("crossover*sample_time < 1", "lower the crossover")``."""

    def __init__(self) -> None:
        descriptor = describe(type(self))
        for variable in descriptor.variables:
            self.__dict__[variable.name] = self.accepted(variable.name, variable.default)

    def initialise(self) -> None:
        """Begin a run: set the state and the outputs at the first instant, from the parameters and inputs."""

    def update(self, dt: float) -> None:
        """Take in the inputs, `dt` seconds after the last time, and compute the outputs."""
        raise NotImplementedError(f"{type(self).__name__} does not define update(dt)")

    def save(self) -> bytes:
        """Everything besides the declared variables that a run depends on, as bytes for `restore`.

        By default all attributes, pickled; override both methods where an attribute cannot be pickled.
        """
        declared = declarations(type(self))
        return pickle.dumps({name: value for name, value in vars(self).items() if name not in declared})

    def restore(self, saved: bytes) -> None:
        """Take over what `save` returned."""
        declared = declarations(type(self))
        kept = {name: value for name, value in vars(self).items() if name in declared}
        self.__dict__.clear()
        self.__dict__.update(kept | pickle.loads(saved))

    def accepted(self, name: str, value: object) -> object:
        """Check a value for the variable `name` and give it as this class's methods see it.

        Raises
        ------
        ParameterError
            If the value has the wrong type or size, or is outside the limits of a parameter.
        """
        variable, role = _variables(type(self))[name]
        if variable.type == "real" and role != "parameter":
            if variable.size == 1 and isinstance(value, float):
                return float(value)
            try:
                numbers = np.array(value, dtype=np.float64)
            except (TypeError, ValueError):
                raise ParameterError(f"{name} = {value!r} is not a number") from None
            if numbers.size != variable.size:
                raise ParameterError(f"{name} has {variable.size} elements; {numbers.size} are given")
            return numbers.reshape(variable.size) if variable.size > 1 else float(numbers.reshape(-1)[0])
        descriptor = describe(type(self))
        return readable(descriptor, variable, descriptor.numbers(variable, value))


def readable(descriptor: Descriptor, variable: Variable, numbers: Sequence[float]) -> object:
    """Elements of a variable as the methods of a class see them: a scalar, a name, or an array of its own."""
    if variable.size > 1:
        kinds = {"real": np.float64, "integer": np.int64, "boolean": np.bool_}
        return np.array(numbers, dtype=kinds.get(variable.type, np.float64))
    number = float(numbers[0])
    if variable.type == "enumeration":
        return next(item.name for item in descriptor.enumeration_of(variable).items if item.value == number)
    if variable.type == "boolean":
        return number != 0.0
    return int(number) if variable.type == "integer" else number


def numbers_of(descriptor: Descriptor, variable: Variable, value: object) -> float | NDArray[np.generic]:
    """A variable's number or array of numbers, the reverse of `readable`.

    Raises
    ------
    ParameterError
        If the value is no name of a choice, or of the wrong size.
    """
    if variable.type == "enumeration":
        return descriptor.numbers(variable, value)[0]
    numbers: NDArray[np.generic] = np.asarray(value)
    if numbers.size != variable.size:
        raise ParameterError(f"{variable.name} has {variable.size} elements; {numbers.size} are given")
    return numbers if variable.size > 1 else numbers.reshape(())


def declarations(cls: type[Component]) -> dict[str, Declaration]:
    """Declared variables of a class by name, those of its base classes first."""
    found: dict[str, Declaration] = {}
    for base in reversed(cls.__mro__):
        found |= {name: value for name, value in vars(base).items() if isinstance(value, Declaration)}
    return found


_described: dict[type[Component], Descriptor] = {}
_named: dict[type[Component], dict[str, tuple[Variable, Role]]] = {}


def _variables(cls: type[Component]) -> dict[str, tuple[Variable, Role]]:
    if cls not in _named:
        descriptor = describe(cls)
        _named[cls] = {v.name: (v, descriptor.role(v)) for v in descriptor.variables}
    return _named[cls]


def describe(cls: type[Component]) -> Descriptor:
    """Descriptor of a class: the same as of a model that comes with a TOML file.

    Raises
    ------
    DescriptorError
        If a declaration is wrong.
    """
    if cls not in _described:
        _described[cls] = _describe(cls)
    return _described[cls]


def _describe(cls: type[Component]) -> Descriptor:
    if cls.update is Component.update:
        raise DescriptorError(f"{cls.__name__} does not define update(self, dt)")
    declared = declarations(cls)
    variables: dict[Role, list[Variable]] = {"input": [], "output": [], "parameter": []}
    vrs = dict(FIRST_VR)
    for name, declaration in declared.items():
        _check_name(cls, name)
        role = declaration.role
        try:
            variable = declaration.variable(vrs[role])
        except (TypeError, ValueError):
            raise DescriptorError(
                f"{cls.__name__}.{name}: default {declaration.default!r} is no value"
            ) from None
        vrs[role] += variable.size
        if vrs[role] >= FIRST_VR[role] + _LARGEST_SIZE:
            raise DescriptorError(
                f"{cls.__name__}.{name}: a class has at most {_LARGEST_SIZE - 1} {role} elements"
            )
        variables[role].append(variable)
    summary, _, rest = inspect.cleandoc(cls.__doc__ or cls.__name__).partition("\n\n")
    descriptor = Descriptor(
        name=re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower(),
        title=cls.__name__,
        summary=_one_line(summary).rstrip("."),
        description=_one_line(rest),
        interface=None,
        enumerations={n: _enumeration(d) for n, d in declared.items() if d.choices is not None},
        parameters=variables["parameter"],
        inputs=variables["input"],
        outputs=variables["output"],
        limits=list(cls.limits),
        states=[],
        folder=Path(),
    )
    if not descriptor.outputs:
        raise DescriptorError(f"{cls.__name__} declares no Output")
    _check_names_in_c(descriptor)
    check_declarations(descriptor, cls.__name__)
    return descriptor


def _enumeration(declaration: Declaration) -> Enumeration:
    choices = declaration.choices or {}
    items = [Item(name, value, _one_line(text)) for value, (name, text) in enumerate(choices.items())]
    return Enumeration(_one_line(declaration.description), items)


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _check_name(cls: type[Component], name: str) -> None:
    if not _NAME.fullmatch(name) or name in _C_KEYWORDS or keyword.iskeyword(name):
        raise DescriptorError(
            f"{cls.__name__}.{name}: a name begins with a letter, then letters, digits, underscores, "
            "and is no word of C: choose another"
        )


def _check_names_in_c(descriptor: Descriptor) -> None:
    for name, enumeration in descriptor.enumerations.items():
        for item in enumeration.items:
            if not _NAME.fullmatch(item.name):
                raise DescriptorError(
                    f"{descriptor.title}.{name}: the choice '{item.name}' is refused: "
                    "use letters, digits and underscores"
                )

"""The scalars of an FMU as SSP sees them."""

from __future__ import annotations

from collections.abc import Mapping

from ahrs_fmu.cosim.fmu import Fmu
from ahrs_fmu.cosim.ssp.structure import Connector, Type, Value, scalars, whole
from ahrs_fmu.errors import ScenarioError

_TYPES: Mapping[str, Type] = {
    "Real": "Real",
    "Float64": "Real",
    "Float32": "Real",
    "Integer": "Integer",
    "Int32": "Integer",
    "Int64": "Integer",
    "Boolean": "Boolean",
    "Enumeration": "Enumeration",
}
_BASE_UNIT = {
    "kg": 0,
    "m": 0,
    "s": 0,
    "A": 0,
    "K": 0,
    "mol": 0,
    "cd": 0,
    "rad": 0,
    "factor": 1.0,
    "offset": 0.0,
}


class Interface:
    """What an FMU declares about its scalars.

    Parameters
    ----------
    fmu : Fmu
        The FMU; it need not stay open.
    """

    def __init__(self, fmu: Fmu) -> None:
        self._fmu = fmu
        self._declared = {whole(v.name): v for v in fmu.description.modelVariables}
        self._starts = {v.name: v.start for v in fmu.description.modelVariables}
        self._scalars = {
            scalar: variable.name
            for variable in fmu.variables.values()
            for scalar in scalars(variable.name, variable.shape)
        }
        self.units: dict[str, dict[str, float]] = {
            unit.name: {
                key: getattr(unit.baseUnit, key)
                for key, neutral in _BASE_UNIT.items()
                if getattr(unit.baseUnit, key) != neutral
            }
            for unit in fmu.description.unitDefinitions
            if unit.baseUnit is not None
        }
        """Base units of those units that have them: a noise density does not."""

    def __contains__(self, scalar: str) -> bool:
        return scalar in self._scalars

    def names(self) -> list[str]:
        """All scalars."""
        return list(self._scalars)

    def variables(self, causality: str) -> list[str]:
        """Variables, arrays as a whole, of a causality such as ``input``."""
        return [v.name for v in self._fmu.variables.values() if v.causality == causality]

    def shape(self, variable: str) -> tuple[int, ...]:
        """Shape of a variable."""
        return self._fmu.variables[variable].shape

    def scalars(self, variable: str) -> list[str]:
        """Scalars of a variable."""
        return scalars(variable, self.shape(variable))

    def causality(self, scalar: str) -> str:
        """Causality of a scalar."""
        return self._fmu.variables[self._scalars[scalar]].causality

    def type(self, scalar: str) -> Type:
        """Type of a scalar."""
        return _TYPES[self._declared[self._scalars[scalar]].type]

    def unit(self, scalar: str) -> str:
        """Unit of a scalar, empty for a pure number."""
        return self._fmu.variables[self._scalars[scalar]].unit

    def items(self, scalar: str) -> Mapping[str, int]:
        """Items of an enumeration."""
        return self._fmu.variables[self._scalars[scalar]].items

    def connector(self, scalar: str) -> Connector:
        """The connector of a scalar."""
        type_ = self.type(scalar)
        enumeration = (
            self._declared[self._scalars[scalar]].declaredType.name if type_ == "Enumeration" else ""
        )
        return Connector(scalar, self.causality(scalar), type_, self._written_unit(scalar), enumeration)

    def value(self, scalar: str, number: float) -> Value:
        """A number as the value of a scalar."""
        type_ = self.type(scalar)
        if type_ == "Real":
            return Value(type_, float(number), self._written_unit(scalar))
        if type_ == "Boolean":
            return Value(type_, number != 0.0)
        if type_ == "Integer":
            return Value(type_, int(number))
        names = [name for name, value in self.items(scalar).items() if value == number]
        if not names:
            raise ScenarioError(f"{scalar} = {number:g} is not one of {', '.join(self.items(scalar))}")
        return Value(type_, names[0])

    def start(self, scalar: str) -> float:
        """What a parameter or input starts with, as a number."""
        variable = self._scalars[scalar]
        # FMI 3 lists the values of an array, or one for all.
        texts = str(self._starts.get(scalar, self._declared[variable].start)).split()
        text = texts[0] if len(texts) == 1 else texts[self.scalars(variable).index(scalar)]
        return float(text in ("true", "1")) if self.type(scalar) == "Boolean" else float(text)

    def _written_unit(self, scalar: str) -> str:
        unit = self.unit(scalar)
        return unit if unit in self.units and self.type(scalar) == "Real" else ""

"""The connections of a package: checked against its FMUs, by direction, whole arrays at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from ahrs_fmu.cosim.ssp.interface import Interface
from ahrs_fmu.cosim.ssp.structure import Connector, End, Link, Structure, whole
from ahrs_fmu.errors import ScenarioError


class Wiring:
    """What each input is connected to.

    Parameters
    ----------
    structure : Structure
        The package.
    interfaces : mapping of str to Interface
        What the FMU of each component declares.

    Raises
    ------
    ScenarioError
        If a connector is not what the FMU declares, or a connection is wrong or not supported.
    """

    def __init__(self, structure: Structure, interfaces: Mapping[str, Interface]) -> None:
        self._interfaces = interfaces
        self._connectors = {"": structure.connectors} | {c.name: c.connectors for c in structure.components}
        for component in structure.components:
            for connector in component.connectors:
                _check_connector(component.name, connector, interfaces[component.name])
        self.inputs = [c.name for c in structure.connectors if c.kind == "input"]
        """Scalar inputs of the package."""
        self._sources: dict[End, End] = {}
        for link in structure.links:
            source, target = self._directed(link)
            if target in self._sources:
                other = self._sources[target]
                raise ScenarioError(f"connection {link}: {target} is connected to {other} already")
            # An output of the package has no part in the run.
            if target.element:
                self._check_units(link, source, target)
                self._sources[target] = source

    def source(self, component: str, variable: str) -> End | None:
        """What a whole input is connected to: an output, an input of the package, or nothing.

        Raises
        ------
        ScenarioError
            If only some elements of an array are connected, or in another order.
        """
        targets = [End(component, scalar) for scalar in self._interfaces[component].scalars(variable)]
        sources = [self._sources[target] for target in targets if target in self._sources]
        if not sources:
            return None
        first = End(sources[0].element, whole(sources[0].connector))
        expected = [End(first.element, name) for name in self._scalars(first)]
        if sources != expected or len(sources) != len(targets):
            raise ScenarioError(
                f"{component}.{variable} is connected to {', '.join(map(str, sources))}: "
                "only all elements of an array in their order are supported"
            )
        return first

    def _scalars(self, end: End) -> list[str]:
        if end.element:
            return self._interfaces[end.element].scalars(end.connector)
        return [name for name in self.inputs if whole(name) == end.connector]

    def _directed(self, link: Link) -> tuple[End, End]:
        """Source and target, whichever a connection names first."""
        gives = [self._gives(link, end) for end in (link.start, link.end)]
        if gives[0] == gives[1]:
            verb = "give a value" if gives[0] else "take a value"
            raise ScenarioError(f"connection {link}: both ends {verb}; it takes an output and an input")
        return (link.start, link.end) if gives[0] else (link.end, link.start)

    def _gives(self, link: Link, end: End) -> bool:
        """Whether a connector gives a value, seen from inside the system."""
        if end.element not in self._connectors:
            known = ", ".join(self._interfaces)
            raise ScenarioError(
                f"connection {link}: there is no component '{end.element}'; there are {known}"
            )
        connectors = self._connectors[end.element]
        for connector in connectors:
            if connector.name == end.connector:
                if connector.kind not in ("input", "output"):
                    raise ScenarioError(f"connection {link}: kind {connector.kind} is not supported")
                return (connector.kind == "output") == bool(end.element)
        owner = f"component '{end.element}'" if end.element else "the system"
        known = _closest(end.connector, [c.name for c in connectors])
        raise ScenarioError(f"connection {link}: {owner} has no connector '{end.connector}'; {known}")

    def _check_units(self, link: Link, source: End, target: End) -> None:
        taken = self._interfaces[target.element].unit(target.connector)
        if not source.element:
            connector = next(c for c in self._connectors[""] if c.name == source.connector)
            _check_unit(f"connector {connector.name} of the system", connector.unit, taken)
        elif not link.converts_units:
            given = self._interfaces[source.element].unit(source.connector)
            if (given or "1") != (taken or "1"):
                raise ScenarioError(
                    f"connection {link}: from '{given or '1'}' to '{taken or '1'}' without conversion is not "
                    "supported: leave suppressUnitConversion out"
                )


def _check_connector(component: str, connector: Connector, interface: Interface) -> None:
    where = f"connector {component}.{connector.name}"
    if connector.name not in interface:
        known = _closest(connector.name, interface.names())
        raise ScenarioError(f"{where}: the FMU has no such variable; {known}")
    if connector.kind != (causality := interface.causality(connector.name)):
        raise ScenarioError(f"{where}: its kind is {connector.kind}; the FMU's variable is {causality}")
    if connector.type not in ("", declared := interface.type(connector.name)):
        raise ScenarioError(f"{where}: its type is {connector.type}; the FMU's variable is {declared}")
    _check_unit(where, connector.unit, interface.unit(connector.name))


def _closest(name: str, known: Sequence[str]) -> str:
    """Words for what there is instead."""
    if close := get_close_matches(name, known, cutoff=0.5):
        return f"similar are {', '.join(close)}"
    return f"there are {', '.join(known) or 'none'}"


def _check_unit(where: str, unit: str, declared: str) -> None:
    if unit and unit != (declared or "1"):
        raise ScenarioError(f"{where}: its unit is '{unit}'; the FMU's variable is in '{declared or '1'}'")

"""From a `System` to the `Structure` of its package."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from ahrs_fmu.cosim.ssp.interface import Interface
from ahrs_fmu.cosim.ssp.structure import (
    Component,
    Connector,
    End,
    Link,
    Stepping,
    Structure,
    Value,
    scalars,
)
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import ScenarioError

Outputs = Literal["all", "connected"]


def compose(
    name: str,
    system: System,
    interfaces: Mapping[str, Interface],
    sources: Mapping[str, str],
    stop_time: float | None,
    outputs: Outputs,
) -> Structure:
    """Say what `write_ssp` writes.

    Parameters
    ----------
    name : str
        Name of the system.
    system : System
        Without taps.
    interfaces : mapping of str to Interface
        Of the FMI 2 FMUs, by component, in the order of the sweep; a component without one gives inputs.
    sources : mapping of str to str
        Its path in the package.
    stop_time : float, optional
        Proposed end of a simulation, s.
    outputs : {"all", "connected"}
        Which outputs become connectors.

    Raises
    ------
    ScenarioError
        If two FMUs, or two inputs of the package, claim the same name for different things.
    """
    links = list(_links(system, interfaces))
    ends = {link.end: link.start for link in links}
    starts = set(ends.values())
    enumerations = _Enumerations()
    components = []
    for component, interface in interfaces.items():
        wanted = [s for v in interface.variables("input") for s in interface.scalars(v)]
        # Some importers connect every input connector to something, so that one without a source must not be.
        wanted = [scalar for scalar in wanted if End(component, scalar) in ends]
        given = [s for v in interface.variables("output") for s in interface.scalars(v)]
        wanted += [s for s in given if outputs == "all" or End(component, s) in starts]
        connectors = [enumerations.declared(component, interface, scalar) for scalar in wanted]
        linked = {end.connector for end in ends if end.element == component}
        values = dict(_values(system, component, interface, linked))
        components.append(Component(component, sources[component], connectors, values))
    by_end = {End(part.name, c.name): c for part in components for c in part.connectors}
    return Structure(
        name=name,
        components=components,
        links=links,
        connectors=_inputs(links, by_end),
        enumerations=enumerations.items,
        units=_units(interfaces),
        stop_time=stop_time,
        stepping=Stepping(system.step_size, system.method),
    )


def _links(system: System, interfaces: Mapping[str, Interface]) -> Iterator[Link]:
    """Connections in the order of their targets; what no FMU gives becomes an input of the package."""
    starts: dict[str, End] = {}
    origins: dict[str, str] = {}
    for connection in system.connections:
        component, output = _split(connection.source)
        inside = component in interfaces
        starts[connection.target] = (
            End(component, output) if inside else _external(connection.source, origins)
        )
    starts |= {name: _external(name, origins) for name, drive in system.drives.items() if callable(drive)}
    for component, interface in interfaces.items():
        for variable in interface.variables("input"):
            if (start := starts.get(f"{component}.{variable}")) is not None:
                names = scalars(start.connector, interface.shape(variable))
                for given, taken in zip(names, interface.scalars(variable), strict=True):
                    yield Link(End(start.element, given), End(component, taken))


def _external(origin: str, origins: dict[str, str]) -> End:
    """The input of the package for a signal ``component.variable``; `origins` keeps whose each name is."""
    name = origin.replace(".", "_")
    if origins.setdefault(name, origin) != origin:
        raise ScenarioError(f"{origin} and {origins[name]} would both be '{name}': rename a component")
    return End("", name)


def _inputs(links: Iterable[Link], connectors: Mapping[End, Connector]) -> list[Connector]:
    """Inputs of the package, like the inputs that they drive."""
    found: dict[str, Connector] = {}
    for link in links:
        if not link.start.element:
            connector = replace(connectors[link.end], name=link.start.connector)
            if found.setdefault(connector.name, connector) != connector:
                raise ScenarioError(
                    f"{link.end}: the input '{connector.name}' drives others of another type or unit as well"
                )
    return list(found.values())


def _split(name: str) -> tuple[str, str]:
    component, _, variable = name.partition(".")
    return component, variable


def _values(
    system: System, component: str, interface: Interface, linked: set[str]
) -> Iterator[tuple[str, Value]]:
    """Parameters that differ from their defaults, and inputs that stay what they are."""
    stepper = system.components[component]
    for variable in (*interface.variables("parameter"), *interface.variables("input")):
        names = interface.scalars(variable)
        if names[0] in linked:
            continue
        drive = system.drives.get(f"{component}.{variable}")
        numbers = np.ravel(stepper.get(variable) if drive is None else np.asarray(drive, dtype=np.float64))
        if drive is not None or [interface.start(scalar) for scalar in names] != numbers.tolist():
            for scalar, number in zip(names, numbers, strict=True):
                yield scalar, interface.value(scalar, float(number))


def _units(interfaces: Mapping[str, Interface]) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for component, interface in interfaces.items():
        for name, base in interface.units.items():
            if found.setdefault(name, base) != base:
                raise ScenarioError(f"{component}: its unit '{name}' is another one in a component before it")
    return found


class _Enumerations:
    """Enumerations by a name that is the system's own."""

    def __init__(self) -> None:
        self.items: dict[str, Mapping[str, int]] = {}

    def declared(self, component: str, interface: Interface, scalar: str) -> Connector:
        """The connector of a scalar, whose enumeration is then among `items`."""
        connector = interface.connector(scalar)
        if not connector.enumeration:
            return connector
        items = interface.items(scalar)
        for name in (connector.enumeration, f"{component}.{connector.enumeration}"):
            if self.items.setdefault(name, items) == items:
                return replace(connector, enumeration=name)
        raise ScenarioError(
            f"{component}.{scalar}: the name '{connector.enumeration}' means two enumerations"
        )

"""The XML files of a package, written from its `Structure`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from ahrs_fmu.cosim.ssp.structure import (
    ANNOTATION_TYPE,
    FMU_TYPE,
    PARAMETER_TYPE,
    Component,
    Connector,
    End,
    Scalar,
    Structure,
)
from ahrs_fmu.cosim.ssp.vocabulary import ahrs, ssc, ssd, ssv
from ahrs_fmu.export.model_description import to_bytes
from ahrs_fmu.version import __version__

_ABOUT = {"version": "1.0", "generationTool": f"ahrs-fmu {__version__}"}


def structure_description(structure: Structure) -> bytes:
    """Text of ``SystemStructure.ssd``."""
    root = Element(ssd("SystemStructureDescription"), _ABOUT | {"name": structure.name})
    system = SubElement(root, ssd("System"), name=structure.name)
    _add_connectors(system, structure.connectors)
    elements = SubElement(system, ssd("Elements"))
    for component in structure.components:
        element = SubElement(
            elements,
            ssd("Component"),
            name=component.name,
            type=FMU_TYPE,
            source=component.source,
            implementation="CoSimulation",
        )
        _add_connectors(element, component.connectors)
        # At the component, not at the system: some importers read the parameters of components only.
        if component.values:
            bindings = SubElement(element, ssd("ParameterBindings"))
            source = parameter_file(component.name)
            SubElement(bindings, ssd("ParameterBinding"), type=PARAMETER_TYPE, source=source)
    if structure.links:
        connections = SubElement(system, ssd("Connections"))
        for link in structure.links:
            SubElement(connections, ssd("Connection"), _end("start", link.start) | _end("end", link.end))
    if structure.enumerations:
        enumerations = SubElement(root, ssd("Enumerations"))
        for name, items in structure.enumerations.items():
            enumeration = SubElement(enumerations, ssc("Enumeration"), name=name)
            for item, number in items.items():
                SubElement(enumeration, ssc("Item"), name=item, value=str(number))
    used = [c.unit for c in structure.connectors]
    used += [c.unit for component in structure.components for c in component.connectors]
    _add_units(root, ssd("Units"), structure.units, used)
    _add_experiment(root, structure)
    return to_bytes(root)


def parameter_file(component: str) -> str:
    """Where in the package the parameter values of a component are."""
    return f"resources/{component}.ssv"


def parameter_set(component: Component, units: Mapping[str, Mapping[str, float]]) -> bytes:
    """Text of the file with the parameter values of a component, with the units that it uses of `units`."""
    root = Element(ssv("ParameterSet"), _ABOUT | {"name": component.name})
    parameters = SubElement(root, ssv("Parameters"))
    for name, value in component.values.items():
        parameter = SubElement(parameters, ssv("Parameter"), name=name)
        unit = {"unit": value.unit} if value.unit else {}
        SubElement(parameter, ssv(value.type), {"value": _text(value.value)} | unit)
    _add_units(root, ssv("Units"), units, [value.unit for value in component.values.values()])
    return to_bytes(root)


def _add_connectors(parent: Element, connectors: Sequence[Connector]) -> None:
    if connectors:
        group = SubElement(parent, ssd("Connectors"))
        for connector in connectors:
            element = SubElement(group, ssd("Connector"), name=connector.name, kind=connector.kind)
            attributes = {"unit": connector.unit} if connector.unit else {}
            attributes |= {"name": connector.enumeration} if connector.enumeration else {}
            SubElement(element, ssc(connector.type), attributes)


def _end(role: str, end: End) -> dict[str, str]:
    return ({f"{role}Element": end.element} if end.element else {}) | {f"{role}Connector": end.connector}


def _add_units(
    root: Element, tag: str, units: Mapping[str, Mapping[str, float]], used: Iterable[str]
) -> None:
    if names := sorted(set(used) - {""}):
        group = SubElement(root, tag)
        for name in names:
            base = {key: _text(number) for key, number in units[name].items()}
            SubElement(SubElement(group, ssc("Unit"), name=name), ssc("BaseUnit"), base)


def _add_experiment(root: Element, structure: Structure) -> None:
    stop = {} if structure.stop_time is None else {"stopTime": _text(structure.stop_time)}
    experiment = SubElement(root, ssd("DefaultExperiment"), {"startTime": "0.0"} | stop)
    if structure.stepping is not None:
        annotation = SubElement(
            SubElement(experiment, ssd("Annotations")), ssc("Annotation"), type=ANNOTATION_TYPE
        )
        stepping = {"step": _text(structure.stepping.step), "method": structure.stepping.method}
        SubElement(annotation, ahrs("CoSimulation"), stepping)


def _text(value: Scalar) -> str:
    """A value in the notation of XML Schema."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "INF" if value > 0 else "-INF"
    return repr(value) if isinstance(value, float) else str(value)

"""The `Structure` of a package, read from its XML files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import get_args
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from ahrs_fmu.cosim.ssp.structure import (
    ANNOTATION_TYPE,
    FMU_TYPE,
    PARAMETER_TYPE,
    STRUCTURE_FILE,
    Component,
    Connector,
    End,
    Link,
    Scalar,
    Stepping,
    Structure,
    Value,
)
from ahrs_fmu.cosim.ssp.vocabulary import SSC, ahrs, ssc, ssd, ssv
from ahrs_fmu.cosim.system import Method
from ahrs_fmu.errors import ScenarioError

Files = Callable[[str], bytes]
"""Content of a file of the package by its path; raises `ScenarioError` where there is none."""

_UNSUPPORTED = {
    ssd("System"): "nested systems are not supported: lift its components",
    ssd(
        "SignalDictionaryReference"
    ): "signal dictionaries are not supported: connect the components directly",
}
_CONVERSIONS: dict[str, Callable[[str], Scalar]] = {
    "Real": float,
    "Integer": int,
    "Boolean": lambda text: {"true": True, "1": True, "false": False, "0": False}[text],
    "Enumeration": str,
    "String": str,
    "Binary": str,
}


def parse(files: Files) -> Structure:
    """Read the structure description and the parameter sets that it names.

    Raises
    ------
    ScenarioError
        If a file is missing or malformed, or asks for what is not supported; it names file and element.
    """
    root = _document(files, STRUCTURE_FILE, ssd("SystemStructureDescription"))
    version = _attribute(root, "version", STRUCTURE_FILE)
    if not version.startswith("1."):
        raise ScenarioError(f"{STRUCTURE_FILE}: version {version} is not supported; only SSP 1.0 is")
    system = root.find(ssd("System"))
    if system is None:
        raise ScenarioError(f"{STRUCTURE_FILE}: there is no System element")
    components: dict[str, Component] = {}
    for element in system.iterfind(f"{ssd('Elements')}/*"):
        component = _component(element, files)
        if component.name in components:
            raise ScenarioError(f"{STRUCTURE_FILE}: two components have the name '{component.name}'")
        components[component.name] = component
    connectors = list(_connectors(system, "the system"))
    values: dict[str, Value] = {}
    for name, value in _values(system, files):
        owner, _, scalar = name.partition(".")
        if owner in components and all(name != connector.name for connector in connectors):
            # What the system says of a component stands above what the component itself says.
            part = components[owner]
            components[owner] = replace(part, values={**part.values, scalar: value})
        else:
            values[name] = value
    return Structure(
        name=_attribute(root, "name", STRUCTURE_FILE),
        components=list(components.values()),
        links=[_link(element) for element in system.iterfind(f"{ssd('Connections')}/{ssd('Connection')}")],
        connectors=connectors,
        values=values,
        stepping=_stepping(root),
    )


def _document(files: Files, path: str, tag: str) -> Element:
    try:
        root = ElementTree.fromstring(files(path))
    except ElementTree.ParseError as error:
        raise ScenarioError(f"{path}: is malformed: {error}") from None
    if root.tag != tag:
        raise ScenarioError(f"{path}: its root element is {root.tag}; SSP 1.0 has {tag}")
    return root


def _component(element: Element, files: Files) -> Component:
    name = _attribute(element, "name", STRUCTURE_FILE)
    where = f"{STRUCTURE_FILE}: component '{name}'"
    if element.tag in _UNSUPPORTED:
        raise ScenarioError(f"{STRUCTURE_FILE}: '{name}': {_UNSUPPORTED[element.tag]}")
    if "." in name:
        raise ScenarioError(f"{where}: a name with a dot is not supported: rename it")
    if (kind := element.get("type", FMU_TYPE)) != FMU_TYPE:
        raise ScenarioError(f"{where}: type {kind} is not supported; only {FMU_TYPE} is")
    if element.get("implementation") == "ModelExchange":
        raise ScenarioError(f"{where}: model exchange is not supported; only CoSimulation is")
    return Component(
        name=name,
        source=_attribute(element, "source", where),
        connectors=list(_connectors(element, f"component '{name}'")),
        values=dict(_values(element, files)),
    )


def _connectors(parent: Element, owner: str) -> Iterator[Connector]:
    where = f"{STRUCTURE_FILE}: {owner}: a connector"
    for element in parent.iterfind(f"{ssd('Connectors')}/{ssd('Connector')}"):
        types = [child for child in element if child.tag.startswith(f"{{{SSC}}}")]
        yield Connector(
            name=_attribute(element, "name", where),
            kind=_attribute(element, "kind", where),
            type=_plain(types[0]) if types else "",
            unit=types[0].get("unit", "") if types else "",
        )


def _link(element: Element) -> Link:
    where = f"{STRUCTURE_FILE}: a connection"
    link = Link(
        End(element.get("startElement", ""), _attribute(element, "startConnector", where)),
        End(element.get("endElement", ""), _attribute(element, "endConnector", where)),
        converts_units=element.get("suppressUnitConversion", "false") in ("false", "0"),
    )
    for child in element:
        is_neutral = child.tag == ssc("LinearTransformation") and (
            _real(child, "factor", where, 1.0) == 1.0 and _real(child, "offset", where, 0.0) == 0.0
        )
        if _plain(child).endswith("Transformation") and not is_neutral:
            raise ScenarioError(
                f"{STRUCTURE_FILE}: connection {link}: {_plain(child)} is not supported: "
                "let the units of its ends differ, or put a component in between"
            )
    return link


def _values(parent: Element, files: Files) -> Iterator[tuple[str, Value]]:
    name = parent.get("name", "")
    where = f"{STRUCTURE_FILE}: parameter binding of '{name}'"
    for binding in parent.iterfind(f"{ssd('ParameterBindings')}/{ssd('ParameterBinding')}"):
        if (kind := binding.get("type", PARAMETER_TYPE)) != PARAMETER_TYPE:
            raise ScenarioError(f"{where}: type {kind} is not supported; only {PARAMETER_TYPE} is")
        if binding.find(ssd("ParameterMapping")) is not None:
            raise ScenarioError(f"{where}: a ParameterMapping is not supported: rename the parameters")
        if binding.get("sourceBase", "SSD") != "SSD":
            raise ScenarioError(f"{where}: sourceBase is not supported: put the values into the package")
        source = binding.get("source")
        if source is not None:
            sets = [(source, _document(files, source, ssv("ParameterSet")))]
        else:
            sets = [(where, e) for e in binding.iterfind(f"{ssd('ParameterValues')}/{ssv('ParameterSet')}")]
        for place, parameters in sets:
            for parameter in parameters.iterfind(f"{ssv('Parameters')}/{ssv('Parameter')}"):
                bare = _attribute(parameter, "name", place)
                yield binding.get("prefix", "") + bare, _value(parameter, f"{place}: parameter '{bare}'")


def _value(parameter: Element, where: str) -> Value:
    for child in parameter:
        if (kind := _plain(child)) in _CONVERSIONS:
            text = _attribute(child, "value", where)
            try:
                return Value(kind, _CONVERSIONS[kind](text), child.get("unit", ""))
            except (ValueError, KeyError):
                raise ScenarioError(f"{where}: '{text}' is no {kind}") from None
    raise ScenarioError(f"{where}: has no value; it takes one of {', '.join(_CONVERSIONS)}")


def _stepping(root: Element) -> Stepping | None:
    for annotation in root.iterfind(f"{ssd('DefaultExperiment')}/{ssd('Annotations')}/{ssc('Annotation')}"):
        found = annotation.find(ahrs("CoSimulation"))
        if annotation.get("type") == ANNOTATION_TYPE and found is not None:
            where = f"{STRUCTURE_FILE}: annotation '{ANNOTATION_TYPE}'"
            given = _attribute(found, "method", where)
            for method in get_args(Method):
                if method == given:
                    return Stepping(_real(found, "step", where), method)
            raise ScenarioError(f"{where}: method '{given}' is not one of {', '.join(get_args(Method))}")
    return None


def _attribute(element: Element, name: str, where: str) -> str:
    value = element.get(name)
    if value is None:
        raise ScenarioError(f"{where}: {_plain(element)} lacks the attribute '{name}'")
    return value


def _real(element: Element, name: str, where: str, default: float | None = None) -> float:
    if default is not None and name not in element.attrib:
        return default
    text = _attribute(element, name, where)
    try:
        return float(text)
    except ValueError:
        raise ScenarioError(f"{where}: {name} = '{text}' is not a number") from None


def _plain(element: Element) -> str:
    """Name of an element without its namespace."""
    return element.tag.rpartition("}")[2]

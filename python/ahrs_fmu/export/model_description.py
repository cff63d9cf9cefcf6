"""The XML files of an FMU, written from a model's descriptor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ahrs_fmu.descriptors import TIME_VR, Descriptor, Variable
from ahrs_fmu.export.variant import Variant
from ahrs_fmu.units import factor, parse
from ahrs_fmu.version import __version__

LOG_CATEGORIES = {
    "logStatusError": "Calls that were refused, with the reason",
    "logStatusWarning": "Settings that are accepted and unwise",
    "logEvents": "Start and end of a run",
    "logAll": "Everything",
}
"""The categories of fmi/component.c."""

ICON_SIZE = 100.0
"""Half the width of the icon's coordinate system."""

_FMI2_TYPES = {"real": "Real", "integer": "Integer", "boolean": "Boolean", "enumeration": "Enumeration"}
_FMI3_TYPES = {"real": "Float64", "integer": "Int32", "boolean": "Boolean", "enumeration": "Enumeration"}


@dataclass(frozen=True, slots=True)
class Exposed:
    """A variable as an importer sees it: a whole one, or an element of an array."""

    name: str
    vr: int
    start: Sequence[float]
    variable: Variable


def exposed(descriptor: Descriptor, *, arrays: bool) -> Iterator[Exposed]:
    """Variables in the order of the model description, elements of arrays one by one unless `arrays`."""
    for variable in descriptor.variables:
        start = descriptor.numbers(variable, variable.default)
        if arrays or variable.size == 1:
            yield Exposed(variable.name, variable.vr, start, variable)
        else:
            for i in range(variable.size):
                yield Exposed(f"{variable.name}[{i + 1}]", variable.vr + i, start[i : i + 1], variable)


def model_description(variant: Variant, source_files: Sequence[str]) -> bytes:
    """Text of ``modelDescription.xml``.

    Parameters
    ----------
    variant : Variant
        The FMU.
    source_files : sequence of str
        C files in ``sources/`` (FMI 3 names them in ``buildDescription.xml`` instead).
    """
    write = _fmi2 if variant.version == 2 else _fmi3
    return to_bytes(write(variant, source_files))


def to_bytes(root: Element) -> bytes:
    """An XML document with indentation."""
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def build_description(variant: Variant, source_files: Sequence[str]) -> bytes:
    """Text of ``sources/buildDescription.xml`` of FMI 3."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=variant.descriptor.title)
    files = SubElement(configuration, "SourceFileSet", language="C99")
    for name in source_files:
        SubElement(files, "SourceFile", name=name)
    return to_bytes(root)


def terminals_and_icons(variant: Variant) -> bytes:
    """Text of ``terminalsAndIcons/terminalsAndIcons.xml``: one bus in, one bus out, and the icon."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    low, high = f"{-ICON_SIZE:g}", f"{ICON_SIZE:g}"
    box = {"x1": low, "y1": low, "x2": high, "y2": high}
    graphics = SubElement(root, "GraphicalRepresentation")
    SubElement(graphics, "CoordinateSystem", box | {"suggestedScalingFactorTo_mm": "0.1"})
    SubElement(graphics, "Icon", box)
    terminals = SubElement(root, "Terminals")
    descriptor = variant.descriptor
    for name, kind, variables, x in (
        ("inputs", "All inputs", descriptor.inputs, -ICON_SIZE),
        ("outputs", "All outputs", descriptor.outputs, ICON_SIZE),
    ):
        terminal = SubElement(
            terminals, "Terminal", name=name, matchingRule="bus", description=f"{kind} as one bus"
        )
        names = {variable.name for variable in variables}
        for item in exposed(descriptor, arrays=variant.has_arrays):
            if item.variable.name in names:
                SubElement(
                    terminal,
                    "TerminalMemberVariable",
                    variableName=item.name,
                    memberName=item.name,
                    variableKind="signal",
                )
        SubElement(
            terminal,
            "TerminalGraphicalRepresentation",
            defaultConnectionColor="38 70 130",
            x1=f"{x - 10:g}",
            y1="-10",
            x2=f"{x + 10:g}",
            y2="10",
            iconBaseName="bus",
        )
    return to_bytes(root)


def _number(value: float) -> str:
    return repr(float(value))


def _start(variable: Variable, values: Sequence[float]) -> str:
    if variable.type == "real":
        return " ".join(_number(value) for value in values)
    if variable.type == "boolean":
        return " ".join("true" if value else "false" for value in values)
    return " ".join(str(int(value)) for value in values)


def _about(descriptor: Descriptor) -> dict[str, str]:
    return {
        "modelName": descriptor.title,
        "description": f"{descriptor.summary}. {descriptor.description}",
        "author": "ahrs-fmu",
        "version": __version__,
        "license": "BSD-2-Clause",
        "generationTool": f"ahrs-fmu {__version__}",
        "variableNamingConvention": "structured",
    }


def _variability(role: str, variable: Variable) -> str:
    if role == "parameter":
        return "tunable" if variable.tunable else "fixed"
    # Outputs change at ticks only; a sensor signal may be anything.
    return "continuous" if role == "input" and variable.type == "real" else "discrete"


def _range(variable: Variable) -> dict[str, str]:
    if variable.type not in ("real", "integer"):
        return {}
    limits = {"min": variable.min, "max": variable.max}
    return {
        name: _number(value) if variable.type == "real" else str(int(value))
        for name, value in limits.items()
        if value is not None
    }


def _unit_of(variable: Variable) -> dict[str, str]:
    attributes = {"unit": variable.unit} if variable.unit else {}
    return attributes | ({"displayUnit": variable.display_unit} if variable.display_unit else {})


def _add_units(root: Element, descriptor: Descriptor) -> None:
    units: dict[str, set[str]] = {"s": set()}
    for variable in descriptor.variables:
        if variable.unit:
            units.setdefault(variable.unit, set()).update({variable.display_unit} - {""})
    definitions = SubElement(root, "UnitDefinitions")
    for name in sorted(units):
        unit = SubElement(definitions, "Unit", name=name)
        parsed = parse(name)
        if parsed.has_whole_powers:
            base = {power: f"{exponent:.0f}" for power, exponent in sorted(parsed.powers.items())}
            scale = {} if parsed.scale == 1.0 else {"factor": _number(parsed.scale)}
            SubElement(unit, "BaseUnit", base | scale)
        for display in sorted(units[name]):
            SubElement(unit, "DisplayUnit", name=display, factor=_number(factor(name, display)))


def _add_log_categories(root: Element) -> None:
    categories = SubElement(root, "LogCategories")
    for name, description in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=description)


def _add_experiment(root: Element, descriptor: Descriptor) -> None:
    step = _number(descriptor.default_sample_time)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="10.0", stepSize=step)


def _add_items(parent: Element, descriptor: Descriptor, name: str) -> None:
    for item in descriptor.enumerations[name].items:
        SubElement(parent, "Item", name=item.name, value=str(item.value), description=item.description)


def _enumerations_used(descriptor: Descriptor) -> list[str]:
    return sorted({v.enumeration for v in descriptor.variables if v.enumeration})


def _fmi2(variant: Variant, source_files: Sequence[str]) -> Element:
    descriptor = variant.descriptor
    root = Element("fmiModelDescription", {"fmiVersion": "2.0", "guid": variant.token} | _about(descriptor))
    simulation = SubElement(
        root,
        "CoSimulation",
        modelIdentifier=descriptor.title,
        needsExecutionTool="true" if variant.backend == "python" else "false",
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="false",
        maxOutputDerivativeOrder="0",
        canRunAsynchronuously="false",
        canBeInstantiatedOnlyOncePerProcess="false",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        providesDirectionalDerivative="false",
    )
    files = SubElement(simulation, "SourceFiles")
    for name in source_files:
        SubElement(files, "File", name=name)
    _add_units(root, descriptor)
    if used := _enumerations_used(descriptor):
        types = SubElement(root, "TypeDefinitions")
        for name in used:
            description = descriptor.enumerations[name].description
            simple = SubElement(types, "SimpleType", name=f"{name}_type", description=description)
            _add_items(SubElement(simple, "Enumeration"), descriptor, name)
    _add_log_categories(root)
    _add_experiment(root, descriptor)
    variables = SubElement(root, "ModelVariables")
    time = SubElement(
        variables,
        "ScalarVariable",
        name="time",
        valueReference=str(TIME_VR),
        description="Time",
        causality="independent",
        variability="continuous",
    )
    SubElement(time, "Real", unit="s")
    outputs: list[int] = []
    for index, item in enumerate(exposed(descriptor, arrays=False), start=2):
        variable, role = item.variable, descriptor.role(item.variable)
        if role == "output":
            outputs.append(index)
        initial = {"parameter": {"initial": "exact"}, "output": {"initial": "calculated"}}.get(role, {})
        scalar = SubElement(
            variables,
            "ScalarVariable",
            {
                "name": item.name,
                "valueReference": str(item.vr),
                "description": variable.description,
                "causality": role,
                "variability": _variability(role, variable),
            }
            | initial,
        )
        attributes = {"declaredType": f"{variable.enumeration}_type"} if variable.enumeration else {}
        attributes |= _unit_of(variable) | _range(variable)
        if role != "output":
            attributes["start"] = _start(variable, item.start)
        SubElement(scalar, _FMI2_TYPES[variable.type], attributes)
    structure = SubElement(root, "ModelStructure")
    for group, extra in (("Outputs", {"dependencies": ""}), ("InitialUnknowns", {})):
        unknowns = SubElement(structure, group)
        for index in outputs:
            SubElement(unknowns, "Unknown", {"index": str(index)} | extra)
    return root


def _fmi3(variant: Variant, source_files: Sequence[str]) -> Element:
    del source_files  # named in buildDescription.xml
    descriptor = variant.descriptor
    root = Element(
        "fmiModelDescription", {"fmiVersion": "3.0", "instantiationToken": variant.token} | _about(descriptor)
    )
    SubElement(
        root,
        "CoSimulation",
        modelIdentifier=descriptor.title,
        needsExecutionTool="true" if variant.backend == "python" else "false",
        canBeInstantiatedOnlyOncePerProcess="false",
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        canHandleVariableCommunicationStepSize="true",
        hasEventMode="false",
    )
    _add_units(root, descriptor)
    if used := _enumerations_used(descriptor):
        types = SubElement(root, "TypeDefinitions")
        for name in used:
            description = descriptor.enumerations[name].description
            _add_items(
                SubElement(types, "EnumerationType", name=f"{name}_type", description=description),
                descriptor,
                name,
            )
    _add_log_categories(root)
    _add_experiment(root, descriptor)
    variables = SubElement(root, "ModelVariables")
    SubElement(
        variables,
        "Float64",
        name="time",
        valueReference=str(TIME_VR),
        description="Time",
        causality="independent",
        variability="continuous",
        unit="s",
    )
    outputs: list[int] = []
    for item in exposed(descriptor, arrays=variant.has_arrays):
        variable, role = item.variable, descriptor.role(item.variable)
        attributes = {
            "name": item.name,
            "valueReference": str(item.vr),
            "description": variable.description,
            "causality": role,
            "variability": _variability(role, variable),
        }
        if variable.enumeration:
            attributes["declaredType"] = f"{variable.enumeration}_type"
        attributes |= _unit_of(variable) | _range(variable)
        if role == "output":
            attributes["initial"] = "calculated"
            outputs.append(item.vr)
        else:
            attributes["start"] = _start(variable, item.start)
        element = SubElement(variables, _FMI3_TYPES[variable.type], attributes)
        if len(item.start) > 1:
            SubElement(element, "Dimension", start=str(len(item.start)))
    structure = SubElement(root, "ModelStructure")
    for group, extra in (("Output", {"dependencies": ""}), ("InitialUnknown", {})):
        for vr in outputs:
            SubElement(structure, group, {"valueReference": str(vr)} | extra)
    return root

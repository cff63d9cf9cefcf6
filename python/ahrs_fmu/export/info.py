"""What an FMU says of itself, for people to read."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy

from ahrs_fmu.errors import FmuError

_CAPABILITIES = {
    "canHandleVariableCommunicationStepSize": "variable steps",
    "canGetAndSetFMUstate": "save and restore",
    "canSerializeFMUstate": "serialise",
    "canBeInstantiatedOnlyOncePerProcess": "one instance per process",
    "needsExecutionTool": "needs its tool",
}


@dataclass(frozen=True, slots=True)
class VariableInfo:
    """A variable in words; empty where the FMU says nothing."""

    name: str
    causality: str
    variability: str
    unit: str
    start: str
    limits: str
    description: str


@dataclass(frozen=True, slots=True)
class FmuInfo:
    """What an FMU says of itself.

    Attributes
    ----------
    model, description, fmi_version, tool : str
        From the model description.
    size : int
        Bytes of the file.
    platforms : list of str
        Folders that hold binaries.
    capabilities : list of str
        What an importer may do with it.
    variables : list of VariableInfo
        In the order of the model description.
    """

    model: str
    description: str
    fmi_version: str
    tool: str
    size: int
    platforms: list[str]
    capabilities: list[str]
    variables: list[VariableInfo]


def read_info(path: Path) -> FmuInfo:
    """Read what an FMU says of itself.

    Raises
    ------
    FmuError
        It is no FMU.
    OSError
        The file cannot be read.
    """
    path.open("rb").close()
    try:
        description = fmpy.read_model_description(str(path), validate=False)
        with zipfile.ZipFile(path) as archive:
            parts = [name.split("/") for name in archive.namelist() if name.startswith("binaries/")]
    # FMPy passes on whatever the ZIP and XML readers raise.
    except Exception as error:
        raise FmuError(f"{path.name}: is not an FMU: {error}") from None
    component: Any = description.coSimulation or description.modelExchange
    return FmuInfo(
        model=description.modelName,
        description=description.description or "",
        fmi_version=description.fmiVersion,
        tool=description.generationTool or "an unnamed tool",
        size=path.stat().st_size,
        platforms=sorted({part[1] for part in parts if len(part) > 2}),
        capabilities=[text for name, text in _CAPABILITIES.items() if getattr(component, name, False)],
        variables=[_variable(v) for v in description.modelVariables],
    )


def _variable(v: Any) -> VariableInfo:
    declared = v.declaredType
    unit = v.unit or (declared.unit if declared is not None else None) or ""
    if unit == "1":
        unit = ""
    display = v.displayUnit or (declared.displayUnit if declared is not None else None)
    shape = f" ({', '.join(str(d.start) for d in v.dimensions)})" if v.dimensions else ""
    choices = ", ".join(item.name for item in declared.items) if declared is not None else ""
    limits = " to ".join(f"{float(text):.6g}" for text in (v.min, v.max) if text is not None)
    return VariableInfo(
        name=f"{v.name}{shape}",
        causality=v.causality or "",
        variability=v.variability or "",
        unit=f"{unit} (shown in {display})" if display else unit,
        start=_start(v),
        limits=f"one of {choices}" if choices else limits,
        description=v.description or "",
    )


def _start(v: Any) -> str:
    start = "" if v.start is None else str(v.start)
    for item in v.declaredType.items if v.declaredType is not None else ():
        if item.value == start:
            return str(item.name)
    return start

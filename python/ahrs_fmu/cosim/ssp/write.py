"""Writing a `System` as an SSP package."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from ahrs_fmu.cosim.fmu import Fmu
from ahrs_fmu.cosim.playback import Playback
from ahrs_fmu.cosim.ssp.compose import Outputs, compose
from ahrs_fmu.cosim.ssp.document import parameter_file, parameter_set, structure_description
from ahrs_fmu.cosim.ssp.interface import Interface
from ahrs_fmu.cosim.ssp.structure import STRUCTURE_FILE
from ahrs_fmu.cosim.ssp.twin import fmi2_twin
from ahrs_fmu.cosim.system import System
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.export.archive import write_archive


def write_ssp(
    system: System,
    path: str | Path,
    *,
    stop_time: float | None = None,
    outputs: Outputs = "all",
    platforms: Sequence[str] | None = None,
) -> None:
    """Write a system as an SSP 1.0 package (docs/ssp.md).

    Parameters
    ----------
    system : System
        Its components, connections, parameters and the values of its inputs are written, not its state. A
        component that is no FMI 2 FMU is replaced by its FMI 2 twin. What comes from a function of time or a
        `Playback` becomes an input of the package, ``component_input`` or ``playback_output``.
    path : str or Path
        The .ssp file.
    stop_time : float, optional
        Proposed end of a simulation, s.
    outputs : {"all", "connected"}
        Which outputs become connectors. With all of them an importer can record everything; but some stop at
        a type that they do not know, such as the enumeration ``status``.
    platforms : sequence of str, optional
        Platforms for FMUs that have to be built, as for `ahrs_fmu.export.package.build_fmu`.

    Raises
    ------
    ScenarioError
        If the system has what SSP cannot say: a tap, or a component without an FMI 2 twin.
    BuildError
        If an FMU cannot be built.
    """
    path = Path(path)
    if system.tapped_outputs:
        raise ScenarioError(
            f"{system.tapped_outputs[0]} has a tap, which an SSP package cannot hold: "
            "leave it out, or let a component do what it does"
        )
    for name in system.components:
        if _UNSAFE.search(name):
            raise ScenarioError(f"component '{name}': a name in a package has letters, digits, - and _ only")
    with TemporaryDirectory(prefix="ahrs-fmu-", ignore_cleanup_errors=True) as folder, ExitStack() as stack:
        twins = {
            name: fmi2_twin(name, system.components[name], Path(folder) / name, platforms)
            for name in system.order
            if not isinstance(system.components[name], Playback)
        }
        sources, files = _stored(twins)
        interfaces = {name: Interface(stack.enter_context(Fmu(twin))) for name, twin in twins.items()}
        structure = compose(path.stem, system, interfaces, sources, stop_time, outputs)
    texts = {STRUCTURE_FILE: structure_description(structure)}
    for component in structure.components:
        if component.values:
            texts[parameter_file(component.name)] = parameter_set(component, structure.units)
    write_archive(path, texts | files)


_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]")


def _stored(twins: Mapping[str, Path]) -> tuple[dict[str, str], dict[str, bytes]]:
    """Where in the package the FMU of each component is, and what is there: equal ones once."""
    sources: dict[str, str] = {}
    files: dict[str, bytes] = {}
    for name, twin in twins.items():
        data = twin.read_bytes()
        # Not every importer decodes what an address has to encode.
        file = _UNSAFE.sub("_", twin.name)
        source = f"resources/{file}"
        if files.get(source, data) != data:
            source = f"resources/{name}/{file}"
        sources[name], files[source] = source, data
    return sources, files

"""Reading an SSP package as a `System`."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from types import MappingProxyType
from urllib.parse import unquote

from numpy.typing import ArrayLike

from ahrs_fmu.cosim.fmu import Fmu
from ahrs_fmu.cosim.ssp.assemble import assemble
from ahrs_fmu.cosim.ssp.parse import parse
from ahrs_fmu.cosim.system import Method, Signal, System
from ahrs_fmu.errors import AhrsError, ScenarioError


@contextmanager
def read_ssp(
    path: str | Path,
    *,
    step: float | None = None,
    method: Method | None = None,
    inputs: Mapping[str, ArrayLike | Signal] = MappingProxyType({}),
) -> Iterator[System]:
    """Open the FMUs of an SSP 1.0 package as a system, and close them at the end (docs/ssp.md).

    Parameters
    ----------
    path : str or Path
        The .ssp file.
    step : float, optional
        Communication step, s. SSP has no place for it; packages of this project carry it as an annotation.
    method : {"gauss-seidel", "jacobi"}, optional
        By default that of the annotation, else Gauss-Seidel.
    inputs : mapping of str to value or callable
        What drives the inputs of the package: a constant, or a function of the time at which a step ends.

    Yields
    ------
    System
        At its start. Inputs that have a value in the package are constant drives.

    Raises
    ------
    ScenarioError
        If the package is malformed, asks for what is not supported, or does not fit its FMUs. The message
        names the file, the element and what would be right.
    OSError
        If the file cannot be read.

    Warns
    -----
    UserWarning
        If a parameter names nothing in the system: the standard says to ignore it.
    """
    path = Path(path)
    with ExitStack() as stack:
        try:
            system = _open(path, stack, step, method, inputs)
        except AhrsError as error:
            raise ScenarioError(f"{path.name}: {error}") from error
        yield system


def _open(
    path: Path,
    stack: ExitStack,
    step: float | None,
    method: Method | None,
    inputs: Mapping[str, ArrayLike | Signal],
) -> System:
    try:
        archive = stack.enter_context(zipfile.ZipFile(path))
    except zipfile.BadZipFile:
        raise ScenarioError("is not an SSP package: it is no ZIP archive") from None

    def content(name: str) -> bytes:
        try:
            return archive.read(unquote(name).removeprefix("./"))
        except KeyError:
            raise ScenarioError(f"{name} is missing; there are {', '.join(archive.namelist())}") from None
        # What the ZIP reader raises for damaged, encrypted or unknown contents.
        except (zipfile.BadZipFile, zlib.error, RuntimeError) as error:
            raise ScenarioError(f"{name} cannot be unpacked: {error}") from None

    structure = parse(content)
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="ahrs-fmu-", ignore_cleanup_errors=True)))
    fmus: dict[str, Fmu] = {}
    for component in structure.components:
        source = component.source
        if source not in fmus:
            file = folder / str(len(fmus)) / PurePosixPath(unquote(source)).name
            try:
                data = content(source)
                file.parent.mkdir()
                file.write_bytes(data)
                fmus[source] = stack.enter_context(Fmu(file))
            except AhrsError as error:
                raise ScenarioError(f"component '{component.name}': {error}") from None
    opened = {component.name: fmus[component.source] for component in structure.components}
    return assemble(structure, opened, step=step, method=method, inputs=inputs)

"""FMUs as files: everything an FMU holds, in a ZIP archive that is the same byte for byte every time."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

import msgspec

from ahrs_fmu import descriptors
from ahrs_fmu.component import Component, describe
from ahrs_fmu.errors import AhrsError, BuildError, DescriptorError, ParameterError
from ahrs_fmu.estimators.model import FILTERS
from ahrs_fmu.export import documentation, icon
from ahrs_fmu.export.archive import write_archive
from ahrs_fmu.export.binaries import compile_binaries
from ahrs_fmu.export.model_description import build_description, model_description, terminals_and_icons
from ahrs_fmu.export.source_code import source_files
from ahrs_fmu.export.variant import Backend, Fmi, Variant
from ahrs_fmu.host_library import Precision
from ahrs_fmu.serve.resources import FILE, INTERPRETER_FILE, Resources, load_class
from ahrs_fmu.sources import fmu_src
from ahrs_fmu.toolchain import host_platform


def build_fmu(
    model: str,
    *,
    fmi: Fmi,
    platforms: Sequence[str] | None = None,
    precision: Precision = "double",
    backend: Backend = "c",
    output: Path,
) -> Path:
    """Build one FMU of a model.

    Parameters
    ----------
    model : str
        Name of the model, such as ``gcf``.
    fmi : {"2", "3", "3-scalar"}
        FMI version; ``3-scalar`` for importers that know no arrays.
    platforms : sequence of str, optional
        FMI 3 names of the platforms to build for; by default the host. FMI 2 has no ``aarch64-linux``.
    precision : {"double", "single"}
        Floating-point type inside.
    backend : {"c", "python"}
        ``python`` runs the numpy class of the model in a Python process.
    output : Path
        Build folder; the file is ``fmi2/TITLE.fmu``, ``fmi3/TITLE.fmu`` or ``fmi3-scalar/TITLE.fmu`` in it,
        and with the Python back-end ``python/fmi2/TITLE.fmu`` and so on.

    Returns
    -------
    Path
        The FMU.

    Raises
    ------
    ParameterError
        If there is no such model, or it has no such back-end.
    BuildError
        If a platform is unknown or the compiler is missing or fails.
    """
    variant = Variant(descriptors.load(model), fmi, precision, backend)
    path = output / variant.folder / f"{variant.descriptor.title}.fmu"
    write_archive(path, contents(variant, platforms or [host_platform()]))
    return path


def export_component(
    module: Path, name: str, *, fmi: Fmi, platforms: Sequence[str] | None = None, output: Path
) -> Path:
    """Export a user's class as an FMU that runs it in a Python process.

    Parameters
    ----------
    module : Path
        Python file; it becomes part of the FMU. What it imports has to be installed where the FMU runs.
    name : str
        A class in it, derived from `ahrs_fmu.component.Component`.
    fmi, platforms
        As for `build_fmu`.
    output : Path
        The FMU.

    Returns
    -------
    Path
        `output`.

    Raises
    ------
    DescriptorError
        If the file cannot be imported or has no such class, or a declaration of the class is wrong.
    BuildError
        If a platform is unknown or the compiler is missing or fails.
    """
    descriptor = describe(_imported(module, name))
    variant = Variant(descriptor, fmi, backend="python", module=module)
    write_archive(output, contents(variant, platforms or [host_platform()]))
    return output


def _imported(path: Path, name: str) -> type[Component]:
    """Class of a user's file, whose exceptions become one line that says where they come from."""
    try:
        return load_class(path, name)
    except (AhrsError, OSError, KeyboardInterrupt):
        raise
    except (Exception, SystemExit) as error:
        what = traceback.format_exception_only(error)[-1].strip()
        raise DescriptorError(f"{path.name} cannot be imported: {_place(path, error)}{what}") from error


def _place(path: Path, error: BaseException) -> str:
    """The last line of a file that had a part in an exception."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if Path(frame.filename).name == path.name]
    if isinstance(error, SyntaxError):
        lines.append(error.lineno)
    return f"line {lines[-1]}: " if lines else ""


def contents(variant: Variant, platforms: Sequence[str]) -> dict[str, bytes]:
    """Every file of an FMU by its path in the archive."""
    title = variant.descriptor.title
    sources = source_files(variant)
    compiled = [name for name in sources if name.endswith(".c")]
    files = {"modelDescription.xml": model_description(variant, compiled)}
    binaries = compile_binaries(title, sources, version=variant.version, platforms=platforms)
    files |= {f"binaries/{path}": library for path, library in binaries.items()}
    files |= {f"sources/{name}": text.encode() for name, text in sources.items()}
    if variant.backend == "python":
        files |= {f"resources/{name}": data for name, data in _resources(variant).items()}
    files["documentation/index.html"] = documentation.page(variant).encode()
    files["documentation/licenses/license.txt"] = _licence()
    if variant.version == 2:
        files["model.png"] = icon.horizon_png()
    else:
        files["sources/buildDescription.xml"] = build_description(variant, compiled)
        files["terminalsAndIcons/terminalsAndIcons.xml"] = terminals_and_icons(variant)
        files["terminalsAndIcons/icon.png"] = icon.horizon_png()
        files["terminalsAndIcons/icon.svg"] = icon.horizon_svg().encode()
        files["terminalsAndIcons/bus.png"] = icon.bus_png()
        files["terminalsAndIcons/bus.svg"] = icon.bus_svg().encode()
    return files


def _resources(variant: Variant) -> dict[str, bytes]:
    """What the Python process reads, and which Python runs it unless the user says otherwise."""
    descriptor, module = variant.descriptor, variant.module
    if module is None and descriptor.name not in FILTERS:
        raise ParameterError(
            f"{descriptor.title} has no numpy back-end; there are {', '.join(sorted(FILTERS))}"
        )
    given = Resources(
        model=descriptor.name if module is None else descriptor.title,
        fingerprint=descriptor.fingerprint(),
        module=module.name if module is not None else "",
    )
    files = {FILE: msgspec.json.encode(given), INTERPRETER_FILE: f"{sys.executable}\n".encode()}
    return files | ({module.name: module.read_bytes()} if module is not None else {})


def _licence() -> bytes:
    path = fmu_src().parent / "LICENSE"
    if not path.is_file():
        raise BuildError("the licence text is missing from this installation: reinstall the package")
    return path.read_bytes()

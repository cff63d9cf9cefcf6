"""FMUs as files: everything an FMU holds, in a ZIP archive that is the same byte for byte every time."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ahrs_fmu import descriptors
from ahrs_fmu.errors import BuildError
from ahrs_fmu.export import documentation, icon
from ahrs_fmu.export.binaries import compile_binaries
from ahrs_fmu.export.model_description import build_description, model_description, terminals_and_icons
from ahrs_fmu.export.source_code import source_files
from ahrs_fmu.export.variant import Fmi, Variant
from ahrs_fmu.host_library import Precision
from ahrs_fmu.sources import fmu_src
from ahrs_fmu.toolchain import host_platform

_TIME = (1980, 1, 1, 0, 0, 0)  # the earliest a ZIP archive can tell
_MODE = 0o644 << 16
_UNIX = 3


def build_fmu(
    model: str,
    *,
    fmi: Fmi,
    platforms: Sequence[str] | None = None,
    precision: Precision = "double",
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
    output : Path
        Build folder; the file is ``fmi2/TITLE.fmu``, ``fmi3/TITLE.fmu`` or ``fmi3-scalar/TITLE.fmu`` in it.

    Returns
    -------
    Path
        The FMU.

    Raises
    ------
    ParameterError
        If there is no such model.
    BuildError
        If a platform is unknown or the compiler is missing or fails.
    """
    variant = Variant(descriptors.load(model), fmi, precision)
    path = output / variant.folder / f"{variant.descriptor.title}.fmu"
    _write_archive(path, contents(variant, platforms or [host_platform()]))
    return path


def contents(variant: Variant, platforms: Sequence[str]) -> dict[str, bytes]:
    """Every file of an FMU by its path in the archive."""
    title = variant.descriptor.title
    sources = source_files(variant)
    compiled = [name for name in sources if name.endswith(".c")]
    files = {"modelDescription.xml": model_description(variant, compiled)}
    binaries = compile_binaries(title, sources, version=variant.version, platforms=platforms)
    files |= {f"binaries/{path}": library for path, library in binaries.items()}
    files |= {f"sources/{name}": text.encode() for name, text in sources.items()}
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


def _licence() -> bytes:
    path = fmu_src().parent / "LICENSE"
    if not path.is_file():
        raise BuildError("the licence text is missing from this installation: reinstall the package")
    return path.read_bytes()


def _write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, _TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = _MODE
            entry.create_system = _UNIX
            archive.writestr(entry, data)
    partial.replace(path)

"""The C sources of one FMU: complete, in one flat folder, with a header that says which FMU they are."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Sequence
from pathlib import Path

from ahrs_fmu.errors import BuildError
from ahrs_fmu.export import headers
from ahrs_fmu.export.variant import Variant
from ahrs_fmu.sources import fmu_src

CONFIG = "fmu_config.h"

_HEADER_FOLDERS = ("core", "include", "estimator", "fmi", "python_model")
_INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
_FROM_IMPORTER = re.compile(r"fmi[23]Functions\.h")


def fmi_headers() -> Path:
    """Folder of the standard's header files, which FMPy brings along.

    Raises
    ------
    BuildError
        If FMPy is not installed.
    """
    spec = importlib.util.find_spec("fmpy")
    if spec is None or not spec.submodule_search_locations:
        raise BuildError("the FMI header files come with the package fmpy: install it")
    return Path(spec.submodule_search_locations[0]) / "c-code"


def source_files(variant: Variant) -> dict[str, str]:
    """Every file of ``sources/`` by name, with its text.

    The C files include the configuration first, so that they mean the same however they are compiled.
    """
    fmi = fmu_src() / "fmi"
    files = {CONFIG: _configuration(variant)}
    files |= _compiled_model(variant) if variant.backend == "c" else _described_model(variant)
    for path in (fmi / "component.c", fmi / f"fmi{variant.version}.c"):
        files[path.name] = path.read_text()
    own = f'#include "{CONFIG}"\n'
    for name, text in files.items():
        if name.endswith(".c") and own not in text:
            files[name] = own + text
    _add_headers(files, [variant.descriptor.folder, *(fmu_src() / name for name in _HEADER_FOLDERS)])
    return dict(sorted(files.items()))


def _compiled_model(variant: Variant) -> dict[str, str]:
    """The C code of a model, and the engine that calls it."""
    paths = [*sorted(variant.descriptor.folder.glob("*.c")), fmu_src() / "fmi" / "engine_core.c"]
    return {path.name: path.read_text() for path in paths}


def _described_model(variant: Variant) -> dict[str, str]:
    """The variables of a model that Python computes, and the engine that asks Python."""
    descriptor = variant.descriptor
    files = {path.name: path.read_text() for path in sorted((fmu_src() / "python_model").glob("*.c"))}
    files[f"ahrs_{descriptor.name}.h"] = headers.model_header(descriptor)
    files[f"ahrs_{descriptor.name}_table.c"] = headers.model_table(descriptor, is_compiled=False)
    return files


def _add_headers(files: dict[str, str], folders: Sequence[Path]) -> None:
    """Add all project headers that the files need, directly or not."""
    waiting = list(files.values())
    while waiting:
        for name in _INCLUDE.findall(waiting.pop()):
            if name in files or _FROM_IMPORTER.fullmatch(name):
                continue
            paths = [folder / name for folder in folders if (folder / name).is_file()]
            if not paths:
                raise BuildError(
                    f"header {name} is in none of {', '.join(folder.name for folder in folders)}"
                )
            files[name] = paths[0].read_text()
            waiting.append(files[name])


def _configuration(variant: Variant) -> str:
    lines = [
        "/* Which FMU these sources are. */",
        "#ifndef FMU_CONFIG_H",
        "#define FMU_CONFIG_H",
        "",
        f'#define FMU_TOKEN "{variant.token}"',
        f"#define FMU_MODEL ahrs_{variant.descriptor.name}_model",
        f"#define FMU_ADDRESSING {'FMU_ARRAYS' if variant.has_arrays else 'FMU_SCALARS'}",
    ]
    if variant.precision == "single":
        lines += ["#define AHRS_SINGLE"]
    if variant.version == 2:
        # FMI 2 gives functions of a source FMU this prefix; an importer that builds a library overrides it.
        lines += [
            "",
            "#ifndef FMI2_FUNCTION_PREFIX",
            f"#define FMI2_FUNCTION_PREFIX {variant.descriptor.title}_",
            "#endif",
        ]
    return "\n".join([*lines, "", "#endif", ""])

"""The C sources of one FMU: complete, in one flat folder, with a header that says which FMU they are."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterable
from pathlib import Path

from ahrs_fmu.errors import BuildError
from ahrs_fmu.export.variant import Variant
from ahrs_fmu.sources import fmu_src

CONFIG = "fmu_config.h"

_HEADER_FOLDERS = ("core", "include", "estimator", "fmi")
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
    root = fmu_src()
    model = variant.descriptor.folder
    fmi = root / "fmi"
    c_files = [
        *sorted(model.glob("*.c")),
        fmi / "component.c",
        fmi / "engine_core.c",
        fmi / f"fmi{variant.version}.c",
    ]
    folders = [model, *(root / name for name in _HEADER_FOLDERS)]
    files = {CONFIG: _configuration(variant)}
    for path in c_files:
        text = path.read_text()
        own = f'#include "{CONFIG}"\n'
        files[path.name] = text if own in text else own + text
    for path in _headers(c_files, folders):
        files[path.name] = path.read_text()
    return dict(sorted(files.items()))


def _headers(c_files: Iterable[Path], folders: Iterable[Path]) -> list[Path]:
    """All project headers that the C files need, directly or not."""
    found: dict[str, Path] = {}
    waiting = list(c_files)
    while waiting:
        for name in _INCLUDE.findall(waiting.pop().read_text()):
            if name in found or name == CONFIG or _FROM_IMPORTER.fullmatch(name):
                continue
            paths = [folder / name for folder in folders if (folder / name).is_file()]
            if not paths:
                raise BuildError(
                    f"header {name} is in none of {', '.join(folder.name for folder in folders)}"
                )
            found[name] = paths[0]
            waiting.append(paths[0])
    return list(found.values())


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

"""Build hook of the wheel: adds the C sources and the host library in both precisions."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_WHEEL_TAGS = {
    "x86_64-linux": "manylinux_2_17_x86_64",
    "aarch64-linux": "manylinux_2_17_aarch64",
    "x86_64-windows": "win_amd64",
    "x86_64-darwin": "macosx_13_0_x86_64",
    "aarch64-darwin": "macosx_13_0_arm64",
}


class HostLibraryHook(BuildHookInterface[Any]):
    """Compiles the host library and puts it into the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Extend the wheel; an editable install finds its sources in the checkout and compiles on demand."""
        if version == "editable":
            return
        root = Path(self.root)
        # The package itself needs numpy, which a build environment has not: import its modules without it.
        package = ModuleType("ahrs_fmu")
        package.__path__ = [str(root / "python" / "ahrs_fmu")]
        sys.modules["ahrs_fmu"] = package
        from ahrs_fmu import host_library, toolchain

        self._scratch = tempfile.mkdtemp()
        for precision in ("double", "single"):
            name = host_library.library_name(precision)
            library = host_library.compile_host_library(precision, Path(self._scratch) / name)
            build_data["force_include"][str(library)] = f"ahrs_fmu/lib/{name}"
        build_data["force_include"][str(root / "fmu_src")] = "ahrs_fmu/fmu_src"
        build_data["force_include"][str(root / "LICENSE")] = "ahrs_fmu/LICENSE"  # goes into every FMU
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{_WHEEL_TAGS[toolchain.host_platform()]}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002
        """Remove the compiled files."""
        if version != "editable":
            shutil.rmtree(self._scratch)

"""Compiling C with the compiler of the ``ziglang`` package.

No system compiler is needed, and one machine builds for every platform.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ahrs_fmu.errors import BuildError

TARGETS: Mapping[str, str] = {
    "x86_64-linux": "x86_64-linux-gnu.2.17",
    "aarch64-linux": "aarch64-linux-gnu.2.17",
    "x86_64-windows": "x86_64-windows-gnu",
    "x86_64-darwin": "x86_64-macos",
    "aarch64-darwin": "aarch64-macos",
}
"""Platforms by their FMI 3 names, with the compiler's names of them; old libraries run everywhere."""

SUFFIXES: Mapping[str, str] = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}

# Contraction would round differently where a machine has a fused multiply-add; errno of the square root
# would pull in a library call. Vectors of three and quaternions packed in pairs cost more in shuffling than
# they gain in arithmetic.
FLAGS: Sequence[str] = (
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-slp-vectorize",
    "-fno-sanitize=undefined",
    "-fno-ident",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Wstrict-prototypes",
    "-Wmissing-prototypes",
    "-Werror",
)


def host_platform() -> str:
    """FMI 3 name of the platform this process runs on.

    Raises
    ------
    BuildError
        If it is none of `TARGETS`.
    """
    system = {"linux": "linux", "win32": "windows", "darwin": "darwin"}.get(sys.platform, sys.platform)
    machine = os.uname().machine if hasattr(os, "uname") else os.environ.get("PROCESSOR_ARCHITECTURE", "")
    name = f"{ {'AMD64': 'x86_64', 'arm64': 'aarch64'}.get(machine, machine) }-{system}"
    if name not in TARGETS:
        raise BuildError(f"no binaries for the platform {name}: there are {', '.join(TARGETS)}")
    return name


def suffix(platform: str) -> str:
    """File name extension of a shared library on `platform`."""
    return SUFFIXES[platform.rsplit("-", 1)[1]]


def cache_folder() -> Path:
    """Folder kept between builds, for the compiler and for compiled libraries."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    folder = (Path(base) if base else Path.home() / ".cache") / "ahrs-fmu"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / "ahrs-fmu-cache"
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def environment() -> dict[str, str]:
    """Environment for the compiler: its cache is kept between builds."""
    zig = cache_folder() / "zig"
    return {"ZIG_GLOBAL_CACHE_DIR": str(zig), "ZIG_LOCAL_CACHE_DIR": str(zig), **os.environ}


def compile_library(
    sources: Sequence[Path],
    output: Path,
    *,
    include: Sequence[Path] = (),
    system_include: Sequence[Path] = (),
    define: Sequence[str] = (),
    platform: str | None = None,
    hide_symbols: bool = True,
) -> Path:
    """Compile C sources into one shared library.

    Parameters
    ----------
    sources, include : sequence of Path
        C files, and the folders their headers are in.
    system_include : sequence of Path
        Folders of headers that are not ours: no warnings about them.
    output : Path
        The library; its folder is made. It appears complete or not at all.
    define : sequence of str
        Preprocessor definitions, ``NAME`` or ``NAME=VALUE``.
    platform : str, optional
        One of `TARGETS`; the host by default.
    hide_symbols : bool
        Whether only symbols that the sources mark are exported.

    Returns
    -------
    Path
        `output`.

    Raises
    ------
    BuildError
        If the compiler is not installed, the platform is unknown or the compilation fails.
    """
    platform = platform or host_platform()
    if platform not in TARGETS:
        raise BuildError(f"unknown platform '{platform}': there are {', '.join(TARGETS)}")
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError("compiling needs the package ziglang: install ahrs-fmu[build]")
    output.parent.mkdir(parents=True, exist_ok=True)
    windows, darwin = platform.endswith("windows"), platform.endswith("darwin")
    target = ["-target", TARGETS[platform]]
    compiling = [
        *target,
        *FLAGS,
        # Half of a Windows library is the runtime it carries along: there, all is built for size.
        *(
            ["-Os", "-fslp-vectorize", "-fno-asynchronous-unwind-tables", "-fno-unwind-tables"]
            if windows
            else ["-fPIC"]
        ),
        *(["-fvisibility=hidden"] if hide_symbols else []),
    ]
    compiling += [f"-I{folder.resolve()}" for folder in include]
    compiling += [word for folder in system_include for word in ("-isystem", str(folder.resolve()))]
    compiling += [f"-D{name}" for name in define]
    linking = [*target, "-shared", "-s", *(["-Os"] if windows else ["-O2", "-lm"])]
    linking += [f"-Wl,-install_name,@rpath/{output.name}"] if darwin else []
    with tempfile.TemporaryDirectory(dir=output.parent) as name:
        scratch = Path(name)
        # For Windows the compiler takes one source at a time.
        for group in [[source] for source in sources] if windows else [sources]:
            _compiler(
                scratch, output.name, platform, [*compiling, "-c", *(str(file.resolve()) for file in group)]
            )
        objects = sorted(path.name for path in scratch.iterdir())
        _compiler(scratch, output.name, platform, [*linking, *objects, "-o", output.name])
        (scratch / output.name).replace(output)
    return output


def _compiler(folder: Path, what: str, platform: str, arguments: Sequence[str]) -> None:
    """Run the compiler inside `folder`, so that no path of this machine gets into what it makes."""
    command = [sys.executable, "-m", "ziglang", "cc", *arguments]
    done = subprocess.run(command, cwd=folder, env=environment(), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BuildError(f"compiling {what} for {platform} failed:\n{done.stderr.strip()}")


def fingerprint(files: Sequence[Path], *texts: str) -> str:
    """Short hash of the contents of `files`, their names, how this module compiles, and `texts`."""
    digest = hashlib.sha256(Path(__file__).read_bytes() + "\0".join(texts).encode())
    for file in sorted(files):
        digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]

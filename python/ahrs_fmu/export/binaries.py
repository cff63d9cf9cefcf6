"""The shared libraries of an FMU, one per platform, kept between builds."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ahrs_fmu.errors import BuildError
from ahrs_fmu.export.source_code import fmi_headers
from ahrs_fmu.toolchain import TARGETS, cache_folder, compile_library, fingerprint, suffix

_DARWIN = ("x86_64-darwin", "aarch64-darwin")
_FMI2_FOLDERS = {"x86_64-linux": "linux64", "x86_64-windows": "win64"} | dict.fromkeys(_DARWIN, "darwin64")

# Mach-O's header of a file with one part per processor.
_FAT_MAGIC = 0xCAFEBABE
_FAT_PROCESSORS = {"x86_64-darwin": (0x01000007, 3), "aarch64-darwin": (0x0100000C, 0)}
_FAT_ALIGNMENT_BITS = 14


def binary_folder(platform: str, version: int) -> str | None:
    """Folder of a platform's library below ``binaries/``; None where FMI 2 has no name for the platform."""
    return platform if version == 3 else _FMI2_FOLDERS.get(platform)


def compile_binaries(
    title: str, sources: Mapping[str, str], *, version: int, platforms: Sequence[str]
) -> dict[str, bytes]:
    """Compile the flat sources of an FMU.

    Parameters
    ----------
    title : str
        Model identifier: name of the library.
    sources : mapping of str to str
        File names and texts, as `source_code.source_files` gives them.
    version : int
        FMI version. In FMI 2 a library for macOS holds both processors, whichever is asked for.
    platforms : sequence of str
        FMI 3 names of platforms.

    Returns
    -------
    dict of str to bytes
        Libraries by their path below ``binaries/``.

    Raises
    ------
    BuildError
        If a platform is unknown, FMI 2 knows none of the platforms, or the compilation fails.
    """
    if unknown := [platform for platform in platforms if platform not in TARGETS]:
        raise BuildError(f"unknown platform '{unknown[0]}': there are {', '.join(TARGETS)}")
    binaries: dict[str, bytes] = {}
    for platform in platforms:
        folder = binary_folder(platform, version)
        if folder is None:
            continue
        path = f"{folder}/{title}{suffix(platform)}"
        if version == 2 and platform in _DARWIN:
            if path not in binaries:
                binaries[path] = join_darwin({name: _library(title, sources, name) for name in _DARWIN})
        else:
            binaries[path] = _library(title, sources, platform)
    if not binaries:
        raise BuildError(f"FMI 2 has no name for {', '.join(platforms)}: choose another platform or FMI 3")
    return binaries


def _library(title: str, sources: Mapping[str, str], platform: str) -> bytes:
    """One library, compiled unless the same was compiled before."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, text in sources.items():
            (folder / name).write_text(text, newline="\n")
        key = fingerprint(sorted(folder.iterdir()), platform)
        library = cache_folder() / "fmu" / key / f"{title}{suffix(platform)}"
        if not library.is_file():
            compile_library(
                [folder / name for name in sources if name.endswith(".c")],
                library,
                include=[folder],
                system_include=[fmi_headers()],
                platform=platform,
            )
    return library.read_bytes()


def join_darwin(parts: Mapping[str, bytes]) -> bytes:
    """One file for all Apple processors from one library for each."""
    alignment = 1 << _FAT_ALIGNMENT_BITS
    header = struct.pack(">II", _FAT_MAGIC, len(parts))
    body = b""
    for platform, library in parts.items():
        body += b"\0" * (-len(body) % alignment)
        offset = alignment + len(body)
        header += struct.pack(">IIIII", *_FAT_PROCESSORS[platform], offset, len(library), _FAT_ALIGNMENT_BITS)
        body += library
    return header.ljust(alignment, b"\0") + body

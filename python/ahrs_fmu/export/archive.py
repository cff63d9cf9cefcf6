"""ZIP archives that are the same byte for byte every time."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

_TIME = (1980, 1, 1, 0, 0, 0)  # the earliest a ZIP archive can tell
_MODE = 0o644 << 16
_UNIX = 3


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write `files`, by their paths in the archive, to `path`; its folder is made if it is missing."""
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

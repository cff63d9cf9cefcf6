"""The packages of the extra ``campaign``, asked for before hours are spent on what they are needed for."""

from __future__ import annotations

from types import ModuleType

from ahrs_fmu import extras

_PACKAGES = ("distributed", "filelock", "plotly", "pyarrow")


def require(module: str) -> ModuleType:
    """Import a module that a campaign needs.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    return extras.require(module, "campaign", "a campaign")


def check() -> None:
    """Import everything that a campaign and its report need.

    Raises
    ------
    MissingExtraError
        If something is not installed.
    """
    for package in _PACKAGES:
        require(package)

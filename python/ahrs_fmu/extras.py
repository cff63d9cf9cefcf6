"""Optional dependencies, imported where they are used."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from ahrs_fmu.errors import MissingExtraError


def require(module: str, extra: str, purpose: str) -> ModuleType:
    """Import an optional dependency.

    Parameters
    ----------
    module : str
        Import name, such as ``h5py``.
    extra : str
        The extra of this distribution that brings it.
    purpose : str
        What it is needed for, as the subject of the message.

    Raises
    ------
    MissingExtraError
        It is not installed; the message names the extra.
    """
    try:
        return import_module(module)
    except ImportError:
        name = module.partition(".")[0]
        raise MissingExtraError(f"{purpose} needs {name}: pip install 'ahrs-fmu[{extra}]'") from None

"""What an FMU's ``resources`` folder says about the model to run."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import msgspec
from msgspec import Struct

from ahrs_fmu.component import Component
from ahrs_fmu.errors import DescriptorError

FILE = "model.json"
INTERPRETER_FILE = "python.txt"


class Resources(Struct, frozen=True, forbid_unknown_fields=True):
    """Content of ``model.json``.

    Attributes
    ----------
    model : str
        Name of a model of this package, or of a class in `module`.
    fingerprint : str
        That of the descriptor the FMU was built from.
    module : str
        File name of a user's module; empty for a model of this package.
    """

    model: str
    fingerprint: str
    module: str = ""


def read(folder: Path) -> Resources:
    """Read ``model.json``.

    Raises
    ------
    DescriptorError
        If it is missing or damaged.
    """
    try:
        return msgspec.json.decode((folder / FILE).read_bytes(), type=Resources)
    except (OSError, msgspec.DecodeError) as error:
        raise DescriptorError(f"{folder / FILE}: {error}; build the FMU again") from None


def load_class(path: Path, name: str) -> type[Component]:
    """Load the class `name` from a Python file.

    Raises
    ------
    DescriptorError
        If the file has no such class. What the file itself raises is passed on.
    """
    found = getattr(_load_module(path), name, None)
    if not isinstance(found, type) or not issubclass(found, Component):
        raise DescriptorError(f"{path.name} has no class {name} derived from ahrs_fmu.component.Component")
    return found


def _load_module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise DescriptorError(f"{path.name} is no Python file")
    if path.stem in sys.modules and getattr(sys.modules[path.stem], "__file__", None) != str(path):
        raise DescriptorError(f"{path.name} has the name of another module that is loaded: rename the file")
    module = importlib.util.module_from_spec(spec)
    # What the class pickles is found again by the module's name.
    sys.modules[path.stem] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[path.stem]
        raise
    return module

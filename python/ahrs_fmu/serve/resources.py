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
    module = _load_module(path)
    classes = {
        key: value
        for key, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, Component) and value is not Component
    }
    if name not in classes:
        others = f"; it has {', '.join(classes)}" if classes else ""
        raise DescriptorError(
            f"{path.name} has no class {name} derived from ahrs_fmu.component.Component{others}"
        )
    return classes[name]


def _load_module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise DescriptorError(f"{path.name} is no Python file")
    loaded = sys.modules.get(path.stem)
    if loaded is not None and Path(loaded.__file__ or "").resolve() != path.resolve():
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

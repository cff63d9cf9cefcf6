"""Where the C sources and descriptors are: in the package when installed, beside it in a checkout."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_INSTALLED = _PACKAGE / "fmu_src"
_CHECKOUT = _PACKAGE.parents[1] / "fmu_src"


def fmu_src() -> Path:
    """Folder of the C sources and the model descriptors.

    Raises
    ------
    FileNotFoundError
        If neither an installed package nor a checkout holds them.
    """
    for folder in (_INSTALLED, _CHECKOUT):
        if (folder / "models").is_dir():
            return folder
    raise FileNotFoundError(
        "the C sources of ahrs-fmu are missing from this installation: reinstall the package"
    )

"""Which FMU of a model is meant: FMI version, arrays or scalars, what computes it, precision."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from ahrs_fmu.descriptors import Descriptor
from ahrs_fmu.errors import BuildError
from ahrs_fmu.host_library import Precision

Fmi = Literal["2", "3", "3-scalar"]
Backend = Literal["c", "python"]

FMI_VIA: Mapping[str, Fmi] = {"fmu2": "2", "fmu3": "3", "fmu3-scalar": "3-scalar"}
"""FMI version of the FMU that computes, by the word for it where C code or numpy may compute as well."""


@dataclass(frozen=True, slots=True)
class Variant:
    """One FMU of a model.

    Attributes
    ----------
    descriptor : Descriptor
        The model.
    fmi : {"2", "3", "3-scalar"}
        FMI version; ``3-scalar`` has one variable per array element, for importers without arrays.
    precision : {"double", "single"}
        Floating-point type of the C code; the importer sees doubles in either case.
    backend : {"c", "python"}
        Whether compiled code or a Python process computes the model.
    module : Path, optional
        Python file with the class of the model, for one that is not of this package.

    Raises
    ------
    BuildError
        If the back-end does not have the precision.
    """

    descriptor: Descriptor
    fmi: Fmi
    precision: Precision = "double"
    backend: Backend = "c"
    module: Path | None = None

    def __post_init__(self) -> None:
        if self.backend == "python" and self.precision != "double":
            raise BuildError("the Python back-end computes in double precision: leave the precision out")

    @property
    def version(self) -> int:
        """Number of the FMI version."""
        return int(self.fmi[0])

    @property
    def has_arrays(self) -> bool:
        """Whether an array is one variable."""
        return self.fmi == "3"

    @property
    def folder(self) -> str:
        """Folder of the FMU below the build folder."""
        return f"fmi{self.fmi}" if self.backend == "c" else f"python/fmi{self.fmi}"

    @property
    def token(self) -> str:
        """Instantiation token, GUID in FMI 2: differs where saved states or value references do."""
        fields = {
            name: getattr(self.descriptor, name)
            for name in self.descriptor.__struct_fields__
            if name != "folder"
        }
        what: list[object] = [fields, self.fmi, self.backend, self.precision]
        what += [self.module.read_text(encoding="utf-8")] if self.module is not None else []
        text = msgspec.json.encode(what, order="deterministic")
        digest = hashlib.sha256(text).hexdigest()
        return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"

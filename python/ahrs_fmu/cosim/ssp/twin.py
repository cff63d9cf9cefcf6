"""The FMI 2 FMU that does what a component does, which is all that SSP 1.0 packages can hold."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from pathlib import Path

from ahrs_fmu import descriptors
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.fmu import Fmu, FmuStepper
from ahrs_fmu.cosim.stepper import Stepper
from ahrs_fmu.cosim.user_class import ClassStepper
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.export.package import build_fmu, export_component
from ahrs_fmu.export.variant import Backend, Fmi, Variant
from ahrs_fmu.host_library import Precision

_FMI3: Sequence[Fmi] = ("3", "3-scalar")
_BUILDS: Sequence[tuple[Backend, Precision]] = (("c", "double"), ("c", "single"), ("python", "double"))


def fmi2_twin(name: str, stepper: Stepper, folder: Path, platforms: Sequence[str] | None = None) -> Path:
    """Path of an FMI 2 FMU that computes the same as a component.

    Parameters
    ----------
    name : str
        The component's name, for messages.
    stepper : Stepper
        An FMI 2 FMU is its own twin; for a C core, a numpy model, a user's class and an FMI 3 FMU of this
        package it is built.
    folder : Path
        Where to build.
    platforms : sequence of str, optional
        Platforms to build for, as for `ahrs_fmu.export.package.build_fmu`.

    Raises
    ------
    ScenarioError
        If there is no such FMU.
    BuildError
        If building fails.
    """
    if isinstance(stepper, FmuStepper) and stepper.fmu.version == 2:
        return stepper.fmu.path
    if isinstance(stepper, ClassStepper):
        file = folder / f"{stepper.cls.__name__}.fmu"
        module = Path(inspect.getfile(stepper.cls))
        return export_component(module, stepper.cls.__name__, fmi="2", platforms=platforms, output=file)
    if isinstance(stepper, CoreStepper):
        backend: Backend = "c" if stepper.back_end == "c" else "python"
        variant = Variant(stepper.descriptor, "2", stepper.precision, backend)
    elif isinstance(stepper, FmuStepper):
        variant = _twin_of(name, stepper.fmu)
    else:
        raise ScenarioError(
            f"{name}: a {type(stepper).__name__} cannot go into an SSP package, which holds FMI 2 FMUs: "
            "put an FMU or a CoreStepper in its place"
        )
    return build_fmu(
        variant.descriptor.name,
        fmi="2",
        platforms=platforms,
        precision=variant.precision,
        backend=variant.backend,
        output=folder,
    )


def _twin_of(name: str, fmu: Fmu) -> Variant:
    for variant in _own(fmu.description.modelName):
        if variant.token == fmu.description.guid:
            return Variant(variant.descriptor, "2", variant.precision, variant.backend)
    raise ScenarioError(
        f"{name}: {fmu.path.name} is FMI 3 and not built by this version of ahrs-fmu, "
        "and an SSP 1.0 package holds FMI 2: put its FMI 2 twin in its place"
    )


def _own(title: str) -> Iterator[Variant]:
    """Every FMI 3 FMU of this package with that title."""
    for descriptor in map(descriptors.load, descriptors.names()):
        if descriptor.title == title:
            for fmi in _FMI3:
                for backend, precision in _BUILDS:
                    yield Variant(descriptor, fmi, precision, backend)

"""Components of a system from what a scenario file says of them: C code, numpy, FMUs, user classes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import msgspec

from ahrs_fmu import descriptors
from ahrs_fmu.component import describe
from ahrs_fmu.cosim.closing import Closing
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.fmu import Fmu, FmuStepper
from ahrs_fmu.cosim.stepper import Stepper
from ahrs_fmu.cosim.user_class import ClassStepper, load_class_of
from ahrs_fmu.descriptors import Descriptor
from ahrs_fmu.errors import AhrsError, ScenarioError
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.variant import FMI_VIA, Fmi
from ahrs_fmu.trajectories import Data

Via = Literal["c", "single", "numpy", "fmu2", "fmu3", "fmu3-scalar"]
"""Who computes a model: the C code in double or single precision, its numpy twin, or an FMU of it."""

SOURCES = ("model", "fmu", "class")
"""What a component can be made of, by the names in a file."""


class Component(Data, frozen=True, rename={"class_": "class"}):
    """One component of a scenario; exactly one of `model`, `fmu` and `class_`.

    Attributes
    ----------
    model : str, optional
        A model of this package.
    fmu : str, optional
        An FMU file, relative to the scenario file.
    class_ : str, optional
        ``FILE:CLASS``, a class derived from `ahrs_fmu.component.Component`; relative likewise.
    via : str
        Who computes a `model`.
    parameters : mapping
        Those that differ from their defaults.
    """

    model: str | None = None
    fmu: str | None = None
    class_: str | None = None
    via: Via = "c"
    parameters: dict[str, Any] = msgspec.field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse more or less than one source."""
        if sum(source is not None for source in (self.model, self.fmu, self.class_)) != 1:
            raise ValueError("a component has exactly one of model, fmu, class")


class Instances(Closing):
    """Makes the steppers of components, and keeps the FMUs open for the next run.

    Parameters
    ----------
    build : Path, optional
        Where FMUs of models are built; by default in a folder that is removed at the end.
    """

    def __init__(self, build: Path | None = None) -> None:
        self._build = build
        self._scratch: TemporaryDirectory[str] | None = None
        self._fmus: dict[Path, Fmu] = {}
        self._built: dict[tuple[str, str], Path] = {}
        self._used: dict[tuple[str, Path], FmuStepper] = {}

    def open(
        self,
        name: str,
        component: Component,
        parameters: Mapping[str, Any],
        common: Mapping[str, Any],
        folder: Path,
    ) -> Stepper:
        """Return a stepper at its start.

        Parameters
        ----------
        name : str
            Of the component: an FMU's instance is handed out again under the same name.
        component : Component
        parameters : mapping
            All that differ from their defaults.
        common : mapping
            Further ones, for a component that has parameters of these names.
        folder : Path
            What file names are relative to.

        Raises
        ------
        ScenarioError
            If it cannot be made; the message names the component.
        """
        try:
            if component.fmu is not None:
                return self._instance(name, folder / component.fmu, parameters, common)
            if component.class_ is not None:
                cls = load_class_of(folder, component.class_)
                return ClassStepper(cls, _known(describe(cls), common) | dict(parameters))
            assert component.model is not None
            if component.via in FMI_VIA:
                path = self._path(component.model, FMI_VIA[component.via])
                return self._instance(name, path, parameters, common)
            descriptor = descriptors.load(component.model)
            return CoreStepper(
                descriptor,
                _known(descriptor, common) | dict(parameters),
                "single" if component.via == "single" else "double",
                "numpy" if component.via == "numpy" else "c",
            )
        except AhrsError as error:
            raise ScenarioError(f"components.{name}: {error}") from error
        except OSError as error:
            raise ScenarioError(f"components.{name}: {error.filename}: {error.strerror}") from error

    def close(self) -> None:
        """Free all instances and remove the unpacked FMUs."""
        for fmu in self._fmus.values():
            fmu.close()
        self._fmus.clear()
        self._used.clear()
        if self._scratch is not None:
            self._scratch.cleanup()
            self._scratch = None
            self._built.clear()

    def _path(self, model: str, fmi: Fmi) -> Path:
        if (model, fmi) not in self._built:
            self._built[model, fmi] = build_fmu(model, fmi=fmi, output=self._build_folder())
        return self._built[model, fmi]

    def _build_folder(self) -> Path:
        if self._build is not None:
            return self._build
        # Made when it is needed: most runs build nothing.
        if self._scratch is None:
            self._scratch = TemporaryDirectory(prefix="ahrs-fmu-")
        return Path(self._scratch.name)

    def _instance(
        self, name: str, path: Path, parameters: Mapping[str, Any], common: Mapping[str, Any]
    ) -> FmuStepper:
        if path not in self._fmus:
            self._fmus[path] = Fmu(path)
        fmu = self._fmus[path]
        given = {key: value for key, value in common.items() if key in fmu.variables} | dict(parameters)
        # One that fails stays out of use.
        stepper = self._used.pop((name, path), None)
        if stepper is None:
            stepper = fmu.instantiate(given)
        else:
            stepper.restart(given)
        self._used[name, path] = stepper
        return stepper


def _known(descriptor: Descriptor, values: Mapping[str, Any]) -> dict[str, Any]:
    names = {parameter.name for parameter in descriptor.parameters}
    return {name: value for name, value in values.items() if name in names}

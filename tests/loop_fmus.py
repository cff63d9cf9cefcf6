"""FMUs of the loop for tests, each built once."""

from __future__ import annotations

from pathlib import Path

from ahrs_fmu.cosim.fmu import Fmu
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.variant import Fmi


class LoopFmus:
    """FMUs by model and FMI version, built in `folder` on the first call and open until `close`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._opened: dict[tuple[str, Fmi], Fmu] = {}

    def __call__(self, model: str, fmi: Fmi) -> Fmu:
        if (model, fmi) not in self._opened:
            self._opened[model, fmi] = Fmu(build_fmu(model, fmi=fmi, output=self._folder))
        return self._opened[model, fmi]

    def close(self) -> None:
        for fmu in self._opened.values():
            fmu.close()

"""A recording through an estimator: the C core, or an FMU of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal

from ahrs_fmu import descriptors
from ahrs_fmu.cosim.fmu import Fmu, replay_record
from ahrs_fmu.descriptors import Limit
from ahrs_fmu.estimate import EstimateResult
from ahrs_fmu.estimator import Estimator
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.variant import FMI_VIA
from ahrs_fmu.metrics import AttitudeError, attitude_error
from ahrs_fmu.records import Record

Via = Literal["c", "fmu2", "fmu3", "fmu3-scalar"]


class Replay:
    """An estimator set up for recordings.

    Parameters
    ----------
    model : str
        Name of the estimator, such as ``gcf``.
    parameters : mapping of str to value
        Parameters that differ from their defaults. `sample_time` and `frame` come from each recording
        unless they are given.
    via : {"c", "fmu2", "fmu3", "fmu3-scalar"}
        What computes: the C core in one call, or an FMU step by step as an importer does.
    build : Path
        Where the FMU is built.

    Raises
    ------
    ParameterError
        The estimator is unknown.
    BuildError
        The FMU cannot be built.
    """

    def __init__(
        self, model: str, parameters: Mapping[str, object], via: Via = "c", build: Path = Path("build")
    ) -> None:
        self.descriptor = descriptors.load(model)
        self.parameters = dict(parameters)
        self.via = via
        self._fmu = None if via == "c" else build_fmu(model, fmi=FMI_VIA[via], output=build)

    @property
    def label(self) -> str:
        """Words for tables and plots, such as "GCF, C core"."""
        back_end = {"c": "C core", "fmu2": "FMI 2", "fmu3": "FMI 3", "fmu3-scalar": "FMI 3, scalars"}
        return f"{self.descriptor.title}, {back_end[self.via]}"

    def warnings(self, record: Record) -> list[Limit]:
        """Rules between the parameters that are broken but only warn.

        Raises
        ------
        ParameterError
            A parameter is unknown or out of range, or a rule that must hold is broken.
        """
        return self.descriptor.check(self._numbers(record))

    def run(self, record: Record, progress: Callable[[int], None] | None = None) -> EstimateResult:
        """Estimate the attitude over a recording.

        Parameters
        ----------
        record : Record
            The recording; it is brought into the estimator's frame.
        progress : callable, optional
            Called with the number of rows done since the last call.

        Raises
        ------
        ParameterError
            A parameter is unknown or out of range.
        FmuError
            The FMU refused a call.
        """
        numbers = self._numbers(record)
        values = {name: elements if len(elements) > 1 else elements[0] for name, elements in numbers.items()}
        estimator = Estimator(self.descriptor.name, values)
        if self._fmu is None:
            result = estimator.run(record)
            if progress is not None:
                progress(len(record))
            return result
        samples = record.in_frame(estimator.frame)
        with Fmu(self._fmu) as fmu:
            outputs = replay_record(fmu.instantiate(values), samples, progress)
        return EstimateResult.from_outputs(samples.time, estimator.frame, outputs)

    def _numbers(self, record: Record) -> dict[str, list[float]]:
        given = {"sample_time": record.sample_time, "frame": record.frame.value} | self.parameters
        defaults = {p.name: p.default for p in self.descriptor.parameters}
        return {
            name: self.descriptor.numbers(self.descriptor.parameter(name), value)
            for name, value in (defaults | given).items()
        }


def error_of(result: EstimateResult, record: Record) -> AttitudeError | None:
    """Error of an estimate against the truth of its recording; None when that has none."""
    truth = record.in_frame(result.frame).q_true
    return None if truth is None else attitude_error(result.q, truth)

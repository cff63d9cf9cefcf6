"""The estimators' common face in Python: parameters by name, one sample or a whole recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu import descriptors
from ahrs_fmu.descriptors import Descriptor
from ahrs_fmu.errors import ParameterError, RecordError
from ahrs_fmu.estimate import COMMON_OUTPUTS, Estimate, EstimateResult, Status
from ahrs_fmu.estimators.model import NumpyModel
from ahrs_fmu.frames import Frame
from ahrs_fmu.host_library import Precision
from ahrs_fmu.native import NativeModel
from ahrs_fmu.records import Record

Backend = Literal["c", "numpy"]

_COLUMNS = ("gyro", "accel", "mag", "accel_valid", "mag_valid")


class Estimator:
    """An attitude estimator.

    Use one of the classes of `ahrs_fmu.models`, which name their parameters.

    Parameters
    ----------
    model : str
        Name of the descriptor.
    parameters : mapping of str to value
        Values by parameter name; the others have their defaults.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its readable twin in numpy, which is double precision only.

    Raises
    ------
    ParameterError
        If a name is unknown, a value is outside its limits, or values contradict each other; if there is no
        numpy back-end for the model or the precision.
    """

    def __init__(
        self,
        model: str,
        parameters: Mapping[str, object],
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        self._descriptor = descriptors.load(model)
        self._parameters = {
            p.name: self._descriptor.numbers(p, p.default) for p in self._descriptor.parameters
        }
        for name, value in parameters.items():
            self._parameters[name] = self._descriptor.numbers(self._descriptor.parameter(name), value)
        self._epsilon = float(np.finfo(np.float64 if precision == "double" else np.float32).eps)
        self._descriptor.check(self._parameters, self._epsilon)
        self._core = _core(self._descriptor, precision, backend)
        self._backend: Backend = backend
        self._output_names = [variable.name for variable in self._descriptor.outputs]
        self._started = False
        self._configure(self._core)

    def _configure(self, core: NativeModel | NumpyModel) -> None:
        for name, elements in self._parameters.items():
            core.set(name, elements)
        core.reset()

    @property
    def descriptor(self) -> Descriptor:
        """The model's variables with their units, limits and meanings."""
        return self._descriptor

    @property
    def parameters(self) -> dict[str, object]:
        """Every parameter's value: an item's name for an enumeration, a list for an array."""
        return {p.name: self._shown(p.name) for p in self._descriptor.parameters}

    def _shown(self, name: str) -> object:
        variable = self._descriptor.parameter(name)
        elements = self._parameters[name]
        if variable.type == "enumeration":
            items = self._descriptor.enumeration_of(variable).items
            return next(item.name for item in items if item.value == elements[0])
        if variable.type == "boolean":
            return bool(elements[0])
        return list(elements) if variable.size > 1 else elements[0]

    @property
    def frame(self) -> Frame:
        """Frame of inputs and outputs."""
        return Frame(str(self._shown("frame")))

    @property
    def sample_time(self) -> float:
        """Sample interval in seconds that `update` assumes."""
        return self._parameters["sample_time"][0]

    def set(self, name: str, value: object) -> None:
        """Change a parameter; during a run only a tunable one.

        Raises
        ------
        ParameterError
            If the name or the value is refused; the old value is kept.
        """
        variable = self._descriptor.parameter(name)
        if self._started and not variable.tunable:
            raise ParameterError(f"{name} is fixed once the first sample was taken in: call reset() before")
        changed = {**self._parameters, name: self._descriptor.numbers(variable, value)}
        self._descriptor.check(changed, self._epsilon)
        self._parameters = changed
        self._core.set(name, changed[name])

    def reset(self) -> None:
        """Forget every sample; parameters keep their values."""
        self._core.reset()
        self._started = False

    def save(self) -> bytes:
        """Keep state and parameters, for `restore` of an estimator of the same model and precision."""
        return bytes([self._started]) + self._core.save()

    def restore(self, saved: bytes) -> None:
        """Continue from what `save` returned.

        Raises
        ------
        ValueError
            If the bytes are not of this model and precision.
        """
        self._core.restore(saved[1:])
        self._started = bool(saved[0])
        self._parameters = {
            p.name: [float(x) for x in self._core.get(p.name)] for p in self._descriptor.parameters
        }

    def update(
        self,
        gyro: ArrayLike,
        accel: ArrayLike,
        mag: ArrayLike | None = None,
        *,
        accel_valid: bool = True,
        mag_valid: bool = True,
        dt: float | None = None,
    ) -> Estimate:
        """Take in one sample.

        Parameters
        ----------
        gyro : array_like, shape (3,)
            Mean rate since the sample before, rad/s, body axes.
        accel : array_like, shape (3,)
            Specific force, m/s2, body axes.
        mag : array_like, shape (3,), optional
            Magnetic flux density, T, body axes; leave it out when there is none.
        accel_valid, mag_valid : bool
            False to leave a sensor out of this update.
        dt : float, optional
            Seconds since the sample before; `sample_time` by default. The first sample only initialises.

        Returns
        -------
        Estimate
            The attitude now.
        """
        core = self._core
        core.set("gyro", gyro)
        core.set("accel", accel)
        core.set("mag", 0.0 if mag is None else mag)
        core.set("accel_valid", accel_valid)
        core.set("mag_valid", mag_valid and mag is not None)
        core.update((self.sample_time if dt is None else dt) if self._started else 0.0)
        core.compute_outputs()
        self._started = True
        return self._estimate()

    def _estimate(self) -> Estimate:
        y = {name: self._core.get(name) for name in self._output_names}
        floats = {name: np.asarray(value, dtype=np.float64) for name, value in y.items()}
        return Estimate(
            q=floats["q"],
            euler=np.concatenate((floats["roll"], floats["pitch"], floats["yaw"])),
            rate=floats["rate"],
            gyro_bias=floats["gyro_bias"],
            motion_accel=floats["motion_accel"],
            attitude_std=floats.get("attitude_std"),
            status=Status(int(y["status"][0])),
            gyro_held=bool(y["gyro_held"][0]),
            accel_used=bool(y["accel_used"][0]),
            mag_used=bool(y["mag_used"][0]),
            covariance_reset=bool(y["covariance_reset"][0]) if "covariance_reset" in y else False,
            others={name: value for name, value in floats.items() if name not in COMMON_OUTPUTS},
        )

    def run(self, record: Record) -> EstimateResult:
        """Estimate the attitude over a recording, from a fresh start, in one call to the back-end.

        Parameters
        ----------
        record : Record
            The recording; it is brought into this estimator's frame. Its own sample times are used.

        Returns
        -------
        EstimateResult
            The attitude after every row. Row 0 is the initial attitude.
        """
        samples = record.in_frame(self.frame)
        self.reset()
        columns = {name: getattr(samples, name) for name in _COLUMNS}
        y = self._core.run(samples.steps, columns, self._output_names)
        self._started = True
        return EstimateResult.from_outputs(samples.time, self.frame, y)

    def run_all(self, records: Sequence[Record]) -> list[EstimateResult]:
        """Estimate the attitude over recordings of the same times, such as the runs of a Monte Carlo study.

        The numpy back-end takes all of them in one call. This estimator's own state is left alone.

        Parameters
        ----------
        records : sequence of Record
            Recordings with equal `time`.

        Returns
        -------
        list of EstimateResult
            One for each recording, as `run` would give it.

        Raises
        ------
        RecordError
            If there is none, or their times differ.
        """
        samples = [record.in_frame(self.frame) for record in records]
        if not samples or any(not np.array_equal(s.time, samples[0].time) for s in samples):
            raise RecordError(
                f"{len(samples)} recordings given; at least one is needed, all with the same time"
            )
        columns = {name: np.stack([getattr(s, name) for s in samples]) for name in _COLUMNS}
        outputs = self._run_batch(samples[0].steps, columns, len(samples))
        return [EstimateResult.from_outputs(samples[0].time, self.frame, y) for y in outputs]

    def _run_batch(
        self, steps: NDArray[np.float64], columns: Mapping[str, NDArray[np.generic]], size: int
    ) -> list[dict[str, NDArray[np.generic]]]:
        if self._backend == "numpy":
            batch = NumpyModel(self._descriptor, (size,))
            self._configure(batch)
            y = batch.run(steps, columns, self._output_names)
            return [{name: values[i] for name, values in y.items()} for i in range(size)]
        saved = self._core.save()
        outputs: list[dict[str, NDArray[np.generic]]] = []
        for i in range(size):
            self._core.reset()
            row = {name: column[i] for name, column in columns.items()}
            outputs.append(dict(self._core.run(steps, row, self._output_names)))
        self._core.restore(saved)
        return outputs


def _core(descriptor: Descriptor, precision: Precision, backend: Backend) -> NativeModel | NumpyModel:
    if backend == "c":
        return NativeModel(descriptor, precision)
    if precision != "double":
        raise ParameterError(
            f"precision = {precision!r} is refused: the numpy back-end is double precision; use backend 'c'"
        )
    return NumpyModel(descriptor)

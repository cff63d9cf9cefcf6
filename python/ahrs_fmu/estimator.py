"""The estimators' common face in Python: parameters by name, one sample or a whole recording."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ahrs_fmu import descriptors
from ahrs_fmu.descriptors import Descriptor
from ahrs_fmu.errors import ParameterError
from ahrs_fmu.estimate import COMMON_OUTPUTS, Estimate, EstimateResult, Status
from ahrs_fmu.frames import Frame
from ahrs_fmu.host_library import Precision
from ahrs_fmu.native import NativeModel
from ahrs_fmu.records import Record


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

    Raises
    ------
    ParameterError
        If a name is unknown, a value is outside its limits, or values contradict each other.
    """

    def __init__(self, model: str, parameters: Mapping[str, object], precision: Precision = "double") -> None:
        self._descriptor = descriptors.load(model)
        self._parameters = {
            p.name: self._descriptor.numbers(p, p.default) for p in self._descriptor.parameters
        }
        for name, value in parameters.items():
            self._parameters[name] = self._descriptor.numbers(self._descriptor.parameter(name), value)
        self._epsilon = float(np.finfo(np.float64 if precision == "double" else np.float32).eps)
        self._descriptor.check(self._parameters, self._epsilon)
        self._core = NativeModel(self._descriptor, precision)
        self._output_names = [variable.name for variable in self._descriptor.outputs]
        self._started = False
        for name, elements in self._parameters.items():
            self._core.set(name, elements)
        self._core.reset()

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
        """Estimate the attitude over a recording, from a fresh start, in one call to the C code.

        Parameters
        ----------
        record : Record
            The recording; it is brought into this estimator's frame. Its own sample times are used.

        Returns
        -------
        EstimateResult
            The attitude after every row. Row 0 is the initial attitude.
        """
        samples = record if record.frame is self.frame else record.in_frame(self.frame)
        self.reset()
        y = self._core.run(
            samples.steps,
            {
                "gyro": samples.gyro,
                "accel": samples.accel,
                "mag": samples.mag,
                "accel_valid": samples.accel_valid,
                "mag_valid": samples.mag_valid,
            },
            self._output_names,
        )
        self._started = True
        return EstimateResult.from_outputs(samples.time, self.frame, y)

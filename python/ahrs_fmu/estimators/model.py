"""A numpy filter behind the same face as a C model: variables by name, for a batch of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu.descriptors import Descriptor
from ahrs_fmu.errors import ParameterError
from ahrs_fmu.estimators.adaptive_ckf import AdaptiveCKF
from ahrs_fmu.estimators.cg_ekf import CGEKF
from ahrs_fmu.estimators.complementary import Complementary
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.gcf import GCF
from ahrs_fmu.estimators.improved_ekf import ImprovedEKF
from ahrs_fmu.estimators.kcf import KCF
from ahrs_fmu.estimators.mahony import Mahony
from ahrs_fmu.estimators.mahony_ekf import MahonyEKF
from ahrs_fmu.estimators.mekf import MEKF
from ahrs_fmu.estimators.state import CommonState, Inputs, Parameters
from ahrs_fmu.estimators.strapdown import Strapdown
from ahrs_fmu.estimators.ukf import UKF

Numbers = NDArray[np.float64] | NDArray[np.int32]

FILTERS: dict[str, type[Filter[Any]]] = {
    "adaptive_ckf": AdaptiveCKF,
    "cg_ekf": CGEKF,
    "complementary": Complementary,
    "gcf": GCF,
    "improved_ekf": ImprovedEKF,
    "kcf": KCF,
    "mahony": Mahony,
    "mahony_ekf": MahonyEKF,
    "mekf": MEKF,
    "strapdown": Strapdown,
    "ukf": UKF,
}
"""Class of every model that has a numpy back-end."""


class NumpyModel:
    """One instance of a numpy filter, or a batch of them.

    It is what `ahrs_fmu.native.NativeModel` is for the C code; every shape below has the dimensions of the
    batch in front.

    Parameters
    ----------
    descriptor : Descriptor
        The model.
    shape : tuple of int
        Shape of the batch; () is one run.

    Raises
    ------
    ParameterError
        If the model has no numpy back-end.
    """

    def __init__(self, descriptor: Descriptor, shape: tuple[int, ...] = ()) -> None:
        if descriptor.name not in FILTERS:
            raise ParameterError(
                f"{descriptor.title} has no numpy back-end; there are {', '.join(sorted(FILTERS))}"
            )
        self.descriptor = descriptor
        self.shape = shape
        self._roles = {v.name: descriptor.role(v) for v in descriptor.variables}
        self._variables = {v.name: v for v in descriptor.variables}
        self._parameters = {p.name: descriptor.numbers(p, p.default) for p in descriptor.parameters}
        self._inputs: dict[str, NDArray[np.generic]] = {}
        for variable in descriptor.inputs:
            self.set(variable.name, descriptor.numbers(variable, variable.default))
        self._filter = FILTERS[descriptor.name](self._readable_parameters(), shape)

    def set(self, name: str, values: ArrayLike) -> None:
        """Write the elements of a parameter or an input; the caller has checked them.

        An input takes one value for all runs or the values of each run.
        """
        variable = self._variables[name]
        if self._roles[name] == "input":
            kind = np.float64 if variable.type == "real" else np.bool_
            given: NDArray[np.generic] = np.asarray(values, dtype=kind)
            if variable.size == 1 and given.ndim > len(self.shape):
                given = given[..., 0]
            size = (variable.size,) if variable.size > 1 else ()
            self._inputs[name] = np.broadcast_to(given, self.shape + size).copy()
        else:
            self._parameters[name] = [float(x) for x in np.ravel(np.asarray(values))]
            self._filter.p = self._readable_parameters()

    def get(self, name: str) -> Numbers:
        """Elements of a variable as they are now, (..., size)."""
        if self._roles[name] == "parameter":
            return np.array(self._parameters[name])
        values = self._inputs[name] if self._roles[name] == "input" else self._filter.outputs()[name]
        numbers = self._numbers(name, values)
        return numbers if self._variables[name].size > 1 else numbers[..., None]

    def set_inputs(self, inputs: Mapping[str, NDArray[np.generic]]) -> None:
        """Write all inputs at once: arrays of their own that have the shape and type of `get`."""
        self._inputs = dict(inputs)

    def outputs(self) -> dict[str, NDArray[np.generic]]:
        """Every output as it is now: (...) or (..., size)."""
        return self._filter.outputs()

    def reset(self) -> None:
        """State as before the first sample."""
        self._filter.reset()

    def update(self, dt: float) -> None:
        """Take in the inputs, `dt` seconds after the last time."""
        self._filter.update(self._sample(), dt)

    def compute_outputs(self) -> None:
        """Do nothing: the outputs are computed when they are asked for."""

    def save(self) -> bytes:
        """Everything the instance is, as bytes for `restore`."""
        arrays = [np.array(x) for x in self._parameters.values()] + [*self._inputs.values(), *self._state()]
        return b"".join(a.tobytes() for a in arrays)

    def restore(self, saved: bytes) -> None:
        """Become what `save` kept.

        Raises
        ------
        ValueError
            If the bytes are not of this model and batch.
        """
        expected = len(self.save())
        if len(saved) != expected:
            raise ValueError(
                f"the saved state has {len(saved)} bytes; "
                f"{self.descriptor.title} for a batch of {self.shape} has {expected}"
            )
        position = 0

        def take(like: NDArray[np.generic]) -> NDArray[np.generic]:
            nonlocal position
            start, position = position, position + like.nbytes
            return np.frombuffer(saved[start:position], dtype=like.dtype).reshape(like.shape)

        for name, values in self._parameters.items():
            self._parameters[name] = [float(x) for x in take(np.array(values)).astype(np.float64)]
        self._inputs = {name: take(array) for name, array in self._inputs.items()}
        self._filter.p = self._readable_parameters()
        common = [take(array) for array in astuple(self._filter.common)]
        self._filter.common = CommonState(*common)  # type: ignore[arg-type]
        state = self._filter.state
        self._filter.state = type(state)(*(take(array) for array in state))

    def run(
        self, dt: ArrayLike, inputs: Mapping[str, NDArray[np.generic]], outputs: Sequence[str]
    ) -> dict[str, Numbers]:
        """Run over rows of inputs.

        Parameters
        ----------
        dt : array_like, shape (N,)
            Seconds since the row before; 0 for a first row that only initialises.
        inputs : mapping of str to ndarray, shape (..., N) or (..., N, size)
            Rows of the input variables; inputs not named keep their value.
        outputs : sequence of str
            Output variables wanted.

        Returns
        -------
        dict of str to ndarray
            Each output with shape (..., N) or (..., N, size).
        """
        steps = np.asarray(dt, dtype=np.float64).tolist()
        axis = len(self.shape)
        rows = {name: self._rows(name, array, len(steps)) for name, array in inputs.items()}
        collected: dict[str, Numbers] = {}
        for k, step in enumerate(steps):
            for name, array in rows.items():
                self._inputs[name] = array[k]
            self._filter.update(self._sample(), step)
            now = self._filter.outputs()
            for name in outputs:
                values = self._numbers(name, now[name])
                if k == 0:
                    collected[name] = np.empty((len(steps), *values.shape), dtype=values.dtype)
                collected[name][k] = values
        return {name: np.moveaxis(array, 0, axis) for name, array in collected.items()}

    def _rows(self, name: str, array: NDArray[np.generic], count: int) -> NDArray[np.generic]:
        """Rows first, batch next: (N, ...) or (N, ..., size)."""
        variable = self._variables[name]
        size = (variable.size,) if variable.size > 1 else ()
        kind = np.float64 if variable.type == "real" else np.bool_
        full: NDArray[np.generic] = np.broadcast_to(
            np.asarray(array, dtype=kind), (*self.shape, count, *size)
        )
        return np.moveaxis(full, len(self.shape), 0)

    def _sample(self) -> Inputs:
        return Inputs(*(self._inputs[name] for name in Inputs._fields))  # type: ignore[arg-type]

    def _state(self) -> list[NDArray[np.generic]]:
        return [*(getattr(self._filter.common, f.name) for f in fields(CommonState)), *self._filter.state]

    def _numbers(self, name: str, values: NDArray[np.generic]) -> Numbers:
        if self._variables[name].type == "real":
            return np.asarray(values, dtype=np.float64)
        return np.asarray(values, dtype=np.int32)

    def _readable_parameters(self) -> Parameters:
        return Parameters(**{name: self._readable(name, x) for name, x in self._parameters.items()})

    def _readable(self, name: str, numbers: list[float]) -> object:
        variable = self._variables[name]
        if variable.type == "enumeration":
            items = self.descriptor.enumeration_of(variable).items
            return next(item.name for item in items if item.value == numbers[0])
        if variable.type == "boolean":
            return bool(numbers[0])
        if variable.type == "integer":
            return int(numbers[0])
        return np.array(numbers) if variable.size > 1 else numbers[0]

"""The C models from Python: one sample at a time, or a whole recording in one call."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu.descriptors import Descriptor, Variable
from ahrs_fmu.host_library import Precision, library_file


class _Variable(ctypes.Structure):
    """`fmu_variable` of fmi/model.h."""

    _fields_ = [
        ("name", ctypes.c_char_p),
        ("vr", ctypes.c_uint32),
        ("size", ctypes.c_uint32),
        ("offset", ctypes.c_uint32),
        ("type", ctypes.c_int),
        ("role", ctypes.c_int),
        ("flags", ctypes.c_uint),
        ("min", ctypes.c_double),
        ("max", ctypes.c_double),
    ]


class _Part(ctypes.Structure):
    """`fmu_part` of fmi/model.h."""

    _fields_ = [("offset", ctypes.c_size_t), ("size", ctypes.c_size_t)]


_Hook = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
_Update = {
    "double": ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_double),
    "single": ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_float),
}


def _model_type(precision: Precision) -> type[ctypes.Structure]:
    class Model(ctypes.Structure):
        """`fmu_model` of fmi/model.h."""

        _fields_ = [
            ("name", ctypes.c_char_p),
            ("title", ctypes.c_char_p),
            ("instance_size", ctypes.c_size_t),
            ("params", _Part),
            ("inputs", _Part),
            ("outputs", _Part),
            ("state", _Part),
            ("sample_time_offset", ctypes.c_uint32),
            ("sample_time", ctypes.c_double),
            ("variables", ctypes.POINTER(_Variable)),
            ("n_variables", ctypes.c_size_t),
            ("limits", ctypes.c_void_p),
            ("n_limits", ctypes.c_size_t),
            ("defaults", _Hook),
            ("init", _Hook),
            ("update", _Update[precision]),
            ("compute_outputs", _Hook),
        ]

    return Model


class _Column(ctypes.Structure):
    """`ahrs_column` of native/native.h."""

    _fields_ = [
        ("data", ctypes.c_void_p),
        ("offset", ctypes.c_uint32),
        ("size", ctypes.c_int32),
        ("kind", ctypes.c_int32),
    ]


# As in native/native.h.
_COLUMN_KINDS: Mapping[np.dtype[np.generic], int] = {
    np.dtype(np.float64): 0,
    np.dtype(np.bool_): 1,
    np.dtype(np.int32): 2,
}


@cache
def _library(precision: Precision) -> ctypes.CDLL:
    library = ctypes.CDLL(str(library_file(precision)))
    library.ahrs_native_run.restype = None
    library.ahrs_native_run.argtypes = [
        ctypes.c_void_p,
        ctypes.c_void_p,
        ctypes.c_int64,
        ctypes.c_void_p,
        ctypes.POINTER(_Column),
        ctypes.c_int32,
        ctypes.POINTER(_Column),
        ctypes.c_int32,
    ]
    return library


@dataclass(frozen=True)
class _Slot:
    """Where a variable is in the instance, and what a column of it is over the rows of a recording."""

    variable: Variable
    offset: int
    view: NDArray[np.float64] | NDArray[np.float32] | NDArray[np.int32]
    column_type: np.dtype[np.generic]
    row_shape: tuple[int, ...]

    @property
    def is_real(self) -> bool:
        return self.variable.type == "real"

    def column(self, address: int) -> _Column:
        return _Column(address, self.offset, self.variable.size, _COLUMN_KINDS[self.column_type])


class NativeModel:
    """One instance of a C model.

    Parameters
    ----------
    descriptor : Descriptor
        The model.
    precision : {"double", "single"}
        Floating-point type of the C code.
    """

    def __init__(self, descriptor: Descriptor, precision: Precision = "double") -> None:
        self.descriptor = descriptor
        self._library = _library(precision)
        self._model = _model_type(precision).in_dll(self._library, f"ahrs_{descriptor.name}_model")
        # Aligned for doubles, and alive as long as the views below.
        self._memory = np.zeros((self._model.instance_size + 7) // 8, dtype=np.float64)
        self._bytes = self._memory.view(np.uint8)
        self._address = self._memory.ctypes.data
        self._real: type[np.float64] | type[np.float32] = np.float64 if precision == "double" else np.float32
        self._slots = self._read_table()
        self._model.defaults(self._address)
        self.reset()

    def _read_table(self) -> dict[str, _Slot]:
        offsets = {row.name.decode(): row.offset for row in self._model.variables[: self._model.n_variables]}
        return {v.name: self._slot(v, offsets[v.name]) for v in self.descriptor.variables}

    def _slot(self, variable: Variable, offset: int) -> _Slot:
        kind = np.dtype(self._real if variable.type == "real" else np.int32)
        view = self._bytes[offset : offset + kind.itemsize * variable.size].view(kind)
        column_type = {"real": np.float64, "boolean": np.bool_}.get(variable.type, np.int32)
        row_shape = (variable.size,) if variable.size > 1 else ()
        return _Slot(variable, offset, view, np.dtype(column_type), row_shape)

    def set(self, name: str, values: ArrayLike) -> None:
        """Write the elements of a parameter or an input; the caller has checked them."""
        self._slots[name].view[:] = values

    def get(self, name: str) -> NDArray[np.float64] | NDArray[np.int32]:
        """Elements of a variable as they are now."""
        slot = self._slots[name]
        return slot.view.astype(np.float64) if slot.is_real else slot.view.astype(np.int32)

    def reset(self) -> None:
        """State as before the first sample."""
        self._model.init(self._address)

    def update(self, dt: float) -> None:
        """Take in the inputs, `dt` seconds after the last time."""
        self._model.update(self._address, dt)

    def compute_outputs(self) -> None:
        """Bring the output variables up to date with the state."""
        self._model.compute_outputs(self._address)

    def save(self) -> bytes:
        """Everything the instance is, as bytes for `restore`."""
        return self._bytes.tobytes()

    def restore(self, saved: bytes) -> None:
        """Become what `save` kept."""
        self._bytes[:] = np.frombuffer(saved, dtype=np.uint8)

    @property
    def state_size(self) -> int:
        """Bytes of the state."""
        return int(self._model.state.size)

    def run(
        self, dt: ArrayLike, inputs: Mapping[str, NDArray[np.generic]], outputs: Sequence[str]
    ) -> dict[str, NDArray[np.generic]]:
        """Run over rows of inputs in one call.

        Parameters
        ----------
        dt : array_like, shape (N,)
            Seconds since the row before; 0 for a first row that only initialises.
        inputs : mapping of str to ndarray, shape (N,) or (N, size)
            Columns of the input variables; inputs not named keep their value.
        outputs : sequence of str
            Output variables wanted.

        Returns
        -------
        dict of str to ndarray
            Each output with shape (N,) or (N, size): float64, bool, or int32.
        """
        steps = np.ascontiguousarray(dt, dtype=np.float64)
        given = {
            name: np.ascontiguousarray(column, dtype=self._slots[name].column_type)
            for name, column in inputs.items()
        }
        found = self._empty_columns(outputs, len(steps))
        self._library.ahrs_native_run(
            ctypes.addressof(self._model),
            self._address,
            len(steps),
            steps.ctypes.data,
            self._columns(given),
            len(given),
            self._columns(found),
            len(found),
        )
        return found

    def _columns(self, arrays: Mapping[str, NDArray[np.generic]]) -> ctypes.Array[_Column]:
        columns = [self._slots[name].column(array.ctypes.data) for name, array in arrays.items()]
        return (_Column * len(columns))(*columns)

    def _empty_columns(self, names: Sequence[str], rows: int) -> dict[str, NDArray[np.generic]]:
        """Columns in one piece of memory, which a system hands out faster than many small ones."""
        # The larger elements first: that keeps all of them aligned.
        slots = sorted((self._slots[name] for name in names), key=lambda slot: -slot.column_type.itemsize)
        sizes = [rows * slot.column_type.itemsize * slot.variable.size for slot in slots]
        memory = np.empty(sum(sizes), dtype=np.uint8)
        starts = accumulate(sizes, initial=0)
        return {
            slot.variable.name: np.ndarray((rows, *slot.row_shape), slot.column_type, memory, start)
            for slot, start in zip(slots, starts, strict=False)
        }

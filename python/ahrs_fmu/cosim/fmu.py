"""FMUs as steppers: the only module that runs FMUs, and so the only one that needs FMPy to do it."""

from __future__ import annotations

import ctypes
import re
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZipFile

import fmpy
import numpy as np
from fmpy import fmi2, fmi3
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription, ModelVariable
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu.cosim.closing import Closing
from ahrs_fmu.cosim.stepper import Array, Port
from ahrs_fmu.errors import FmuError, ParameterError, known_names
from ahrs_fmu.records import Record

Value = bool | float | str | Sequence[float] | NDArray[np.generic]
"""What a parameter can be: a number, a Boolean, the name of an enumeration's item, or an array."""

ELEMENT = re.compile(r"(?P<name>.+)\[(?P<index>\d+(?:,\d+)*)\]")
"""Name of an element of an array, where variables are scalars."""

_STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")
_FIRST_BAD_STATUS = 2
_PROGRESS_ROWS = 500

_ACCESS: Mapping[int, Mapping[str, tuple[str, Any]]] = {
    2: {
        "Real": ("Real", ctypes.c_double),
        "Integer": ("Integer", ctypes.c_int),
        "Enumeration": ("Integer", ctypes.c_int),
        "Boolean": ("Boolean", ctypes.c_int),
    },
    3: {
        "Float64": ("Float64", ctypes.c_double),
        "Float32": ("Float32", ctypes.c_float),
        "Int32": ("Int32", ctypes.c_int32),
        "Int64": ("Int64", ctypes.c_int64),
        "Enumeration": ("Int64", ctypes.c_int64),
        "Boolean": ("Boolean", ctypes.c_bool),
    },
}
"""By FMI version and variable type: which functions get and set it, and the C type of one element."""


@dataclass(frozen=True, slots=True)
class _Variable:
    """A variable with all its elements, however the FMU lists them."""

    name: str
    access: str
    element: Any
    references: tuple[int, ...]
    shape: tuple[int, ...]
    causality: str
    unit: str
    items: Mapping[str, int]

    @property
    def size(self) -> int:
        return int(np.prod(self.shape, dtype=int))

    @property
    def port(self) -> Port:
        return Port(self.unit, self.shape, self.items, self.access == "Boolean")


class Fmu(Closing):
    """A co-simulation FMU of version 2.0 or 3.0, unpacked as long as this object is open.

    Parameters
    ----------
    path : str or Path
        The .fmu file.

    Raises
    ------
    FmuError
        It is no FMU for co-simulation.
    OSError
        The file cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.path.open("rb").close()
        try:
            self.description: ModelDescription = fmpy.read_model_description(str(path), validate=False)
        # FMPy passes on whatever the ZIP and XML readers raise.
        except Exception as error:
            raise FmuError(f"{self.path.name}: is not an FMU: {error}") from None
        self.version = int(str(self.description.fmiVersion).partition(".")[0])
        if self.version not in _ACCESS or self.description.coSimulation is None:
            raise FmuError(
                f"{self.path.name}: is FMI {self.description.fmiVersion}; only 2.0 and 3.0 co-simulation runs"
            )
        self._check_platform()
        self.variables = {v.name: v for v in _gathered(self.description, self.version)}
        self._folder = TemporaryDirectory(prefix="ahrs-fmu-", ignore_cleanup_errors=True)
        self.folder = str(fmpy.extract(str(path), self._folder.name))
        self._instances: list[FmuStepper] = []

    def _check_platform(self) -> None:
        with ZipFile(self.path) as archive:
            parts = [name.split("/") for name in archive.namelist()]
        held = sorted({part[1] for part in parts if part[0] == "binaries" and len(part) > 2})
        wanted = fmpy.platform if self.version == 2 else fmpy.platform_tuple
        if wanted not in held:
            raise FmuError(
                f"{self.path.name}: has no binary for {wanted}, only for {', '.join(held) or 'no platform'}: "
                "export it for this platform"
            )

    def instantiate(
        self, parameters: Mapping[str, Value] | None = None, start_time: float = 0.0
    ) -> FmuStepper:
        """Make an instance; it is closed with this object unless it is closed before.

        Parameters
        ----------
        parameters : mapping of str to value, optional
            Parameters that differ from their defaults; an enumeration by the name of its item.
        start_time : float
            Time of the initial state, s.

        Raises
        ------
        ParameterError
            A parameter is unknown, or its value is of the wrong kind.
        FmuError
            The FMU refused a call; the message carries what it logged.
        """
        stepper = FmuStepper(self, parameters or {}, start_time)
        self._instances.append(stepper)
        return stepper

    def close(self) -> None:
        """Free the instances and remove the unpacked files."""
        for stepper in self._instances:
            stepper.close()
        self._instances.clear()
        self._folder.cleanup()


@dataclass(frozen=True, slots=True)
class SavedState:
    """State of an FMU as bytes, and the communication point it belongs to."""

    data: bytes
    anchor: float
    count: int
    dt: float


class FmuStepper:
    """One instance of an FMU behind the `Stepper` protocol.

    A new instance is in initialisation: inputs set now shape the initial state, which the first `step`,
    or `initialise`, completes. See `Fmu.instantiate` for the arguments.
    """

    never_fails = False

    def __init__(self, fmu: Fmu, parameters: Mapping[str, Value], start_time: float) -> None:
        self.fmu = fmu
        self._log: deque[str] = deque(maxlen=20)
        self._single: dict[str, _Bank] = {}
        self._groups: dict[tuple[str, ...], list[_Bank]] = {}
        self._fresh = True
        self._instance = self._instantiate()
        self._step_results = [ctypes.byref(t()) for t in (ctypes.c_bool,) * 3 + (ctypes.c_double,)]
        self._open = True
        try:
            self.restart(parameters, start_time)
        except BaseException:
            self.close()
            raise

    @property
    def inputs(self) -> Mapping[str, Port]:
        """The input variables."""
        return self._ports("input")

    @property
    def outputs(self) -> Mapping[str, Port]:
        """The output variables."""
        return self._ports("output")

    @property
    def time(self) -> float:
        """Communication point the instance is at, s."""
        # A multiple of the step: adding steps up would drift away from the grid.
        return self._anchor + self._count * self._dt

    def restart(self, parameters: Mapping[str, Value], start_time: float = 0.0) -> None:
        """Begin anew with other parameters, in the same instance.

        Raises
        ------
        ParameterError
            A parameter is unknown, or its value is of the wrong kind.
        FmuError
            The FMU refused a call.
        """
        values = {name: self._parameter_value(name, value) for name, value in parameters.items()}
        if not self._fresh:
            self._call(self._instance.reset)
        self._fresh, self._initialised = False, False
        self._parameters, self._start_time = dict(parameters), start_time
        self._anchor, self._count, self._dt = start_time, 0, 0.0
        for name, value in values.items():
            self.set(name, value)
        if self.fmu.version == 2:
            self._call(self._instance.setupExperiment, None, start_time)
            self._call(self._instance.enterInitializationMode)
        else:
            self._call(self._instance.enterInitializationMode, None, start_time)

    def reset(self) -> None:
        """Return to the state of a fresh instance with the same parameters."""
        self.restart(self._parameters, self._start_time)

    def initialise(self) -> None:
        """Complete the initialisation with the inputs set so far; the outputs are then the initial ones."""
        if not self._initialised:
            self._call(self._instance.exitInitializationMode)
            self._initialised = True

    def set(self, name: str, value: ArrayLike) -> None:
        """Set an input, or a parameter that may still change."""
        bank = self._bank(name)
        bank.write(name, value)
        self._call(bank.set)

    def get(self, name: str) -> Array:
        """Return a variable as it is now."""
        bank = self._bank(name)
        self._call(bank.get)
        return bank.read(name)

    def set_all(self, values: Mapping[str, ArrayLike]) -> None:
        """Set several inputs, those of one type in one call."""
        for bank in self._grouped(tuple(values)):
            for name in bank.names:
                bank.write(name, values[name])
            self._call(bank.set)

    def get_all(self, names: Sequence[str]) -> dict[str, Array]:
        """Return several variables as they are now, those of one type from one call."""
        found: dict[str, Array] = {}
        for bank in self._grouped(tuple(names)):
            self._call(bank.get)
            found |= {name: bank.read(name) for name in bank.names}
        return found

    def step(self, dt: float) -> None:
        """Advance the time by `dt` seconds."""
        self.initialise()
        if dt != self._dt:
            self._anchor, self._count, self._dt = self.time, 0, dt
        self._call(self._do_step, self.time, dt)
        self._count += 1

    def save(self) -> SavedState:
        """Return the complete state as bytes, with the time it belongs to."""
        self.initialise()
        state = self._call(self._instance.getFMUState)
        try:
            data = self._call(self._instance.serializeFMUState, state)
        finally:
            self._call(self._instance.freeFMUState, state)
        return SavedState(data, self._anchor, self._count, self._dt)

    def restore(self, state: SavedState) -> None:
        """Continue from what `save` returned."""
        self.initialise()
        held = self._call(self._instance.deserializeFMUState, state.data)
        try:
            self._call(self._instance.setFMUState, held)
        finally:
            self._call(self._instance.freeFMUState, held)
        self._anchor, self._count, self._dt = state.anchor, state.count, state.dt

    def replay(
        self, inputs: Mapping[str, Array], outputs: Sequence[str], dt: float, rows: int | None = None
    ) -> dict[str, Array]:
        """Take a whole record; see `ahrs_fmu.cosim.stepper.Replayer`."""
        rows = len(next(iter(inputs.values()))) if rows is None else rows
        return self.run(np.full(rows, dt), inputs, outputs)

    def run(
        self,
        dt: Array,
        inputs: Mapping[str, Array],
        outputs: Sequence[str],
        progress: Callable[[int], None] | None = None,
    ) -> dict[str, Array]:
        """Step over rows of inputs.

        Parameters
        ----------
        dt : ndarray, shape (N,)
            Length of the step that ends at each row, s; 0 completes the initialisation instead.
        inputs : mapping of str to ndarray, shape (N, ...)
            Row k is set before the step that ends at row k.
        outputs : sequence of str
            The outputs to record.
        progress : callable, optional
            Called now and then with the number of rows done since the last call.

        Returns
        -------
        dict of str to ndarray, shape (N, ...)
            Row k holds the outputs after step k.
        """
        banks_in = [(bank, bank.packed(inputs)) for bank in self._banks(inputs)]
        banks_out = [(bank, np.empty((len(dt), bank.size))) for bank in self._banks(outputs)]
        for k, step in enumerate(dt.tolist()):
            for bank, rows in banks_in:
                bank.flat[:] = rows[k]
                self._call(bank.set)
            if step > 0.0:
                self.step(step)
            else:
                self.initialise()
            for bank, rows in banks_out:
                self._call(bank.get)
                rows[k] = bank.flat
            if progress is not None and (k + 1) % _PROGRESS_ROWS == 0:
                progress(_PROGRESS_ROWS)
        if progress is not None:
            progress(len(dt) % _PROGRESS_ROWS)
        found: dict[str, Array] = {}
        for bank, rows in banks_out:
            found |= bank.unpacked(rows)
        return {name: found[name] for name in outputs}

    def close(self) -> None:
        """Free the instance; calling it again does nothing."""
        if self._open:
            self._open = False
            self._instance.freeInstance()

    def _instantiate(self) -> Any:
        def log(*arguments: Any) -> None:
            # FMI 2 passes the instance's name besides; both end in status, category, message.
            status, _, message = arguments[-3:]
            if status >= _FIRST_BAD_STATUS:
                self._log.append(message.decode("utf-8", errors="replace"))

        slave = fmi2.FMU2Slave if self.fmu.version == 2 else fmi3.FMU3Slave
        try:
            instance = slave(
                guid=self.fmu.description.guid,
                modelIdentifier=self.fmu.description.coSimulation.modelIdentifier,
                unzipDirectory=self.fmu.folder,
                instanceName=self.fmu.description.modelName,
            )
            if self.fmu.version == 2:
                # FMPy's own way of passing a logger keeps one for the whole process, which outlives ours.
                instance.instantiate(callbacks=_callbacks(log), loggingOn=True)
            else:
                instance.instantiate(logMessage=log, loggingOn=True)
        # FMPy raises bare exceptions here.
        except Exception as error:
            raise self._error(str(error)) from None
        return instance

    def _call(self, function: Callable[..., Any], *args: Any) -> Any:
        try:
            return function(*args)
        except FMICallException as error:
            raise self._error(f"{error.function} failed ({_STATUS[error.status]})") from None

    def _error(self, what: str) -> FmuError:
        logged = "; ".join(self._log)
        self._log.clear()
        return FmuError(f"{self.fmu.path.name}: {what}{': ' if logged else ''}{logged}")

    def _do_step(self, time: float, dt: float) -> None:
        component = self._instance.component
        # "May go back later" is always a true answer and costs our FMUs nothing.
        if self.fmu.version == 2:
            self._instance.fmi2DoStep(component, time, dt, 0)
        else:
            self._instance.fmi3DoStep(component, time, dt, False, *self._step_results)

    def _ports(self, causality: str) -> dict[str, Port]:
        return {v.name: v.port for v in self.fmu.variables.values() if v.causality == causality}

    def _bank(self, name: str) -> _Bank:
        if name not in self._single:
            self._single[name] = _Bank(self._instance, self.fmu.version, [self._variable(name)])
        return self._single[name]

    def _grouped(self, names: tuple[str, ...]) -> list[_Bank]:
        if names not in self._groups:
            self._groups[names] = self._banks(names)
        return self._groups[names]

    def _banks(self, names: Iterable[str]) -> list[_Bank]:
        variables = [self._variable(name) for name in names]
        groups = dict.fromkeys(v.access for v in variables)
        return [
            _Bank(self._instance, self.fmu.version, [v for v in variables if v.access == access])
            for access in groups
        ]

    def _variable(self, name: str) -> _Variable:
        try:
            return self.fmu.variables[name]
        except KeyError:
            raise ParameterError(f"{self.fmu.path.name} has no variable {name!r}") from None

    def _parameter_value(self, name: str, value: Value) -> ArrayLike:
        variable = self.fmu.variables.get(name)
        if variable is None or variable.causality != "parameter":
            parameters = (v.name for v in self.fmu.variables.values() if v.causality == "parameter")
            known = known_names(name, parameters)
            raise ParameterError(f"{self.fmu.path.name} has no parameter {name!r}; it has {known}")
        if not isinstance(value, str):
            return value
        if value not in variable.items:
            choices = f"one of {', '.join(variable.items)}" if variable.items else "a number"
            raise ParameterError(f"{name} = {value!r}: it must be {choices}")
        return variable.items[value]


class _Bank:
    """Variables of one type that are set or got in one call, and the memory for their values."""

    def __init__(self, instance: Any, version: int, variables: Sequence[_Variable]) -> None:
        access, element = variables[0].access, variables[0].element
        references = [r for v in variables for r in v.references]
        size = sum(v.size for v in variables)
        vr = (ctypes.c_uint * len(references))(*references)
        values = (element * size)()
        sized = (size,) if version == 3 else ()
        arguments = (instance.component, vr, len(references), values, *sized)
        setter, getter = (getattr(instance, f"fmi{version}{verb}{access}") for verb in ("Set", "Get"))
        self.set: Callable[[], int] = lambda: setter(*arguments)
        self.get: Callable[[], int] = lambda: getter(*arguments)
        self.size = size
        self.flat = np.ctypeslib.as_array(values)
        self.names = [v.name for v in variables]
        self._variables = variables
        self._views = {name: view[0, ...] for name, view in self._split(self.flat[None]).items()}

    def _split(self, rows: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """Views of each variable (N, ...) into rows of values (N, size)."""
        ends = np.cumsum([v.size for v in self._variables])
        parts = np.split(rows, ends[:-1], axis=1)
        return {v.name: part.reshape(-1, *v.shape) for v, part in zip(self._variables, parts, strict=True)}

    def packed(self, columns: Mapping[str, Array]) -> Array:
        """Rows of values (N, size) for `flat` from a column (N, ...) for each variable."""
        for v in self._variables:
            if columns[v.name].shape[1:] != v.shape:
                shape = columns[v.name].shape
                raise ParameterError(f"{v.name} has rows of shape {shape[1:]}; expected {v.shape}")
        return np.concatenate([columns[v.name].reshape(-1, v.size) for v in self._variables], axis=1)

    def unpacked(self, rows: Array) -> dict[str, Array]:
        """Column (N, ...) of each variable from rows of values (N, size)."""
        return {name: np.ascontiguousarray(part) for name, part in self._split(rows).items()}

    def write(self, name: str, value: ArrayLike) -> None:
        """Put a value where `set` takes it from."""
        view = self._views[name]
        array = np.asarray(value)
        if array.shape != view.shape:
            raise ParameterError(f"{name} has shape {array.shape}; expected {view.shape}")
        if view.dtype.kind != "f" and (array != np.rint(array)).any():
            raise ParameterError(f"{name} = {array}: it must be a whole number")
        view[...] = array

    def read(self, name: str) -> Array:
        """Value that `get` left."""
        return np.array(self._views[name], dtype=np.float64)


def replay_record(
    stepper: FmuStepper, record: Record, progress: Callable[[int], None] | None = None
) -> dict[str, Array]:
    """Run a freshly started estimator FMU over a recording.

    Parameters
    ----------
    stepper : FmuStepper
        In initialisation; its parameters, frame among them, must fit the record.
    record : Record
        Row 0 is set before the initialisation ends, row k before the step that ends at its time.
    progress : callable, optional
        Called now and then with the number of rows done since the last call.

    Returns
    -------
    dict of str to ndarray, shape (N, ...)
        Every output of the FMU. Its ticks lie on a regular grid, so that rows of an irregular
        recording show the output of the last tick.
    """
    columns = {
        "gyro": record.gyro,
        "accel": record.accel,
        "mag": record.mag,
        "accel_valid": record.accel_valid.astype(np.float64),
        "mag_valid": record.mag_valid.astype(np.float64),
    }
    inputs = {name: column for name, column in columns.items() if name in stepper.inputs}
    return stepper.run(record.steps, inputs, list(stepper.outputs), progress)


def _callbacks(log: Callable[..., None]) -> Any:
    """Callbacks of FMI 2; what an FMU passes to `log` beyond the format of a message is not seen."""
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(log)
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    return callbacks


def _gathered(description: ModelDescription, version: int) -> list[_Variable]:
    """Join elements such as ``q[1]`` ... ``q[4]``, which FMI 2 has to list one by one."""
    groups: dict[str, list[tuple[tuple[int, ...], ModelVariable]]] = {}
    for variable in description.modelVariables:
        element = ELEMENT.fullmatch(variable.name)
        name = element["name"] if element else variable.name
        index = tuple(map(int, element["index"].split(","))) if element else ()
        if variable.type in _ACCESS[version]:
            groups.setdefault(name, []).append((index, variable))
    return [_joined(name, sorted(elements, key=lambda e: e[0]), version) for name, elements in groups.items()]


def _joined(name: str, elements: list[tuple[tuple[int, ...], ModelVariable]], version: int) -> _Variable:
    first = elements[0][1]
    access, element = _ACCESS[version][first.type]
    declared = tuple(int(d.start) for d in first.dimensions)
    items = first.declaredType.items if first.declaredType is not None else []
    return _Variable(
        name=name,
        access=access,
        element=element,
        references=tuple(variable.valueReference for _, variable in elements),
        shape=declared or elements[-1][0],
        causality=first.causality,
        unit=first.unit or (first.declaredType.unit if first.declaredType is not None else None) or "",
        items={item.name: int(item.value) for item in items},
    )

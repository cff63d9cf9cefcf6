"""A small importer: the FMUs driven through their C functions, with every argument in the test's hand."""

from __future__ import annotations

import ctypes
import os
import zipfile
from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu.toolchain import host_platform, suffix

OK, WARNING, DISCARD, ERROR = range(4)

_PLATFORM_2 = {"linux": "linux64", "windows": "win64", "darwin": "darwin64"}
_LOG_2 = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
_LOG_3 = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)


class _Callbacks2(ctypes.Structure):
    _fields_ = [
        ("logger", _LOG_2),
        ("allocate", c_void_p),
        ("free", c_void_p),
        ("step_finished", c_void_p),
        ("environment", c_void_p),
    ]


@dataclass(frozen=True)
class Known:
    """What the model description says of a variable."""

    vrs: tuple[int, ...]
    size: int
    type: str


@dataclass(frozen=True)
class LogLine:
    """One call of the importer's logger."""

    status: int
    category: str
    message: str


class Library:
    """An FMU unpacked and loaded."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder)
        self.folder = folder
        root = ElementTree.parse(folder / "modelDescription.xml").getroot()
        self.version = int(root.attrib["fmiVersion"][0])
        self.token = root.attrib["guid" if self.version == 2 else "instantiationToken"]
        self.title = root.attrib["modelName"]
        self.variables = self._read_2(root) if self.version == 2 else self._read_3(root)
        platform = host_platform()
        name = platform if self.version == 3 else _PLATFORM_2[platform.rsplit("-", 1)[1]]
        self.binary = folder / "binaries" / name / f"{self.title}{suffix(platform)}"
        self.c = ctypes.CDLL(str(self.binary))
        resources = folder.resolve() / "resources"
        self.resources = resources.as_uri().encode() if self.version == 2 else f"{resources}{os.sep}".encode()

    @staticmethod
    def _group(rows: list[tuple[str, int, int, str]]) -> dict[str, Known]:
        found: dict[str, Known] = {}
        for name, vr, size, kind in rows:
            base = name.split("[")[0]
            before = found.get(base, Known((), 0, kind))
            found[base] = Known((*before.vrs, vr), before.size + size, kind)
        return found

    def _read_2(self, root: ElementTree.Element) -> dict[str, Known]:
        rows = [
            (s.attrib["name"], int(s.attrib["valueReference"]), 1, s[0].tag)
            for s in root.iterfind("ModelVariables/ScalarVariable")
        ]
        return self._group(rows)

    def _read_3(self, root: ElementTree.Element) -> dict[str, Known]:
        rows = []
        for element in root.iterfind("ModelVariables/*"):
            dimension = element.find("Dimension")
            size = 1 if dimension is None else int(dimension.attrib["start"])
            rows.append((element.attrib["name"], int(element.attrib["valueReference"]), size, element.tag))
        return self._group(rows)

    def instance(self, name: str = "one", token: str | None = None, *, logging: bool = False) -> Instance:
        """Instantiate, or raise ValueError with the log."""
        return Instance(self, name, self.token if token is None else token, logging=logging)


_REAL = ("Real", "Float64", c_double)
_KINDS = {
    2: {
        "Real": ("Real", c_double),
        "Integer": ("Integer", c_int),
        "Enumeration": ("Integer", c_int),
        "Boolean": ("Boolean", c_int),
    },
    3: {
        "Float64": ("Float64", c_double),
        "Int32": ("Int32", c_int),
        "Enumeration": ("Int64", c_int64),
        "Boolean": ("Boolean", c_bool),
    },
}


class Instance:
    """One instance; statuses are returned as they come."""

    def __init__(self, library: Library, name: str, token: str, *, logging: bool = False) -> None:
        self.library = library
        self.c = library.c
        self.version = library.version
        self.log: list[LogLine] = []
        self._references: dict[str, ctypes.Array[c_uint32]] = {}
        if self.version == 2:
            self._logger = _LOG_2(self._log_2)
            callbacks = _Callbacks2(self._logger, None, None, None, None)
            create = self.c.fmi2Instantiate
            create.restype = c_void_p
            self.handle = create(
                name.encode(), 1, token.encode(), library.resources, byref(callbacks), 0, int(logging)
            )
            # An importer may free its structure at once: nothing may read it later.
            ctypes.memset(byref(callbacks), 0xAA, ctypes.sizeof(callbacks))
        else:
            self._logger3 = _LOG_3(self._log_3)
            create = self.c.fmi3InstantiateCoSimulation
            create.restype = c_void_p
            create.argtypes = [
                c_char_p,
                c_char_p,
                c_char_p,
                c_bool,
                c_bool,
                c_bool,
                c_bool,
                c_void_p,
                c_size_t,
                c_void_p,
                _LOG_3,
                c_void_p,
            ]
            self.handle = create(
                name.encode(),
                token.encode(),
                library.resources,
                False,
                logging,
                False,
                False,
                None,
                0,
                None,
                self._logger3,
                None,
            )
        if not self.handle:
            raise ValueError(self.log)
        self.pointer = c_void_p(self.handle)
        self._step = self.c.fmi2DoStep if self.version == 2 else self.c.fmi3DoStep
        self._flags = [c_bool(), c_bool(), c_bool(), c_double()]
        self._extra = [byref(flag) for flag in self._flags]

    def _log_2(self, _env: object, _name: bytes, status: int, category: bytes, message: bytes) -> None:
        text = message.decode().replace("%%", "%").replace("##", "#")
        self.log.append(LogLine(status, category.decode(), text))

    def _log_3(self, _env: object, status: int, category: bytes, message: bytes) -> None:
        self.log.append(LogLine(status, category.decode(), message.decode()))

    def call(self, name: str, *args: object) -> int:
        """Call ``fmi2NAME`` or ``fmi3NAME``."""
        return int(self.c[f"fmi{self.version}{name}"](self.pointer, *args))

    def free(self) -> None:
        """Free the instance."""
        function = self.c[f"fmi{self.version}FreeInstance"]
        function.restype = None
        function(self.pointer)

    def start(self, time: float = 0.0) -> int:
        """Begin initialisation at `time`."""
        if self.version == 2:
            status = self.call("SetupExperiment", 0, c_double(0), c_double(time), 0, c_double(0))
            return status or self.call("EnterInitializationMode")
        return self.call(
            "EnterInitializationMode", c_bool(False), c_double(0), c_double(time), c_bool(False), c_double(0)
        )

    def run(self, time: float = 0.0, **values: ArrayLike) -> Instance:
        """Set values and go through initialisation."""
        for name, value in values.items():
            assert self.set(name, value) == OK, self.log
        assert self.start(time) == OK, self.log
        assert self.call("ExitInitializationMode") <= WARNING, self.log
        return self

    def step(self, time: float, step: float) -> int:
        """One communication step."""
        if self.version == 2:
            return int(self._step(self.pointer, c_double(time), c_double(step), 1))
        return int(self._step(self.pointer, c_double(time), c_double(step), c_bool(True), *self._extra))

    def _access(self, name: str) -> tuple[Known, str, type, ctypes.Array[c_uint32]]:
        known = self.library.variables[name]
        if name not in self._references:
            self._references[name] = (c_uint32 * len(known.vrs))(*known.vrs)
        kind, c_type = _KINDS[self.version][known.type]
        return known, kind, c_type, self._references[name]

    def set(self, name: str, values: ArrayLike) -> int:
        """Set all elements of a variable."""
        known, kind, c_type, references = self._access(name)
        cast = float if c_type is c_double else int
        data = (c_type * known.size)(*(cast(v) for v in np.atleast_1d(np.asarray(values)).ravel()))
        extra = () if self.version == 2 else (c_size_t(known.size),)
        return self.call(f"Set{kind}", references, c_size_t(len(references)), data, *extra)

    def get(self, name: str) -> NDArray[np.float64]:
        """All elements of a variable."""
        known, kind, c_type, references = self._access(name)
        data = (c_type * known.size)()
        extra = () if self.version == 2 else (c_size_t(known.size),)
        status = self.call(f"Get{kind}", references, c_size_t(len(references)), data, *extra)
        assert status == OK, self.log
        return np.array(list(data), dtype=np.float64)

    def raw(
        self,
        function: str,
        references: list[int],
        values: ctypes.Array[object] | None,
        n_values: int | None = None,
    ) -> int:
        """Get or set with references and an array as they are."""
        array = (c_uint32 * len(references))(*references)
        extra = () if self.version == 2 else (c_size_t(len(references) if n_values is None else n_values),)
        return self.call(function, array, c_size_t(len(references)), values, *extra)

    def save(self) -> c_void_p:
        """State in memory."""
        state = c_void_p()
        assert self.call(self._state("Get"), byref(state)) == OK, self.log
        return state

    def restore(self, state: c_void_p) -> int:
        """Go back to a state."""
        return self.call(self._state("Set"), state)

    def free_state(self, state: c_void_p) -> int:
        """Free a state."""
        return self.call(self._state("Free"), byref(state))

    def _state(self, verb: str) -> str:
        return f"{verb}{'FMUstate' if self.version == 2 else 'FMUState'}"

    def serialise(self) -> bytes:
        """State as bytes."""
        state, size = self.save(), c_size_t()
        upper = "FMUstate" if self.version == 2 else "FMUState"
        assert self.call(f"Serialized{upper}Size", state, byref(size)) == OK
        data = ctypes.create_string_buffer(size.value)
        assert self.call(f"Serialize{upper}", state, data, size) == OK
        assert self.free_state(state) == OK
        return data.raw

    def deserialise(self, data: bytes) -> tuple[int, c_void_p]:
        """Status, and the state where it is OK."""
        state = c_void_p()
        name = "DeSerializeFMUstate" if self.version == 2 else "DeserializeFMUState"
        return self.call(name, data, c_size_t(len(data)), byref(state)), state


class Replay:
    """A whole recording through an instance, in a loop compiled from ``tests/c/replay.c``."""

    def __init__(self, loop: ctypes.CDLL, instance: Instance) -> None:
        variables = instance.library.variables
        self._instance = instance
        self._in = np.array(
            [vr for name in ("gyro", "accel", "mag") for vr in variables[name].vrs], np.uint32
        )
        self._out = np.array(variables["q"].vrs, np.uint32)
        self._replay = loop.replay
        self._replay.restype = c_int64

    def __call__(
        self, start: ArrayLike, length: ArrayLike, row: ArrayLike, rows: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Take steps, each after setting the row named for it (none where it is negative).

        Returns the attitude after every step.
        """
        starts = np.ascontiguousarray(start, np.float64)
        lengths = np.ascontiguousarray(np.broadcast_to(length, starts.shape), np.float64)
        chosen = np.ascontiguousarray(row, np.int64)
        samples = np.ascontiguousarray(rows, np.float64)
        q = np.empty((starts.size, 4))
        version = self._instance.version
        real = "Real" if version == 2 else "Float64"
        functions = [
            ctypes.cast(self._instance.c[f"fmi{version}{name}"], c_void_p)
            for name in (f"Set{real}", "DoStep", f"Get{real}")
        ]
        done = self._replay(
            c_int(version),
            *functions,
            self._instance.pointer,
            *(x for vrs in (self._in, self._out) for x in (c_void_p(vrs.ctypes.data), c_size_t(vrs.size))),
            c_int64(starts.size),
            *(c_void_p(array.ctypes.data) for array in (starts, lengths, chosen, samples, q)),
        )
        assert done == starts.size, (done, self._instance.log)
        return q

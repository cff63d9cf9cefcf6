"""What an update costs: C core, `run`, FMUs and other libraries, with the same samples in the same minute.

Every estimator that has a descriptor takes part. The exit code is 1 when a limit is missed.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.util
import os
import platform
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from ctypes import byref, c_double, c_int32, c_int64, c_size_t, c_void_p
from functools import partial
from pathlib import Path
from typing import get_args

import msgspec
import numpy as np
from host import OK, Known, Library
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from timing import Case, Ratio, measure

from ahrs_fmu import descriptors, models
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.descriptors import Descriptor
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.variant import Fmi
from ahrs_fmu.host_library import INCLUDE_FOLDERS, Precision, library_sources
from ahrs_fmu.records import Record
from ahrs_fmu.sources import fmu_src
from ahrs_fmu.toolchain import compile_library, host_platform, suffix

RESULT = Path(__file__).resolve().parents[2] / "build" / "bench.json"
SECONDS = 5.0
"""Time to measure an estimator in."""
DT = 0.01
ROWS = 2_000
"""Few, so that a repetition often falls into a quiet moment."""
RECORDING_ROWS = 20_000
"""Of what works on whole recordings."""
PYTHON_ROWS = 100
"""Of what takes tens of microseconds for one."""

CACHE_LINE = 64

UPDATE_OF_VQF = 0.12
MEKF_OF_GCF = 3.0
STEP_OF_UPDATE = 2.0
RUN_OF_LOOP = 1.3

GCF = "gcf: update, double"
"""What every other cost is compared with."""
FMIS: tuple[Fmi, ...] = ("2", "3")
OTHERS = ("gcf, ", "VQF", "imufusion", "ahrs ")
COSTS = {
    "double": "update, double",
    "single": "update, single",
    "C loop": "C loop",
    "run": "run",
    **{f"fmi{fmi}": f"FMI {fmi} step" for fmi in FMIS},
    **{f"fmi{fmi}*": f"FMI {fmi} set+step+get" for fmi in FMIS},
}
"""Headings of the table of costs, and what they stand for."""
LEGEND = (
    "ns per sample. double, single: update in C; C loop: a recording, all outputs; run: the same from "
    "Python; fmi: one step; fmi*: sensors set, one step, real outputs got"
)

OUT = Console(highlight=False)
Array = NDArray[np.float64]


class _Importer(ctypes.Structure):
    """`importer` of loops.c."""

    _fields_ = [
        *((name, c_void_p) for name in ("instance", "set", "step", "get", "in_", "out")),
        *((name, c_size_t) for name in ("n_in", "n_out", "n_values")),
    ]


def compile_loops(precision: Precision, folder: Path) -> ctypes.CDLL:
    """The loops together with all models."""
    library = compile_library(
        [*library_sources(), Path(__file__).with_name("loops.c")],
        folder / f"loops_{precision}{suffix(host_platform())}",
        include=[fmu_src() / name for name in INCLUDE_FOLDERS],
        define=["AHRS_SINGLE"] if precision == "single" else [],
        hide_symbols=False,
    )
    loops = ctypes.CDLL(str(library))
    loops.bench_size.restype = loops.bench_outputs_size.restype = c_size_t
    return loops


def is_estimator(descriptor: Descriptor) -> bool:
    """Whether a model estimates the attitude."""
    return descriptor.interface is not None and descriptor.interface.name == "estimator"


def variants(descriptor: Descriptor) -> list[tuple[str, str, int]]:
    """Name of a case with the enumeration and value that make it: each realisation, if there are several."""
    for parameter in descriptor.parameters:
        if parameter.name == "realisation":
            items = descriptor.enumeration_of(parameter).items
            default = descriptor.numbers(parameter, parameter.default)[0]
            others = {item.value: f", {item.name}" for item in items if item.value != default}
            return [(f"{descriptor.name}{others.get(i.value, '')}", parameter.name, i.value) for i in items]
    return [(descriptor.name, "", 0)]


def aligned(size: int) -> NDArray[np.uint8]:
    """Zeros that begin with a line of the cache, so that chance does not favour one case."""
    memory = np.zeros(size + CACHE_LINE, dtype=np.uint8)
    start = -memory.ctypes.data % CACHE_LINE
    return memory[start : start + size]


class CoreLoop:
    """A C loop over an instance of a model: ``held``, ``update`` or ``outputs`` of loops.c."""

    def __init__(
        self, loops: ctypes.CDLL, model: str, loop: str, samples: Array, enumeration: str = "", value: int = 0
    ) -> None:
        self._model = byref(ctypes.c_char.in_dll(loops, f"ahrs_{model}_model"))
        self._memory = aligned(loops.bench_size(self._model))
        self._instance = c_void_p(self._memory.ctypes.data)
        self._samples = samples
        self._outputs = np.zeros(len(samples) * loops.bench_outputs_size(self._model), dtype=np.uint8)
        self._loop = loops[f"bench_{loop}"]
        loops.bench_begin(self._model, self._instance, enumeration.encode(), c_int32(value))
        loops.bench_update(*self._arguments())  # so that an input that is held is one

    def _arguments(self) -> tuple[object, ...]:
        arrays = (c_void_p(array.ctypes.data) for array in (self._samples, self._outputs))
        return self._model, self._instance, c_int64(len(self._samples)), c_double(DT), *arrays

    def __call__(self) -> None:
        self._loop(*self._arguments())


def core_cases(
    descriptor: Descriptor, precision: Precision, loops: ctypes.CDLL, samples: Array
) -> Iterator[Case]:
    """Updates in a C loop: with new samples, and with the last one held."""
    name, rows = descriptor.name, len(samples)
    reals = samples if precision == "double" else samples.astype(np.float32)
    for label, enumeration, value in variants(descriptor):
        loop = CoreLoop(loops, name, "update", reals, enumeration, value)
        yield Case(f"{label}: update, {precision}", loop, rows)
    if precision == "double":
        yield Case(f"{name}: update, input held", CoreLoop(loops, name, "held", reals), rows)


def run_cases(descriptor: Descriptor, loops: ctypes.CDLL, samples: Array, flight: Record) -> Iterator[Case]:
    """A recording through `run`, and through a C loop that computes the same outputs."""
    name, rows = descriptor.name, len(flight)
    estimator = models.BY_NAME[name](sample_time=DT)
    yield Case(f"{name}: C loop", CoreLoop(loops, name, "outputs", samples), rows)
    yield Case(f"{name}: run", lambda: estimator.run(flight), rows)


class FmuLoop:
    """An importer in C: steps of one tick, alone or between setting the sensors and getting the outputs."""

    def __init__(
        self, loops: ctypes.CDLL, library: Library, samples: Array, outputs: Sequence[str], *, alone: bool
    ) -> None:
        known = library.variables
        self._samples = samples
        self._in = _references(known, ("gyro", "accel", "mag"))
        self._out = _references(known, outputs)
        self._values = np.empty(sum(known[name].size for name in outputs))
        self._steps = 0
        gyro, accel, mag = samples[0].reshape(3, 3)
        self._instance = library.instance().run(sample_time=DT, gyro=gyro, accel=accel, mag=mag)
        real = "Real" if library.version == 2 else "Float64"
        self._importer = _Importer(
            self._instance.pointer,
            *(ctypes.cast(self._function(name), c_void_p) for name in (f"Set{real}", "DoStep", f"Get{real}")),
            self._in.ctypes.data,
            self._out.ctypes.data,
            *((0, 0, 0) if alone else (self._in.size, self._out.size, self._values.size)),
        )
        self._loop = loops[f"bench_fmi{library.version}"]

    def _function(self, name: str) -> ctypes._CFuncPtr:
        return self._instance.c[f"fmi{self._instance.version}{name}"]

    def __call__(self) -> None:
        rows = len(self._samples)
        arrays = (c_void_p(array.ctypes.data) for array in (self._samples, self._values))
        status = self._loop(byref(self._importer), c_int64(self._steps), c_int64(rows), c_double(DT), *arrays)
        if status != OK:
            raise RuntimeError(f"a step failed: {self._instance.log}")
        self._steps += rows


def _references(known: Mapping[str, Known], names: Iterable[str]) -> NDArray[np.uint32]:
    return np.array([vr for name in names for vr in known[name].vrs], np.uint32)


def fmu_cases(
    descriptor: Descriptor, fmi: Fmi, loops: ctypes.CDLL, samples: Array, folder: Path
) -> Iterator[Case]:
    """Steps of one tick through an FMU, alone and with input and output."""
    library = Library(build_fmu(descriptor.name, fmi=fmi, output=folder), folder / f"{descriptor.name}-{fmi}")
    outputs = [output.name for output in descriptor.outputs if output.type == "real"]
    for what, alone in (("step", True), ("set+step+get", False)):
        loop = FmuLoop(loops, library, samples, outputs, alone=alone)
        yield Case(f"{descriptor.name}: FMI {fmi} {what}", loop, len(samples))


def peer_cases(flight: Record) -> Iterator[Case]:
    """Other libraries, where they are installed."""
    gyro, accel, mag = (np.ascontiguousarray(x) for x in (flight.gyro, flight.accel, flight.mag))
    if importlib.util.find_spec("vqf") is not None:
        filter_ = importlib.import_module("vqf").VQF(DT)
        yield Case("VQF: updateBatch", lambda: filter_.updateBatch(gyro, accel, mag), len(gyro))
    if importlib.util.find_spec("imufusion") is not None:
        ahrs = importlib.import_module("imufusion").Ahrs()
        rows = list(zip(np.degrees(gyro), accel / 9.80665, mag * 1e6, strict=True))

        def call() -> None:
            update = ahrs.update
            for row in rows:
                update(*row)

        yield Case("imufusion: update from Python", call, len(rows))
    if importlib.util.find_spec("ahrs") is not None:
        filters = importlib.import_module("ahrs.filters")
        few = {"gyr": gyro[:PYTHON_ROWS], "acc": accel[:PYTHON_ROWS], "mag": 1e9 * mag[:PYTHON_ROWS]}
        for name in ("Madgwick", "EKF"):
            whole = partial(getattr(filters, name), **few, frequency=1.0 / DT)
            yield Case(f"ahrs {name}: recording from Python", whole, PYTHON_ROWS)


def ratios(name: str) -> dict[str, Ratio]:
    """What is compared for an estimator, and the limits, by the heading of the table."""
    is_gcf = name == "gcf"
    update, held, recorded = (
        f"{name}: {what}" for what in ("update, double", "update, input held", "C loop")
    )
    return {
        "/ GCF": Ratio(update, GCF, MEKF_OF_GCF if name == "mekf" else None),
        "/ VQF": Ratio(update, "VQF: updateBatch", UPDATE_OF_VQF if is_gcf else None),
        "run / loop": Ratio(f"{name}: run", recorded, RUN_OF_LOOP if is_gcf else None),
        **{f"FMI {fmi} / update": Ratio(f"{name}: FMI {fmi} step", held, STEP_OF_UPDATE) for fmi in FMIS},
    }


def shown(ratio: Ratio, cases: dict[str, Case]) -> str:
    """A ratio, or why it is missing."""
    value = ratio.value(cases)
    if value is None:
        return "no peer"
    return f"{value:.2f}{' MISSED' if ratio.is_missed(cases) else ''}"


def heading_of(column: str, compared: dict[str, dict[str, Ratio]]) -> str:
    """Heading of a column of ratios, with its limit."""
    limits = {name: row[column].limit for name, row in compared.items() if row[column].limit is not None}
    if not limits:
        return column
    limit = f"at most {next(iter(limits.values())):g}"
    return f"{column}\n{limit if len(limits) == len(compared) else f'{next(iter(limits))} {limit}'}"


def show(cases: dict[str, Case], compared: dict[str, dict[str, Ratio]]) -> None:
    """Print the costs and the ratios."""
    costs = Table(box=SIMPLE_HEAD, pad_edge=False)
    costs.add_column("ns", no_wrap=True)
    for heading in COSTS:
        costs.add_column(heading, justify="right", no_wrap=True)
    for name in compared:
        found = (cases.get(f"{name}: {what}") for what in COSTS.values())
        costs.add_row(name, *("" if case is None else f"{case.ns:.0f}" for case in found))
    OUT.print(costs)
    OUT.print(LEGEND)
    for case in cases.values():
        if case.name.startswith(OTHERS):
            OUT.print(f"{case.name}: {case.ns:.0f} ns, {case.ns / cases[GCF].ns:.1f} GCF")
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("ratio", no_wrap=True)
    for column in next(iter(compared.values())):
        table.add_column(heading_of(column, compared), justify="right")
    for name, row in compared.items():
        missed = any(ratio.is_missed(cases) for ratio in row.values())
        table.add_row(name, *(shown(r, cases) for r in row.values()), style="red" if missed else None)
    OUT.print(table)


def write(cases: dict[str, Case], compared: dict[str, dict[str, Ratio]]) -> None:
    """Keep the figures as JSON."""
    found = {
        "machine": {
            "platform": platform.platform(),
            "processors": os.cpu_count(),
            "python": platform.python_version(),
        },
        "cases": [
            {
                "name": case.name,
                "rows": case.rows,
                "repetitions": len(case.times),
                "ns": round(case.ns, 2),
                "median_ns": round(case.median_ns, 2),
            }
            for case in cases.values()
        ],
        "ratios": [
            {"case": ratio.case, "base": ratio.base, "value": ratio.value(cases), "limit": ratio.limit}
            for row in compared.values()
            for ratio in row.values()
        ],
    }
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_bytes(msgspec.json.format(msgspec.json.encode(found)) + b"\n")


def main() -> int:
    """Measure, show, keep."""
    flight = demo_flight(duration=(RECORDING_ROWS - 1) * DT)
    recorded = np.ascontiguousarray(np.hstack((flight.gyro, flight.accel, flight.mag)))
    samples = recorded[:ROWS]
    estimators = [d for d in map(descriptors.load, descriptors.names()) if is_estimator(d)]
    cases: dict[str, Case] = {}
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch,
        Progress(console=OUT, transient=True) as progress,
    ):
        folder = Path(scratch)
        loops = {precision: compile_loops(precision, folder) for precision in get_args(Precision)}
        references = [
            *peer_cases(flight.rows(0, ROWS)),
            Case(GCF, CoreLoop(loops["double"], "gcf", "update", samples), ROWS),
        ]
        for descriptor in progress.track(estimators, description="timing"):
            own = [
                case
                for precision, library in loops.items()
                for case in core_cases(descriptor, precision, library, samples)
            ]
            own += run_cases(descriptor, loops["double"], recorded, flight)
            for fmi in FMIS:
                own += fmu_cases(descriptor, fmi, loops["double"], samples, folder)
            together = {case.name: case for case in [*own, *references]}
            measure(list(together.values()), SECONDS)
            cases |= together
    compared = {d.name: ratios(d.name) for d in estimators}
    show(cases, compared)
    write(cases, compared)
    OUT.print(f"figures: {RESULT}", soft_wrap=True)
    return 1 if any(r.is_missed(cases) for row in compared.values() for r in row.values()) else 0


if __name__ == "__main__":
    sys.exit(main())

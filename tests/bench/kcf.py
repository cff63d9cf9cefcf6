"""What an update of the KCF costs at the rate it was made for, next to VQF with the same samples.

Its slow step comes every 50 ms: at 286 Hz, the rate of the recordings in `BROAD_DIR`, with every fourteenth
sample, at 100 Hz with every fifth. Without a recording a motion like it is generated. The exit code is 1 when
a limit is missed.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.util
import os
import sys
import tempfile
from ctypes import byref, c_double, c_int32, c_int64, c_void_p
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.table import Table
from timing import Case, Ratio, measure

from ahrs_fmu import quaternion, records
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.records import Record
from bench import OUT, Array, aligned, compile_loops

TRIAL = "05_undisturbed_slow_rotation_with_breaks_B.mat"
RATE = 2000 / 7
"""Hz of the recordings of BROAD."""
ROWS = 20_000
SECONDS = 12.0
"""Time to measure one recording in."""
PASSES = 60
"""Over a recording, of which the least time of every update counts: interruptions are not the filter's."""

UPDATE_OF_VQF = 0.45
WORST_OF_MEDIAN = 8.0
"""Limit of the worst update with spreading, in units of the median one."""


@dataclass(frozen=True)
class Motion:
    """Samples of one recording."""

    name: str
    record: Record
    limited: bool

    @property
    def samples(self) -> Array:
        """Rows of gyroscope, accelerometer, magnetometer."""
        return np.ascontiguousarray(np.hstack((self.record.gyro, self.record.accel, self.record.mag)))


def slow_rotation_with_breaks() -> Record:
    """Ten seconds of rest, ten of rotation, and so on, at the rate of the recordings."""
    time = np.arange(ROWS) / RATE
    moves = np.where(time % 20.0 < 10.0, 0.0, np.sin(np.pi * (time % 10.0) / 10.0))
    waves = [np.sin(2 * np.pi * f * time + phase) for f, phase in ((0.2, 0.0), (0.31, 1.0), (0.43, 2.0))]
    rate = 1.2 * moves[:, None] * np.stack(waves, axis=-1)
    q = np.empty((ROWS, 4))
    q[0] = quaternion.IDENTITY
    for k, step in enumerate(quaternion.exp(rate[1:] / RATE), start=1):
        q[k] = quaternion.normalise(quaternion.multiply(q[k - 1], step))
    body = quaternion.conjugate(q)
    noise = np.random.default_rng(1).standard_normal((3, ROWS, 3))
    field = np.broadcast_to([20e-6, 0.0, 45e-6], (ROWS, 3))
    return Record(
        time=time,
        gyro=rate + np.radians(0.1) * noise[0],
        accel=quaternion.rotate(body, np.broadcast_to([0.0, 0.0, -9.8], (ROWS, 3))) + 0.05 * noise[1],
        mag=quaternion.rotate(body, field) + 0.4e-6 * noise[2],
    )


def motions() -> list[Motion]:
    """A recording of BROAD or one like it, and a flight at 100 Hz."""
    path = Path(os.environ.get("BROAD_DIR", "")) / TRIAL
    recorded = path.is_file()
    record = records.read(path).rows(0, ROWS) if recorded else slow_rotation_with_breaks()
    name = f"BROAD trial {TRIAL[:2]}" if recorded else "generated rotation with breaks"
    return [
        Motion(f"286 Hz, {name}", record, limited=True),
        Motion("100 Hz, generated flight", demo_flight(duration=(ROWS - 1) / 100.0), limited=False),
    ]


class Filter:
    """The KCF in C over a recording, from a fresh start."""

    def __init__(self, loops: ctypes.CDLL, motion: Motion, *, spread: bool) -> None:
        self._loops = loops
        self._model = byref(ctypes.c_char.in_dll(loops, "ahrs_kcf_model"))
        self._memory = aligned(loops.bench_size(self._model))
        self._instance = c_void_p(self._memory.ctypes.data)
        self._samples = motion.samples
        loops.bench_begin(self._model, self._instance, b"spread", c_int32(spread))
        self._arguments = (
            self._model,
            self._instance,
            c_int64(len(self._samples)),
            c_double(motion.record.sample_time),
            c_void_p(self._samples.ctypes.data),
        )

    def __call__(self) -> None:
        self._loops.bench_fresh(*self._arguments)

    def each(self) -> NDArray[np.int64]:
        """Nanoseconds of every update."""
        least = np.full(len(self._samples), np.iinfo(np.int64).max)
        for _ in range(PASSES):
            self._loops.bench_each(*self._arguments, c_void_p(least.ctypes.data))
        return least


def vqf(motion: Motion) -> Case | None:
    """VQF over the same recording, in the units it takes, if it is installed."""
    if importlib.util.find_spec("vqf") is None:
        return None
    make, record = importlib.import_module("vqf").VQF, motion.record
    arrays = [np.ascontiguousarray(x) for x in (record.gyro, record.accel, 1e6 * record.mag)]
    return Case("VQF", lambda: make(record.sample_time).updateBatch(*arrays), len(record))


def report(motion: Motion, loops: ctypes.CDLL) -> bool:
    """Measure one recording and show it; whether a limit was missed."""
    filters = {"at once": Filter(loops, motion, spread=False), "spread": Filter(loops, motion, spread=True)}
    cases = {name: Case(name, call, len(motion.record)) for name, call in filters.items()}
    peer = vqf(motion)
    measure([*cases.values(), *([peer] if peer else [])], SECONDS)
    known = cases | ({"VQF": peer} if peer else {})
    table = Table(box=SIMPLE_HEAD, pad_edge=False, title=motion.name, title_justify="left")
    table.add_column("slow step")
    for heading in ("mean", "/ VQF", "median", "99.9 %", "worst", "worst / median"):
        table.add_column(heading, justify="right", no_wrap=True)
    missed = False
    for name, case in cases.items():
        each = filters[name].each()
        middle, worst = float(np.median(each)), float(each.max())
        ratio = Ratio(name, "VQF", UPDATE_OF_VQF if motion.limited else None)
        value = ratio.value(known)
        too_long = name == "spread" and worst > WORST_OF_MEDIAN * middle
        missed |= too_long or ratio.is_missed(known)
        table.add_row(
            name,
            f"{case.ns:.0f}",
            "no peer" if value is None else f"{value:.2f}{' MISSED' if ratio.is_missed(known) else ''}",
            f"{middle:.0f}",
            f"{np.quantile(each, 0.999):.0f}",
            f"{worst:.0f}",
            f"{worst / middle:.1f}{' MISSED' if too_long else ''}",
        )
    if peer:
        table.add_row("VQF", f"{peer.ns:.0f}")
    OUT.print(table)
    return missed


def main() -> int:
    """Measure and show."""
    OUT.print(
        f"KCF: an update in C, double, ns. Limits: at 286 Hz at most {UPDATE_OF_VQF:g} of VQF's updateBatch, "
        f"spread at most {WORST_OF_MEDIAN:g} from median to worst. "
        f"Of every update the least of {PASSES} passes counts.\n",
    )
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        loops = compile_loops("double", Path(scratch))
        missed = [report(motion, loops) for motion in motions()]
    return int(any(missed))


if __name__ == "__main__":
    sys.exit(main())

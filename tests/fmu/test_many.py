"""Many instances: one after the other without a leak, and all at once without knowing of each other."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from host import Instance, Library, Replay
from numpy.typing import NDArray


def resident() -> int:
    """Bytes of this process in memory."""
    statm = Path("/proc/self/statm")
    if not statm.is_file():
        pytest.skip("reads /proc/self/statm")
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


def test_two_thousand_instances_leave_no_memory_behind(library: Library) -> None:
    def cycle() -> None:
        instance = library.instance().run(accel=[0.0, 0.1, -9.8])
        instance.step(0.0, 0.03)
        instance.free_state(instance.save())
        instance.free()

    for _ in range(200):
        cycle()
    before = resident()
    for _ in range(2000):
        cycle()
    assert resident() - before < 500_000


def test_fifty_instances_at_once_compute_what_each_computes_alone(
    library: Library, replay_of: Callable[[Instance], Replay], rows: NDArray[np.float64]
) -> None:
    k = np.arange(1000)

    def run(number: int) -> NDArray[np.float64]:
        sensors = {"gyro": rows[number, :3], "accel": rows[number, 3:6], "mag": rows[number, 6:]}
        instance = library.instance(f"number {number}").run(kp=0.2 + 0.05 * number, **sensors)
        q = replay_of(instance)(k * 0.01, 0.01, k + number, rows)
        instance.free()
        return q

    alone = [run(number) for number in range(50)]
    with ThreadPoolExecutor(max_workers=50) as pool:
        together = list(pool.map(run, range(50)))
    np.testing.assert_array_equal(together, alone)
    assert len({q[-1].tobytes() for q in alone}) == 50

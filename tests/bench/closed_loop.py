"""How much faster than real time four components fly a minute: quadrotor, IMU, GCF and controller at 250 Hz.

Every component through FMPy, set and got by System step by step. The exit code is 1 when a limit is missed.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import get_args

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.instances import Instances, Via

FLIGHT = Path(__file__).parents[1] / "closed_loop" / "scenarios" / "hover.cosim.toml"
SECONDS = 60.0
REPETITIONS = 3
"""Of which the fastest counts."""
LIMIT = 20.0
LIMITED: tuple[Via, ...] = ("fmu2", "fmu3")
RECORDED = ("quadrotor.q", "quadrotor.position", "estimator.q")

OUT = Console(highlight=False)


def real_time_factor(via: Via, instances: Instances) -> float:
    """Simulated seconds per second of the processor."""
    file = scenario.read(FLIGHT).computed_by(via)
    system = running.assemble(file.case({"duration": SECONDS}), instances, FLIGHT.parent)
    times = []
    for _ in range(REPETITIONS):
        system.reset()
        start = process_time()
        system.run(SECONDS, RECORDED)
        times.append(process_time() - start)
    return SECONDS / min(times)


def main() -> int:
    """Measure and show."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("closed loop, 60 s at 250 Hz")
    table.add_column("times real time", justify="right")
    missed = False
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder, Instances(Path(folder)) as instances:
        for via in get_args(Via):
            if via == "numpy":
                continue  # the plant has no numpy twin
            factor = real_time_factor(via, instances)
            bad = via in LIMITED and factor < LIMIT
            missed |= bad
            limit = f" (at least {LIMIT:g}){' MISSED' if bad else ''}" if via in LIMITED else ""
            table.add_row(f"four components, {via}", f"{factor:.0f}{limit}")
    OUT.print(table)
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())

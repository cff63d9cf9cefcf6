"""What a campaign costs: runs of the C core through Dask, with one worker and with two.

    python tests/bench/campaign.py [--runs N] [--seconds S]

Each run is the template `estimation` with the GCF, on a sensor with noise, and judged. The limit on the time
is that of the clock, for the whole campaign with the start of its workers and all that it writes.

The gain of a second worker is told twice. By the clock it is that of the rates after the first chunk, which
is worth little when the machine has other things to do. By processor time it is the gain on two processors
that have nothing else to do: with one worker a run takes what it costs the worker, with two the workers
share both processors with the command, which hands out, collects and stores. What starting costs is taken
off by a campaign of few runs. The exit code is 1 when a limit is missed.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from ahrs_fmu import campaign
from ahrs_fmu.campaign import Campaign, Progress
from ahrs_fmu.campaign.plan import parse

LIMIT = 0.06
"""s that a run of 60 s may take on two workers."""
GAIN = 1.7
"""How many times faster two workers have to be than one."""
ROUNDS = 3
"""Campaigns with one and with two workers in turn, of which the cheapest counts."""
FEW = 20
SCENARIO = """
seeds = {runs}

[scenario]
template = "estimation"
duration = {seconds}
sensor = "mpu9250"

[scenario.motion]
rotation.roll_deg.sines = [{{ amplitude = 20, frequency = 0.2 }}]

[[scenario.expect]]
signal = "attitude_error.total"
measure = "rms"
at_most = "180 deg"
"""


@dataclass(frozen=True)
class Cost:
    """What a campaign took: by the clock as a whole, its rate, processor time here and of the workers, s."""

    whole: float
    rate: float
    here: float
    workers: float


def planned(runs: int, seconds: float) -> Campaign:
    """A campaign of so many runs of so many seconds."""
    return parse(SCENARIO.format(runs=runs, seconds=seconds), Path("bench.campaign.toml"))


def processor_time(whose: int) -> float:
    """Processor time of this process, or of its children that have ended, s."""
    used = resource.getrusage(whose)
    return used.ru_utime + used.ru_stime


def measure(plan: Campaign, workers: int) -> Cost:
    """Run a campaign."""
    done: list[tuple[float, int]] = []

    def note(at: Progress) -> None:
        done.append((time.perf_counter(), at.done))

    whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        before = [processor_time(who) for who in whose]
        began = time.perf_counter()
        results = campaign.run(plan, folder, workers=workers, progress=note)
        whole = time.perf_counter() - began
        here, children = (processor_time(who) - start for who, start in zip(whose, before, strict=True))
    assert results.passed
    (first, few), (last, all_of_them) = done[1], done[-1]
    return Cost(whole, (all_of_them - few) / (last - first), here, children)


def main() -> int:
    """Print the time of the campaign and the gain of a second worker."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=60.0)
    options = parser.parse_args()
    few, many = planned(FEW, options.seconds), planned(options.runs, options.seconds)
    costs: dict[int, list[Cost]] = {1: [], 2: []}
    starts: dict[int, list[Cost]] = {1: [], 2: []}
    for _ in range(ROUNDS):
        for workers in (1, 2):
            starts[workers].append(measure(few, workers))
            costs[workers].append(measure(many, workers))
            cost = costs[workers][-1]
            print(
                f"campaign: {options.runs} runs of {options.seconds:g} s, workers {workers}: "
                f"{cost.whole:.1f} s, {cost.rate:.0f} runs a second once started; "
                f"processor time {cost.workers:.1f} s of the workers, {cost.here:.1f} s of the command",
                flush=True,
            )

    def per_run(workers: int, which: str) -> float:
        started, spent = (min(getattr(c, which) for c in found[workers]) for found in (starts, costs))
        return (spent - started) / (options.runs - FEW)

    one, two, here = per_run(1, "workers"), per_run(2, "workers"), per_run(2, "here")
    whole = min(cost.whole for cost in costs[2])
    clock = median(second.rate / first.rate for first, second in zip(costs[1], costs[2], strict=True))
    gain = one / (0.5 * (two + here))
    slow, poor = whole > LIMIT * options.runs, gain < GAIN
    print(
        f"campaign: {whole:.1f} s on two workers (at most {LIMIT * options.runs:g})"
        f"{' MISSED' if slow else ''}; a run costs a worker {1e3 * two:.1f} ms, "
        f"the command {1e3 * here:.2f} ms"
    )
    print(
        f"campaign: two workers are {gain:.2f} times as fast as one (at least {GAIN})"
        f"{' MISSED' if poor else ''}; by the clock {clock:.2f} times"
    )
    return int(slow or poor)


if __name__ == "__main__":
    sys.exit(main())

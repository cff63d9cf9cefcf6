"""``ahrs-fmu benchmark``."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from ahrs_fmu import benchmark as bench
from ahrs_fmu import benchmark_plots, plots
from ahrs_fmu.commands import terminal
from ahrs_fmu.commands.replay import RECORDINGS_VARIABLE

EXAMPLES = f"""
Examples:
  ahrs-fmu benchmark broad                          every estimator over ${RECORDINGS_VARIABLE}
  ahrs-fmu benchmark broad --data BROAD/data_mat --peers
  ahrs-fmu benchmark broad --estimators kcf,VQF --peers --stress

docs/accuracy.md tells what the numbers mean.
"""


class Suite(Enum):
    """Data sets that there is a benchmark of."""

    BROAD = "broad"


def benchmark(
    suite: Annotated[Suite, typer.Argument(help="Data set.")] = Suite.BROAD,  # noqa: ARG001
    data: Annotated[
        Path | None, typer.Option(help=f"Folder of the recordings; default: ${RECORDINGS_VARIABLE}.")
    ] = None,
    estimators: Annotated[
        list[str] | None,
        typer.Option(
            "--estimators",
            "--estimator",
            metavar="<names>",
            help="Filters, with commas between them; may be repeated; default: all of them.",
        ),
    ] = None,
    with_peers: Annotated[
        bool, typer.Option("--peers", help="Also filters of other packages (extra: peers).")
    ] = False,
    stress: Annotated[bool, typer.Option("--stress", help="Also under changes of the recordings.")] = False,
    workers: Annotated[int, typer.Option(min=1, help="Processes at a time.")] = max(1, os.cpu_count() or 1),
    curves: Annotated[bool, typer.Option(help="Draw the errors of every trial over time.")] = True,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for results and plots.")] = Path(
        "build"
    ),
) -> None:
    """Compare the accuracy of filters on a public data set.

    Interrupted, it goes on where it was; what has changed runs anew.
    """
    trials = bench.find_trials(data or _default_folder())
    names = _chosen(estimators, with_peers)
    stresses = list(bench.STRESSES) if stress else [bench.NOMINAL]
    jobs = [bench.Job(name, trial, kind) for kind in stresses for name in names for trial in trials]
    folder = output / "benchmark"
    with terminal.progress() as progress:
        task = progress.add_task("benchmark", total=sum(job.is_possible for job in jobs))
        outcomes = bench.run(jobs, folder / "results", workers=workers, done=lambda _: progress.advance(task))
    rows = bench.summary(outcomes)
    _print_summary(rows, len(trials))
    if stress:
        _print_stress(bench.stress_summary(outcomes))
    title = f"BROAD, mean of {len(trials)} trials"
    pictures = plots.save(benchmark_plots.bar_chart(rows, title), folder / "broad")
    if curves:
        for trial in trials:
            own = [o for o in outcomes if o.job.trial == trial and o.job.stress == bench.NOMINAL]
            pictures += plots.save(benchmark_plots.trial_figure(own), folder / "trials" / trial.name)
    terminal.OUT.print(f"plots: {len(pictures)} files in {folder}")


def _default_folder() -> Path:
    folder = os.environ.get(RECORDINGS_VARIABLE)
    if not folder:
        raise typer.BadParameter(
            f"where are the recordings? Give --data DIR or set {RECORDINGS_VARIABLE}", param_hint="--data"
        )
    return Path(folder)


def _chosen(estimators: Sequence[str] | None, with_peers: bool) -> list[str]:
    known = bench.estimator_names(with_peers)
    if not estimators:
        return known
    by_key = {_key(name): name for name in known}
    wanted = [name.strip() for names in estimators for name in names.split(",")]
    unknown = [name for name in wanted if _key(name) not in by_key]
    if unknown:
        peers = "" if with_peers else "; --peers adds those of other packages"
        raise typer.BadParameter(
            f"no filter {unknown[0]!r}; there are {', '.join(known)}{peers}", param_hint="--estimators"
        )
    return list(dict.fromkeys(by_key[_key(name)] for name in wanted))


def _key(name: str) -> str:
    return re.sub(r"[\W_]", "", name).lower()


def _print_summary(rows: Sequence[bench.Row], trials: int) -> None:
    groups = list(dict.fromkeys(group for row in rows for group in row.by_group))
    parts = terminal.table(["filter"], ["total", "heading", "inclination", "ns/sample"])
    by_group = terminal.table(["filter"], groups)
    for row in rows:
        errors = (row.total, row.heading, row.inclination)
        parts.add_row(row.estimator, *(f"{x:.3f}" for x in errors), f"{row.nanoseconds:.0f}")
        by_group.add_row(row.estimator, *(f"{row.by_group[group]:.3f}" for group in groups))
    terminal.OUT.print(f"RMS error in movement [deg], mean over {trials} trials")
    terminal.OUT.print(parts)
    terminal.OUT.print("total error by group of trials [deg]")
    terminal.OUT.print(by_group)


def _print_stress(rows: Sequence[bench.StressRow]) -> None:
    shown = terminal.table(["filter", "recordings"], ["total", "reported implausible"])
    for row in rows:
        reported = "-" if row.reported is None else f"{row.reported} of {row.trials}"
        shown.add_row(row.estimator, row.stress, f"{row.total:.3f}", reported)
    terminal.OUT.print("RMS total error in movement [deg] under changes of the recordings")
    terminal.OUT.print(shown)

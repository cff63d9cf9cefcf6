"""``ahrs-fmu reproduce``."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ahrs_fmu import experiments, plots, scenarios
from ahrs_fmu.commands import terminal
from ahrs_fmu.estimator import Backend
from ahrs_fmu.experiments import Outcome
from ahrs_fmu.host_library import Precision

EXAMPLES = """
Examples:
  ahrs-fmu reproduce                    every estimator on every published experiment
  ahrs-fmu reproduce GC --seeds 3       one source, quickly
  ahrs-fmu reproduce --precision single
"""

_DRAWN = ("complementary", "Mahony-EKF", "adaptive CKF, R only", "GCF, decoupled", "MEKF")
"""Settings in the figures."""
_HEADINGS = ("setting", "roll", "pitch", "yaw", "expected", "resets", "verdict")


def reproduce(
    source: Annotated[str, typer.Argument(metavar="ME|AC|CG|GC|all", help="Whose experiments.")] = "all",
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds to average over.")] = 10,
    backend: Annotated[Backend, typer.Option(help="Who computes.")] = "c",
    precision: Annotated[Precision, typer.Option(help="Floating-point type.")] = "double",
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for tables and plots.")] = Path(
        "build/reproduce"
    ),
) -> int:
    """Run the published experiments and compare the errors.

    Prints RMS errors of roll, pitch and yaw in degrees beside those of an independent computation. Returns 1
    if one of them differs without a reason.
    """
    names = experiments.scenario_names(source)
    chosen = list(experiments.settings())
    outcomes: list[Outcome] = []
    with terminal.progress() as progress:
        task = progress.add_task("experiments", total=len(names))
        for name in names:
            found = experiments.run(name, chosen, range(1, seeds + 1), backend, precision)
            _print(name, found)
            outcomes += found
            _draw(name, backend, precision, output)
            progress.advance(task)
    _write_csv(output / "reproduce.csv", outcomes)
    _write_markdown(output / "reproduce.md", outcomes)
    agreeing = sum(outcome.agrees for outcome in outcomes)
    compared = sum(outcome.expected is not None and outcome.settled for outcome in outcomes)
    terminal.OUT.print(f"{agreeing} agree; {compared} of {len(outcomes)} can be compared at all")
    terminal.OUT.print(f"tables and plots: {output}")
    return int(any(outcome.verdict == "differs" for outcome in outcomes))


def _cells(outcome: Outcome) -> list[str]:
    ours = [f"{value:.2f}" for value in np.degrees(outcome.mean)]
    expected = outcome.expected
    beside = "fails" if expected is None else " ".join(f"{value:.2f}" for value in np.degrees(expected))
    return [outcome.setting, *ours, beside, str(outcome.resets), outcome.verdict]


def _print(name: str, outcomes: Sequence[Outcome]) -> None:
    terminal.OUT.print(f"{name}: {scenarios.describe(name).description}")
    table = terminal.table(_HEADINGS[:1], _HEADINGS[1:])
    table.columns[0].no_wrap = True
    for outcome in outcomes:
        table.add_row(*_cells(outcome))
    terminal.OUT.print(table)


def _draw(name: str, backend: Backend, precision: Precision, output: Path) -> None:
    simulation = scenarios.simulate(name)
    estimates = {
        label: experiments.setting(label)
        .estimator(name, simulation, backend, precision)
        .run(simulation.record)
        .q
        for label in _DRAWN
    }
    figure = plots.comparison_figure(simulation.record, estimates, name)
    plots.save(figure, output / name.replace("/", "-"))


def _write_csv(path: Path, outcomes: Iterable[Outcome]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("scenario", *_HEADINGS))
        writer.writerows((outcome.scenario, *_cells(outcome)) for outcome in outcomes)


def _write_markdown(path: Path, outcomes: Sequence[Outcome]) -> None:
    lines = ["# The published experiments", "", "RMS errors in degrees, mean over the seeds.", ""]
    for name in dict.fromkeys(outcome.scenario for outcome in outcomes):
        lines += [f"## {name}", "", scenarios.describe(name).description + ".", ""]
        lines += [f"| {' | '.join(_HEADINGS)} |", "|---|" + "---:|" * 5 + "---|"]
        lines += [f"| {' | '.join(_cells(o))} |" for o in outcomes if o.scenario == name]
        lines.append("")
    path.write_text("\n".join(lines), encoding="utf-8")

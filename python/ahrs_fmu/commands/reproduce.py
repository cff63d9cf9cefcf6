"""``ahrs-fmu reproduce``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from ahrs_fmu import experiments, plots, published, scenarios, single_precision
from ahrs_fmu.commands import reproduction_files, terminal
from ahrs_fmu.commands.reproduction_files import angles
from ahrs_fmu.estimator import Backend
from ahrs_fmu.experiments import MEANING, Outcome
from ahrs_fmu.host_library import Precision
from ahrs_fmu.published import Comparison
from ahrs_fmu.single_precision import Trial

EXAMPLES = """
Examples:
  ahrs-fmu reproduce                      every estimator on every published experiment
  ahrs-fmu reproduce GC --seeds 3         one source, quickly
  ahrs-fmu reproduce --precision single
  ahrs-fmu reproduce CG --backend numpy --seeds 1

docs/reproduction.md explains what the sources print and what is right.
"""

_DRAWN = {
    "me": ("complementary", "improved EKF", "Mahony-EKF"),
    "ac": ("gyro only", "CKF", "adaptive CKF, R only"),
    "cg": ("CG-EKF", "CG-EKF, low-pass", "GCF"),
    "gc": ("GCF", "GCF, c = 1", "MEKF", "MEKF, c = 1"),
}
"""Settings in the figures: what each source compares."""


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

    Prints RMS errors of roll, pitch and yaw in degrees beside those of an independent computation, then the
    figures that the source prints. Returns 1 if a computed error differs without a reason.
    """
    names = experiments.of_source(source, scenarios.names())
    compared = experiments.scenario_names()
    numbers = range(1, seeds + 1)
    outcomes: list[Outcome] = []
    comparisons: list[Comparison] = []
    with terminal.progress() as progress:
        chosen = {name: list(experiments.settings()) if name in compared else [] for name in names}
        task = progress.add_task("experiments", total=sum(map(len, chosen.values())))
        for name in names:
            progress.update(task, description=name)
            found = experiments.run(
                name, chosen[name], numbers, backend, precision, lambda: progress.advance(task)
            )
            beside = published.compare(name, numbers, backend, precision)
            _draw(name, backend, precision, output)
            _print(name, found, beside)
            outcomes += found
            comparisons += beside
    trials = single_precision.trials() if single_precision.SCENARIO in names else []
    _print_trials(trials)
    _print_meanings(outcomes)
    files = reproduction_files.write(output, outcomes, comparisons, trials)
    terminal.OUT.print(_summary(outcomes, comparisons))
    terminal.OUT.print(f"tables: {', '.join(map(str, files))}")
    terminal.OUT.print(f"plots: {output}")
    surprising = any(outcome.verdict == "differs" for outcome in outcomes)
    return int(surprising or not all(trial.as_expected for trial in trials))


def _print(name: str, outcomes: Sequence[Outcome], comparisons: Sequence[Comparison]) -> None:
    terminal.OUT.print(f"{name}: {scenarios.describe(name).description}")
    if outcomes:
        table = terminal.table(["RMS error [deg]"], ["roll, pitch, yaw", "expected"])
        table.columns[0].no_wrap = True
        table.add_column("", no_wrap=True)
        for o in outcomes:
            expected = "fails" if o.expected is None else angles(o.expected)
            table.add_row(o.setting, angles(o.mean), expected, o.verdict)
        terminal.OUT.print(table)
    if comparisons:
        table = terminal.table(["the source prints [deg]", "of"], ["printed", "here"])
        table.add_column("", no_wrap=True)
        for c in comparisons:
            of = reproduction_files.quantity(c.figure)
            table.add_row(
                c.figure.setting, of, reproduction_files.printed(c.figure), angles(c.here), c.verdict
            )
        terminal.OUT.print(table)
        for c in comparisons:
            if c.figure.note:
                of = reproduction_files.quantity(c.figure)
                terminal.prose(f"{c.figure.setting}, {of}: {c.figure.note}", indent=1, hanging=2)
        terminal.OUT.print()


def _print_trials(trials: Sequence[Trial]) -> None:
    if not trials:
        return
    terminal.OUT.print(f"{single_precision.SCENARIO}: unscented filters in single precision")
    table = terminal.table(["form", "alpha", "kappa", "other"], ["fails at", "RMS [deg]", "in double"])
    for trial in trials:
        cells = reproduction_files.trial_cells(trial)
        table.add_row(*cells[:-1], style=None if trial.as_expected else "red")
    terminal.OUT.print(table)


def _print_meanings(outcomes: Iterable[Outcome]) -> None:
    seen = {outcome.verdict for outcome in outcomes}
    for verdict, meaning in MEANING.items():
        if verdict in seen:
            terminal.OUT.print(f"{verdict}: {meaning}")


def _summary(outcomes: Sequence[Outcome], comparisons: Sequence[Comparison]) -> str:
    counts = {verdict: sum(o.verdict == verdict for o in outcomes) for verdict in MEANING}
    computed = ", ".join(f"{verdict} {count}" for verdict, count in counts.items() if count)
    if not comparisons:
        return f"computed: {computed}"
    kept = sum(c.agrees for c in comparisons)
    return f"computed: {computed}; printed: {kept} of {len(comparisons)} met"


def _draw(name: str, backend: Backend, precision: Precision, output: Path) -> None:
    simulation = scenarios.simulate(name)
    estimates = {
        label: experiments.setting(label)
        .estimator(name, simulation, backend, precision)
        .run(simulation.record)
        .q
        for label in _DRAWN[name.partition("/")[0]]
    }
    title = f"{name}: {simulation.scenario.description}"
    figure = plots.comparison_figure(simulation.record, estimates, title)
    plots.save(figure, output / name.replace("/", "-"))

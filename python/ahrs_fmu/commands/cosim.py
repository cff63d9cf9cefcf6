"""``ahrs-fmu cosim``."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ahrs_fmu.commands import terminal
from ahrs_fmu.commands.numbers import write_json
from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.expectations import Verdict
from ahrs_fmu.cosim.instances import Instances, Via
from ahrs_fmu.cosim.plots import draw
from ahrs_fmu.cosim.running import Outcome
from ahrs_fmu.cosim.scenario import Case, ScenarioFile, changes_in_words
from ahrs_fmu.cosim.ssp import write_ssp

EXAMPLES = """
Examples:
  ahrs-fmu cosim gust.cosim.toml --plot          run, judge, draw
  ahrs-fmu cosim gust.cosim.toml --via fmu3      every model as an FMI 3 FMU
  ahrs-fmu cosim gust.cosim.toml --ssp gust.ssp  also as one file for other tools
  ahrs-fmu cosim gust.cosim.toml --seed 7 --set components.estimator.model=kcf

docs/cosim.md describes the files; pytest runs them too.
"""

_MOST_CLAUSES = 9
"""That stay legible in one table."""


def cosim(
    files: Annotated[list[Path], typer.Argument(metavar="FILE", help="Scenario files, NAME.cosim.toml.")],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="A field by its dotted name; may be repeated."),
    ] = None,
    seeds: Annotated[
        list[int] | None, typer.Option("--seed", min=0, help="Instead of those of the file; may be repeated.")
    ] = None,
    via: Annotated[Via | None, typer.Option(help="Who computes the models of this package.")] = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw each run as PNG and SVG.")] = False,
    show: Annotated[bool, typer.Option("--open", help="Draw, and open the pictures.")] = False,
    record: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the signals of the last run: .csv or .parquet.")
    ] = None,
    ssp: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the system of the last case as an SSP package.")
    ] = None,
    json: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the verdicts as JSON.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for FMUs and plots.")] = Path(
        "build"
    ),
) -> int:
    """Run scenarios of several components and judge them.

    Returns 1 when an expectation does not hold or a run stops.
    """
    changes = _changes(settings or [])
    opened = [scenario.read(file) for file in files]
    if via is not None:
        opened = [file.computed_by(via) for file in opened]
    runs = [(file, case) for file in opened for case in file.cases(changes, seeds or None)]
    results: list[tuple[str, Outcome]] = []
    told: ScenarioFile | None = None
    flow: tuple[Sequence[str], Sequence[str]] = ((), ())
    with Instances(output) as instances:
        for file, case in runs:
            outcome = _run(file, case, instances)
            if file is not told and outcome.case.scenario.description:
                terminal.prose(f"{file.name}: {outcome.case.scenario.description}", hanging=2)
            if (outcome.order, outcome.delayed) != flow:
                _print_flow(outcome)
            told, flow = file, (outcome.order, outcome.delayed)
            _print(file, outcome, in_full=len(runs) == 1 or not outcome.passed)
            if plot or show:
                _draw(file, outcome, output, show)
            results.append((file.name, outcome))
        if record is not None:
            _write(results[-1][1], record)
        if ssp is not None:
            _package(*runs[-1], instances, ssp)
    if len(runs) > 1:
        print_overview(results)
    write_json({"runs": [summary(name, outcome) for name, outcome in results]}, json)
    return int(not all(outcome.passed for _, outcome in results))


def summary(name: str, outcome: Outcome) -> dict[str, object]:
    """Verdicts of a run as plain data."""
    rows = [
        {"clause": v.clause, "measured": v.measured, "unit": v.unit, "limit": v.limit, "passed": v.passed}
        for v in outcome.verdicts
    ]
    return {
        "scenario": name,
        "case": outcome.case.label,
        "passed": outcome.passed,
        "failure": outcome.failure,
        "verdicts": rows,
    }


def _changes(settings: list[str]) -> dict[str, object]:
    """Read FIELD=VALUE with values as TOML writes them; what is no TOML is a text."""
    found: dict[str, object] = {}
    for name, value in terminal.assignments(settings, "--set").items():
        try:
            found[name] = tomllib.loads(f"value = {value}")["value"] if isinstance(value, str) else value
        except tomllib.TOMLDecodeError:
            found[name] = value
    return found


def _run(file: ScenarioFile, case: Case, instances: Instances) -> Outcome:
    with terminal.progress() as progress:
        task = progress.add_task(f"{file.name} {case.label}", total=case.scenario.rows)
        return running.run(case, instances, file.path.parent, lambda done: progress.advance(task, done))


def _print(file: ScenarioFile, outcome: Outcome, in_full: bool) -> None:
    recording = outcome.recording
    seconds = f"{recording.time[-1]:.0f} s" if len(recording) else "0 s"
    terminal.OUT.print(
        f"{file.name} {outcome.case.label}: {seconds}, {recording.real_time_factor:.0f} times real time"
    )
    if outcome.failure:
        terminal.OUT.print(f"  stopped: {outcome.failure}")
    elif in_full:
        print_verdicts(outcome)


def _print_flow(outcome: Outcome) -> None:
    terminal.prose(f"order: {', '.join(outcome.order)}", hanging=7)
    for connection in outcome.delayed:
        terminal.OUT.print(f"one step late: {connection}")


def print_verdicts(outcome: Outcome) -> None:
    """Print what was expected, what was measured, and whether it holds."""
    table = terminal.table(["expectation"], ["measured", "limit", "at [s]"])
    table.add_column("verdict")
    for verdict in outcome.verdicts:
        at = "" if verdict.at is None else f"{verdict.at:.2f}"
        table.add_row(
            verdict.clause, verdict.value, verdict.limit, at, "holds" if verdict.passed else "FAILS"
        )
    terminal.OUT.print(table)


def print_overview(results: Sequence[tuple[str, Outcome]]) -> None:
    """Print what came out of several runs: one table if their clauses fit into it, else one per scenario."""
    if len(_clauses(results)) <= _MOST_CLAUSES:
        _print_table(results)
    else:
        for name in dict.fromkeys(name for name, _ in results):
            terminal.OUT.print(f"\n{name}")
            _print_table([result for result in results if result[0] == name])
    if not all(verdict.passed for _, outcome in results for verdict in outcome.verdicts):
        terminal.OUT.print("!: does not hold")
    passed = sum(outcome.passed for _, outcome in results)
    terminal.OUT.print(f"{passed} of {len(results)} runs hold")


def _clauses(results: Sequence[tuple[str, Outcome]]) -> dict[str, Verdict]:
    return {verdict.clause: verdict for _, outcome in results for verdict in outcome.verdicts}


def _print_table(results: Sequence[tuple[str, Outcome]]) -> None:
    """Print one row per run, by the name of its scenario, and one numbered column per clause."""
    labels = [(name, *_words(outcome.case)) for name, outcome in results]
    # What all runs have in common does not tell them apart.
    common = set(labels[0]).intersection(*labels) if len(labels) > 1 else {labels[0][0]}
    clauses = _clauses(results)
    table = terminal.table(["run"], [str(number) for number, _ in enumerate(clauses, 1)])
    table.add_column("verdict")
    for label, (_, outcome) in zip(labels, results, strict=True):
        found = {verdict.clause: verdict for verdict in outcome.verdicts}
        cells = [_cell(found[clause]) if clause in found else "" for clause in clauses]
        verdict = "stopped" if outcome.failure else "holds" if outcome.passed else "FAILS"
        table.add_row(" ".join(word for word in label if word not in common), *cells, verdict)
    terminal.OUT.print(table)
    for number, clause in enumerate(clauses, 1):
        limits = dict.fromkeys(v.limit for _, o in results for v in o.verdicts if v.clause == clause)
        terminal.OUT.print(f"{number}: {clause}, {' or '.join(limits)}")


def _words(case: Case) -> list[str]:
    """What makes a case, in short: a name speaks for itself, a number needs the name of what it is."""
    words = changes_in_words(case.changes)
    values = [word.partition("=")[2] for word in words]
    named = [value if value[:1].islower() else word for word, value in zip(words, values, strict=True)]
    return [*named, f"seed={case.seed}"]


def _cell(verdict: Verdict) -> str:
    """The measured value, whose unit the limit tells."""
    number, _, unit = verdict.value.partition(" ")
    return f"{number if unit in verdict.limit else verdict.value}{'' if verdict.passed else ' !'}"


def _draw(file: ScenarioFile, outcome: Outcome, output: Path, show: bool) -> None:
    pictures = draw(outcome, file.name, output / "cosim")
    for picture in pictures:
        terminal.OUT.print(f"plot: {picture}")
    if show and pictures:
        typer.launch(str(pictures[0]))


def _package(file: ScenarioFile, case: Case, instances: Instances, path: Path) -> None:
    system = running.assemble(case, instances, file.path.parent)
    write_ssp(system, path, stop_time=case.scenario.duration)
    terminal.OUT.print(f"written: {path}")


def _write(outcome: Outcome, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".csv":
        outcome.recording.write_csv(path)
    elif path.suffix == ".parquet":
        outcome.recording.write_parquet(path)
    else:
        raise typer.BadParameter(f"{path}: give a file that ends in .csv or .parquet", param_hint="--record")
    terminal.OUT.print(f"written: {path}")

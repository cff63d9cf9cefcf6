"""``ahrs-fmu replay``."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Annotated, Literal

import numpy as np
import typer

from ahrs_fmu import plots, records, scenarios
from ahrs_fmu.commands import terminal
from ahrs_fmu.errors import RecordError
from ahrs_fmu.estimate import EstimateResult, Status
from ahrs_fmu.metrics import RmsError
from ahrs_fmu.records import Record
from ahrs_fmu.replay import Replay, Via, error_of

EXAMPLES = """
Examples:
  ahrs-fmu replay flight.csv --plot                 errors, and a picture of them
  ahrs-fmu replay flight.csv --set kp=1 --set ki=0  other gains
  ahrs-fmu replay recordings/ --via fmu3            a folder, through the FMU
  ahrs-fmu replay gc/lin --estimator mekf --plot    a published experiment
  ahrs-fmu replay log.csv --unit accel=g --unit gyro=deg/s --frame enu

docs/records.md describes the formats.
"""

RECORDINGS_VARIABLE = "BROAD_DIR"
"""Environment variable that names a folder with recordings."""


def replay(
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RECORD",
            help="Recordings, folders of them, or published experiments such as gc/lin; "
            f"default: ${RECORDINGS_VARIABLE}.",
        ),
    ] = None,
    estimator: Annotated[str, typer.Option(help="Model that estimates.")] = "gcf",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter of the estimator; may be repeated."),
    ] = None,
    via: Annotated[Via, typer.Option(help="The C core, or an FMU stepped as importers do.")] = "c",
    plot: Annotated[bool, typer.Option("--plot", help="Draw angles and errors as PNG and SVG.")] = False,
    seed: Annotated[int, typer.Option(min=1, help="Noise of a published experiment.")] = 1,
    frame: Annotated[
        Literal["ned", "enu"] | None, typer.Option(help="Frame of the recordings, when they do not tell.")
    ] = None,
    units: Annotated[
        list[str] | None,
        typer.Option(
            "--unit", metavar="SIGNAL=UNIT", help="Unit of time, gyro, accel or mag; may be repeated."
        ),
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for FMUs and plots.")] = Path(
        "build"
    ),
) -> None:
    """Run an estimator over recordings.

    Prints RMS errors where a recording has the true attitude, else the last attitude.
    """
    declared = {name: str(unit) for name, unit in terminal.assignments(units or [], "--unit").items()}
    paths = found(recordings or _default_recordings())
    runner = Replay(estimator, terminal.assignments(settings or [], "--set"), via, output)
    outcomes = []
    warned: set[str] = set()
    for path in paths:
        if is_experiment(path):
            record = scenarios.load(path.as_posix(), seed)
        else:
            record = records.read(path, frame=frame, units=declared)
        for limit in runner.warnings(record):
            if limit.says not in warned:
                terminal.warn(limit.says)
                warned.add(limit.says)
        outcomes.append(run_one(runner, record, output if plot else None))
    terminal.OUT.print(f"{runner.label}")
    print_outcomes(outcomes)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one replay gave."""

    record: Record
    result: EstimateResult
    rms: RmsError | None
    plots: list[Path]


def run_one(runner: Replay, record: Record, output: Path | None) -> Outcome:
    """Replay one recording with a progress bar, and draw it when there is a folder to draw into."""
    with terminal.progress() as progress:
        task = progress.add_task(f"{record.name}, {runner.label}", total=len(record))
        result = runner.run(record, lambda done: progress.advance(task, done))
    error = error_of(result, record)
    pictures = []
    if output is not None:
        figure = plots.replay_figure(record.in_frame(result.frame), result.q, runner.label)
        name = f"{record.name}_{runner.descriptor.name}_{runner.via}"
        pictures = plots.save(figure, output / "replay" / re.sub(r"[^\w.-]+", "_", name))
    return Outcome(record, result, None if error is None else error.rms(record.evaluate), pictures)


def print_outcomes(outcomes: Sequence[Outcome]) -> None:
    """Print a table of errors, a table of what has no truth, and where the plots are."""
    with_truth = [(o.record, o.rms) for o in outcomes if o.rms is not None]
    if with_truth:
        _print_errors(with_truth)
    without_truth = [o for o in outcomes if o.rms is None]
    if without_truth:
        _print_attitudes(without_truth)
    for outcome in outcomes:
        for picture in outcome.plots:
            terminal.OUT.print(f"plot: {picture}")


def is_experiment(path: Path) -> bool:
    """Whether a path is meant for a published experiment rather than for a file."""
    sources = {name.partition("/")[0] for name in scenarios.names()}
    return path.parent.as_posix() in sources and not path.suffix and not path.exists()


def found(paths: Sequence[Path]) -> list[Path]:
    """Recordings among files and folders.

    Raises
    ------
    RecordError
        A folder holds none.
    """
    files: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() in records.EXTENSIONS)
            if not inside:
                raise RecordError(f"{path}: no recordings in it ({', '.join(records.EXTENSIONS)})")
            files += inside
        else:
            files.append(path)
    return files


def _default_recordings() -> list[Path]:
    folder = os.environ.get(RECORDINGS_VARIABLE)
    if not folder:
        raise typer.BadParameter(
            f"name a recording, or set {RECORDINGS_VARIABLE} to a folder of them", param_hint="RECORD"
        )
    return [Path(folder)]


def _print_errors(rows: Sequence[tuple[Record, RmsError]]) -> None:
    names = ("total", "heading", "inclination")
    shown = terminal.table(["RMS error [deg]"], names)
    for record, rms in rows:
        degrees = rms.degrees()
        shown.add_row(record.name, *(f"{degrees[name]:.2f}" for name in names))
    if len(rows) > 1:
        means = (fmean(rms.degrees()[name] for _, rms in rows) for name in names)
        shown.add_section()
        shown.add_row("mean", *(f"{mean:.2f}" for mean in means))
    terminal.OUT.print(shown)


def _print_attitudes(outcomes: Sequence[Outcome]) -> None:
    shown = terminal.table(["last attitude [deg]"], ["roll", "pitch", "yaw", "status nominal"])
    for outcome in outcomes:
        angles = np.degrees(outcome.result.euler[-1])
        nominal = float(np.mean(outcome.result.status == Status.NOMINAL))
        shown.add_row(outcome.record.name, *(f"{a:.2f}" for a in angles), f"{nominal:.0%}")
    terminal.OUT.print(shown)

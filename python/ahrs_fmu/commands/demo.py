"""``ahrs-fmu demo``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, get_args

import numpy as np
import typer

from ahrs_fmu import records
from ahrs_fmu.commands import terminal
from ahrs_fmu.commands.replay import RECORDINGS_VARIABLE, Outcome, found, run_one
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.errors import FmuError
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.validate import validate_fmu
from ahrs_fmu.export.variant import Fmi
from ahrs_fmu.records import Record
from ahrs_fmu.replay import Replay, Via

EXAMPLES = f"""
Examples:
  ahrs-fmu demo                       the first recording in {RECORDINGS_VARIABLE},
                                      else a generated flight
  ahrs-fmu demo --record flight.csv   your own
"""

_MODEL = "gcf"


def demo(
    record: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Recording to replay instead of the default one.")
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for FMUs and plots.")] = Path(
        "build"
    ),
) -> None:
    """Build, replay a flight, compare and plot.

    One flight goes through the C core and through each FMU, which must give the same bits.
    """
    out = terminal.OUT
    flight, source = _flight(record)
    with terminal.progress() as progress:
        task = progress.add_task("building FMUs", total=len(get_args(Fmi)))
        for fmi in get_args(Fmi):
            path = build_fmu(_MODEL, fmi=fmi, output=output)
            problems = validate_fmu(path)
            if problems:
                raise FmuError(f"{path}: {'; '.join(problems)}")
            out.print(f"built {path}, {path.stat().st_size / 1000.0:.0f} kB, no problem found")
            progress.advance(task)
    out.print(f"flight: {source}; {len(flight)} samples in {flight.duration:.0f} s")
    outcomes = [
        run_one(Replay(_MODEL, {}, via, output), flight, output if via == "c" else None)
        for via in get_args(Via)
    ]
    _print_comparison(outcomes)
    for picture in outcomes[0].plots:
        out.print(f"plot: {picture}")
    out.print("next: open the plot, drop an FMU into your simulator, or see ahrs-fmu --help")


def _flight(path: Path | None) -> tuple[Record, str]:
    folder = os.environ.get(RECORDINGS_VARIABLE)
    if path is None and folder and Path(folder).is_dir():
        path = found([Path(folder)])[0]
    if path is None:
        return demo_flight(), f"generated ({RECORDINGS_VARIABLE} names no folder)"
    return records.read(path), f"recording {path.name}"


def _print_comparison(outcomes: list[Outcome]) -> None:
    core = outcomes[0].result.q
    shown = terminal.table(["RMS error of GCF via"], ["total", "heading", "inclination", "bits as C core"])
    for via, outcome in zip(get_args(Via), outcomes, strict=True):
        errors = outcome.rms.degrees() if outcome.rms is not None else {}
        cells = (f"{errors[name]:.2f}°" if errors else "" for name in ("total", "heading", "inclination"))
        same = "same" if np.array_equal(outcome.result.q, core) else "other"
        shown.add_row(via, *cells, same)
    terminal.OUT.print(shown)

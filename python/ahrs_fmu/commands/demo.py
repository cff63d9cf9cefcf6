"""``ahrs-fmu demo``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ahrs_fmu import plots
from ahrs_fmu.analysis.measure import FrequencyResponse, plan, stepped_sine
from ahrs_fmu.analysis.plots import bode_figure
from ahrs_fmu.analysis.theory import ComplementaryFilter, Gains, filter_of
from ahrs_fmu.commands import terminal
from ahrs_fmu.commands.cosim import print_verdicts
from ahrs_fmu.cosim import opening, running, scenario
from ahrs_fmu.cosim.instances import Instances, Via
from ahrs_fmu.cosim.plots import run_figure
from ahrs_fmu.cosim.running import Outcome
from ahrs_fmu.cosim.scenario import ScenarioFile
from ahrs_fmu.errors import FmuError
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.validate import validate_fmu

EXAMPLES = """
Examples:
  ahrs-fmu demo                 FMUs, tables and pictures in build/
  ahrs-fmu demo -o elsewhere
"""

_SCENARIO = "demo.cosim.toml"
_WAYS: Mapping[Via, str] = {
    "fmu3": "FMI 3 FMUs",
    "fmu2": "FMI 2 FMUs",
    "c": "C code",
}
_BODE_SAMPLE_TIME = 0.02
_BODE_FREQUENCIES = np.geomspace(0.03, 10.0, 9)
_BODE_AMPLITUDE = math.radians(5.0)
_ROLL = 0


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for FMUs and plots.")] = Path(
        "build"
    ),
) -> int:
    """Fly a quadrotor on FMUs, measure a Bode plot.

    Builds the FMUs, flies on the estimated attitude, draws, and measures the FMU that flew. The loop is
    quadrotor, IMU, GCF and attitude controller. It runs through FMPy and in C, which must give the same bits.
    Returns 1 when the flight does not meet its expectations.
    """
    out = terminal.OUT
    text = resources.files("ahrs_fmu.cosim").joinpath(_SCENARIO).read_text(encoding="utf-8")
    file = scenario.parse(text, Path(_SCENARIO))
    _build(file, output)
    out.print(f"flight: {file.table['description'][0].lower()}{file.table['description'][1:]}")
    with Instances(output) as instances:
        outcomes = {via: _fly(file, via, instances) for via in _WAYS}
    _print_comparison(outcomes)
    first = outcomes["fmu3"]
    print_verdicts(first)
    title = "Quadrotor on the attitude of GCF.fmu"
    for picture in plots.save(run_figure(first, title), output / "demo" / "flight"):
        out.print(f"plot: {picture}")
    for picture in _bode(file, output):
        out.print(f"plot: {picture}")
    out.print("next: open the plots, drop build/fmi3/GCF.fmu into your simulator, or see ahrs-fmu --help")
    return int(not all(outcome.passed for outcome in outcomes.values()))


def _build(file: ScenarioFile, output: Path) -> None:
    models = [component["model"] for component in file.table["components"].values()]
    with terminal.progress() as progress:
        task = progress.add_task("building FMUs", total=2 * len(models))
        for fmi in ("2", "3"):
            for model in models:
                path = build_fmu(model, fmi=fmi, output=output)
                problems = validate_fmu(path)
                if problems:
                    raise FmuError(f"{path}: {'; '.join(problems)}")
                size = path.stat().st_size / 1000.0
                terminal.OUT.print(f"built {path}, {size:.0f} kB, no problem found")
                progress.advance(task)


def _fly(file: ScenarioFile, via: Via, instances: Instances) -> Outcome:
    case = file.computed_by(via).case()
    with terminal.progress() as progress:
        task = progress.add_task(_WAYS[via], total=case.scenario.rows)
        return running.run(case, instances, Path(), lambda done: progress.advance(task, done))


def _print_comparison(outcomes: Mapping[Via, Outcome]) -> None:
    shown = terminal.table(
        ["60 s of flight in"], ["estimate", "tracking", "times real time", "bits as C code"]
    )
    expected = outcomes["c"].recording
    for via, outcome in outcomes.items():
        recording = outcome.recording
        if outcome.failure:
            raise FmuError(outcome.failure)
        rms = [
            f"{math.degrees(float(np.sqrt(np.mean(recording[name] ** 2)))):.2f}°"
            for name in ("attitude_error.total", "tracking_error.total")
        ]
        same = all(np.array_equal(recording[name], expected[name]) for name in expected.signals)
        shown.add_row(_WAYS[via], *rms, f"{recording.real_time_factor:.0f}", "same" if same else "other")
    terminal.OUT.print(shown)


def _bode(file: ScenarioFile, output: Path) -> list[Path]:
    """Step the FMU of the flight, at a rate of its own, through a few frequencies."""
    parameters = file.table["components"]["estimator"]["parameters"]
    gains = {"kp": float(parameters["kp"]), "ki": float(parameters["ki"])}
    theory = filter_of(Gains(**gains), _BODE_SAMPLE_TIME)
    path = output / "fmi3" / "GCF.fmu"
    measured = _measured(path, gains, theory)
    title = f"GCF.fmu, roll, kp {gains['kp']:g} rad/s, ki {gains['ki']:g} rad²/s²"
    return plots.save(bode_figure(theory, measured, title), output / "demo" / "bode")


def _measured(path: Path, gains: Mapping[str, float], theory: ComplementaryFilter) -> list[FrequencyResponse]:
    T = _BODE_SAMPLE_TIME
    plans = [plan(way, _BODE_FREQUENCIES, theory, _BODE_AMPLITUDE) for way in ("angle", "rate")]
    with opening.fmu(path, {**gains, "sample_time": T}) as stepper, terminal.progress() as progress:
        task = progress.add_task("measuring the Bode plot", total=2 * len(_BODE_FREQUENCIES))
        return [
            stepped_sine(stepper, p, T, _ROLL, progress=lambda done: progress.advance(task, done))
            for p in plans
        ]

"""``ahrs-fmu bode``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from ahrs_fmu import descriptors, plots
from ahrs_fmu.analysis.equivalent import Equivalent, equivalent
from ahrs_fmu.analysis.measure import (
    AXES,
    Deviation,
    Excited,
    FrequencyResponse,
    deviation,
    harmonics,
    multisine,
    plan,
    shared_stepped_sine,
    stepped_sine,
)
from ahrs_fmu.analysis.plots import bode_figure
from ahrs_fmu.analysis.quantity import as_json, rows
from ahrs_fmu.analysis.systems import Array, ComplexArray
from ahrs_fmu.analysis.theory import (
    Characteristics,
    ComplementaryFilter,
    Gains,
    LowPass,
    Responding,
    characterise,
    describe,
    filter_of,
)
from ahrs_fmu.commands import numbers, terminal
from ahrs_fmu.cosim import opening
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.stepper import Stepper
from ahrs_fmu.errors import DesignError

EXAMPLES = """
Examples:
  ahrs-fmu bode --kp 0.5 --ki 0.1                         theory of these gains
  ahrs-fmu bode --fmu build/fmi3/GCF.fmu --measure --save measured on the FMU, as a picture
  ahrs-fmu bode --estimator mahony --measure --axis yaw   any estimator, with its equivalent filter

docs/frequency.md explains the pictures.
"""

_PATHS: tuple[Excited, Excited] = ("angle", "rate")
_GAINS = frozenset(("kp", "ki", "kii", "kg", "kh", "error"))
_WANTED = frozenset(("sample_time", "motion_compensation", "motion_time_constant")) | _GAINS
_DECOUPLED = 0.0
"""Item of the enumeration `error`."""
_APART = 1.0
"""Difference in dB between G_B and 1 - G_A that is worth a word."""
_WITH_THEORY = "GCF"
"""The estimator whose gains are those of the theory, step by step."""


@dataclass(frozen=True, slots=True)
class Device:
    """An estimator that can be opened, here or in another process."""

    title: str
    open: Callable[[], AbstractContextManager[Stepper]]
    sample_time: float
    gains: Gains | None
    """Gains on the axis of interest, if the estimator is a filter with gains."""
    motion_time_constant: float | None


def bode(
    kp: Annotated[float | None, typer.Option(help="Proportional gain [rad/s].")] = None,
    ki: Annotated[float | None, typer.Option(help="Integral gain [rad2/s2].")] = None,
    kii: Annotated[float | None, typer.Option(help="Double integral gain [rad3/s3].")] = None,
    estimator: Annotated[str, typer.Option(help="Model whose C core is taken.")] = "gcf",
    fmu: Annotated[Path | None, typer.Option(metavar="FILE", help="An FMU instead of the C core.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter of the estimator; may be repeated."),
    ] = None,
    measure: Annotated[bool, typer.Option("--measure", help="Measure the response by stepping.")] = False,
    axis: Annotated[Literal["roll", "pitch", "yaw"], typer.Option(help="Axis to look at.")] = "roll",
    method: Annotated[
        Literal["stepped", "multisine"], typer.Option(help="One sine after the other, or harmonics at once.")
    ] = "stepped",
    points: Annotated[int, typer.Option(min=2, max=500, help="Number of frequencies.")] = 30,
    low: Annotated[float, typer.Option(help="Lowest frequency [rad/s].")] = 0.02,
    high: Annotated[float, typer.Option(help="Highest frequency [rad/s].")] = 20.0,
    amplitude: Annotated[float, typer.Option(help="Amplitude of the angle [deg].")] = 5.0,
    workers: Annotated[int, typer.Option(min=1, help="Processes that share the frequencies.")] = 1,
    save: Annotated[bool, typer.Option("--save", help="Draw the response as PNG and SVG.")] = False,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the pictures.")] = Path("build"),
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the numbers.")
    ] = None,
) -> None:
    """Show the frequency response of a filter.

    Theory, and what is measured by stepping the C core or an FMU.
    """
    given = terminal.assignments(settings or [], "--set")
    given |= {name: v for name, v in (("kp", kp), ("ki", ki), ("kii", kii)) if v is not None}
    number = AXES.index(axis)
    device = _device(estimator, fmu, given, number)
    spread = harmonics if measure and method == "multisine" else np.geomspace
    omega = spread(*_band(low, high, device.sample_time), points)
    expected = _theory_of(device)
    if expected is None and not measure:
        raise DesignError(f"{device.title} has no gains to draw the theory of on {axis}: add --measure")
    responses: list[FrequencyResponse] = []
    if measure:
        radians = math.radians(amplitude)
        responses = _measured(device, expected, omega, number, radians, method, workers)
    heading = f"{device.title}, {axis}, {1.0 / device.sample_time:.4g} Hz"
    terminal.OUT.print(heading)
    theory = expected or _print_nearest(equivalent(responses[0], device.sample_time))
    if not responses:
        _print_theory(omega, theory)
    for response in responses:
        _print_measured(theory, response)
    if expected is None and np.max(np.abs(_deviation(theory, responses[1]).magnitude_db)) > _APART:
        terminal.warn(
            "G_B is not 1 - G_A: the estimator has a use of its own for the gyro, such as taking a slow rate "
            "at rest for its bias"
        )
    characteristics = characterise(theory.filter if isinstance(theory, Equivalent) else theory)
    numbers.print_rows(rows(characteristics), "filter")
    if save:
        name = f"{device.title.lower().replace(' ', '_')}_{axis}"
        for picture in plots.save(bode_figure(theory, responses, heading), output / "bode" / name):
            terminal.OUT.print(f"plot: {picture}")
    numbers.write_json(_as_json(device, axis, omega, theory, responses, characteristics), json_file)


def _band(low: float, high: float, sample_time: float) -> tuple[float, float]:
    if not 0.0 < low < high:
        raise DesignError(f"frequencies from {low:g} to {high:g} rad/s: give positive ones, the lower first")
    if high * sample_time >= math.pi:
        half = math.pi / sample_time
        raise DesignError(f"frequency = {high:g} rad/s: stay below half the sample rate, {half:g} rad/s")
    return low, high


def _theory_of(device: Device) -> ComplementaryFilter | None:
    if device.gains is None:
        return None
    return filter_of(device.gains, device.sample_time, device.motion_time_constant).require_stable()


def _print_nearest(nearest: Equivalent) -> Equivalent:
    lag = "" if nearest.lag is None else f", with a low-pass of {nearest.lag:.3g} rad/s behind it"
    low_pass = "low-pass" if isinstance(nearest.law, LowPass) else "complementary filter"
    terminal.OUT.print(
        f"nearest {low_pass}: {describe(nearest.law)}, crossover {nearest.crossover:.3g} rad/s{lag}; "
        f"it is the theory below"
    )
    return nearest


def _device(estimator: str, fmu: Path | None, given: Mapping[str, object], axis: int) -> Device:
    opened: Callable[[], AbstractContextManager[Stepper]]
    if fmu is None:
        descriptor = descriptors.load(estimator)
        title = descriptor.title
        opened = partial(opening.core, estimator, given)
        core = CoreStepper(descriptor, given)
        values = {name: float(core.get(name)) for name in _WANTED & {v.name for v in descriptor.parameters}}
    else:
        settings = {name: _fmu_value(value) for name, value in given.items()}
        opened = partial(opening.fmu, fmu, settings)
        with opening.fmu(fmu, settings) as stepper:
            title = stepper.fmu.description.modelName
            values = {name: float(stepper.get(name)) for name in _WANTED & stepper.fmu.variables.keys()}
    if "sample_time" not in values:
        raise DesignError(
            f"{title} has no parameter sample_time: measure it with ahrs_fmu.analysis.measure, "
            f"where you give the step"
        )
    return Device(
        title=title,
        open=opened,
        sample_time=values["sample_time"],
        gains=_gains(values, axis) if title == _WITH_THEORY else None,
        motion_time_constant=_motion_time_constant(values, axis),
    )


def _fmu_value(value: object) -> float | str | bool:
    """Turn the text of an option into a number where it is one."""
    try:
        return value if isinstance(value, bool) else float(str(value))
    except ValueError:
        return str(value)


def _gains(values: Mapping[str, float], axis: int) -> Gains | None:
    """Return the gains that act on an axis, if they make one filter of it.

    Of the coupled error only pitch is one, and only without motion compensation, which acts on the
    accelerometer's share of it.
    """
    gains = Gains(values["kp"], values["ki"], values["kii"])
    if values["error"] == _DECOUPLED:
        return gains
    alone = AXES[axis] == "pitch" and not values["motion_compensation"]
    return gains.scaled(values["kg"] + values["kh"]) if alone else None


def _motion_time_constant(values: Mapping[str, float], axis: int) -> float | None:
    """Return the time constant of the motion compensation, which leaves the heading alone."""
    acts = values.get("motion_compensation", 0.0) > 0.0 and AXES[axis] != "yaw"
    return values["motion_time_constant"] if acts else None


def _measured(
    device: Device,
    expected: ComplementaryFilter | None,
    omega: Array,
    axis: int,
    amplitude: float,
    method: str,
    workers: int,
) -> list[FrequencyResponse]:
    schedules = [plan(path, omega, expected, amplitude) for path in _PATHS]
    with terminal.progress() as progress:
        task = progress.add_task(f"{device.title}, {AXES[axis]}", total=len(_PATHS) * omega.size)

        def done(count: int) -> None:
            progress.advance(task, count)

        if method == "stepped" and workers > 1:
            return shared_stepped_sine(
                device.open, schedules, device.sample_time, axis, progress=done, workers=workers
            )
        with device.open() as stepper:
            if method == "stepped":
                return [stepped_sine(stepper, p, device.sample_time, axis, progress=done) for p in schedules]
            return [multisine(stepper, p, device.sample_time, axis) for p in schedules]


def _print_theory(omega: Array, theory: Responding) -> None:
    shown = terminal.table([], ["rad/s", "G_A [dB]", "[deg]", "G_B [dB]", "[deg]"])
    for w, g_a, g_b in zip(omega, *theory.respond(omega), strict=True):
        cells = (cell for gain in (g_a, g_b) for cell in _polar(gain))
        shown.add_row(f"{w:.4g}", *cells)
    terminal.OUT.print(shown)


def _print_measured(theory: Responding, response: FrequencyResponse) -> None:
    name = "G_A" if response.path == "angle" else "G_B"
    found = _deviation(theory, response)
    shown = terminal.table([], ["rad/s", f"{name} [dB]", "[deg]", "- theory [dB]", "[deg]", "error bar [dB]"])
    lines = zip(
        response.omega, response.main, found.magnitude_db, found.phase, response.error_db, strict=True
    )
    for w, gain, decibels, phase, bar in lines:
        cells = (f"{decibels:+.4f}", f"{math.degrees(phase):+.4f}", f"{bar:.1g}")
        shown.add_row(f"{w:.4g}", *_polar(gain), *cells)
    terminal.OUT.print(shown)
    terminal.OUT.print(
        f"{name} measured in {response.steps} steps: at most {np.max(np.abs(found.magnitude_db)):.2g} dB "
        f"and {math.degrees(np.max(np.abs(found.phase))):.2g} deg from theory, "
        f"coherence at least {np.min(response.coherence):.6f}"
    )


def _polar(gain: complex) -> tuple[str, str]:
    return f"{20.0 * math.log10(max(abs(gain), 1e-12)):.3f}", f"{math.degrees(np.angle(gain)):.3f}"


def _deviation(theory: Responding, response: FrequencyResponse) -> Deviation:
    return deviation(response.main, theory.respond(response.omega)[_PATHS.index(response.path)])


def _as_json(
    device: Device,
    axis: str,
    omega: Array,
    theory: Responding,
    responses: Sequence[FrequencyResponse],
    characteristics: Characteristics,
) -> dict[str, object]:
    def plain(gain: ComplexArray) -> dict[str, list[float]]:
        return {"real": gain.real.tolist(), "imaginary": gain.imag.tolist()}

    g_a, g_b = theory.respond(omega)
    return {
        "device": device.title,
        "axis": axis,
        "sample_time": device.sample_time,
        "gains": None if device.gains is None else asdict(device.gains),
        "frequency": {"unit": "rad/s", "value": omega.tolist()},
        "theory": {"angle": plain(g_a), "rate": plain(g_b)},
        "measured": {
            r.path: {
                **plain(r.main),
                "standard_error": r.standard_error[:, r.axis].tolist(),
                "coherence": r.coherence.tolist(),
            }
            for r in responses
        },
        "characteristics": as_json(characteristics),
    }

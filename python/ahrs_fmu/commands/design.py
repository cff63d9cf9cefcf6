"""``ahrs-fmu design``, ``allan`` and ``explain``."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ahrs_fmu import descriptors, plots, records, sensors
from ahrs_fmu.analysis.coupling import ErrorKind
from ahrs_fmu.analysis.design import (
    Motion,
    SensorNoise,
    error_against_crossover,
    gains_for,
    gains_under_motion,
    motion_band,
    optimal_gains,
    predict_attitude_rms,
    predict_rms,
    sensitivity,
)
from ahrs_fmu.analysis.equivalent import Equivalent, small_signal
from ahrs_fmu.analysis.explain import Explanation
from ahrs_fmu.analysis.explain import explain as explain_law
from ahrs_fmu.analysis.plots import allan_figure, bode_figure, error_figure
from ahrs_fmu.analysis.quantity import as_json, rows
from ahrs_fmu.analysis.sensor_noise import DIP, FIELD, RecordedNoise, noise_of_imu, noise_of_record
from ahrs_fmu.analysis.theory import Gains, characterise, describe, filter_of
from ahrs_fmu.commands import numbers, terminal
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.descriptors import Descriptor
from ahrs_fmu.errors import DesignError

DESIGN_EXAMPLES = """
Examples:
  ahrs-fmu design --crossover 0.5 --damping 0.8        gains with this crossover and damping
  ahrs-fmu design --sensor mpu9250                     the best gains for a sensor
  ahrs-fmu design --noise gyro=0.007,walk=1e-3,accel=2e-3,mag=0.05
  ahrs-fmu design --sensor mpu9250 --motion 0.5,0.1,2  a vehicle that accelerates

Densities: gyro in deg/s/rtHz, walk in deg/s2/rtHz, accel in m/s2/rtHz, mag in uT/rtHz.
"""
ALLAN_EXAMPLES = """
Examples:
  ahrs-fmu allan rest.csv --save         noise of the sensors and the gains for it, as a picture too

The longest rest in the recording is used. An hour shows the bias walk of a common sensor.
"""
EXPLAIN_EXAMPLES = """
Examples:
  ahrs-fmu explain gcf
  ahrs-fmu explain gcf --set kp=1 --set ki=0.2 --sensor adis16405
  ahrs-fmu explain mekf                  the filter that a Kalman filter amounts to
"""

_RATE = 100.0
_CURVE_POINTS = 60
_NEAR = 0.1
"""How far the crossover of the sampled filter may be from the wanted one without a word."""
_ERRORS: dict[str, ErrorKind] = {"gcf": "decoupled", "mahony": "decoupled", "complementary": "attitude"}
"""How the filters whose parameters are the gains of the theory form their error, by default."""
_JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the numbers.")]
_Save = Annotated[bool, typer.Option("--save", help="Draw a picture as PNG and SVG.")]
_Output = Annotated[Path, typer.Option("--output", "-o", help="Folder for the pictures.")]


def design(
    crossover: Annotated[float | None, typer.Option(help="Wanted crossover [rad/s].")] = None,
    damping: Annotated[float, typer.Option(help="Wanted damping.")] = 0.8,
    order: Annotated[int, typer.Option(min=1, max=3, help="Order of the filter.")] = 2,
    sensor: Annotated[str | None, typer.Option(help="Name of a sensor.")] = None,
    noise: Annotated[str | None, typer.Option(metavar="NAME=VALUE,...", help="Noise densities.")] = None,
    motion: Annotated[
        str | None,
        typer.Option(metavar="RMS,LOW,HIGH", help="Motion acceleration [m/s2] in a band [Hz]."),
    ] = None,
    rate: Annotated[float, typer.Option(help="Sample rate [Hz].")] = _RATE,
    save: _Save = False,
    output: _Output = Path("build"),
    json_file: _JsonFile = None,
) -> None:
    """Find gains for a crossover or for a sensor.

    From a crossover and a damping, or from the noise of the sensors.
    """
    sample_time = 1.0 / numbers.positive("rate", rate, "Hz")
    noisy = _sensor(sensor, noise, sample_time)
    shaken = _motion(motion)
    if crossover is not None:
        gains = gains_for(crossover, damping, order)
    elif noisy is None:
        raise typer.BadParameter("give --crossover, --sensor or --noise")
    elif shaken is not None:
        gains = gains_under_motion(noisy.tilt, shaken, sample_time)
    else:
        gains = optimal_gains(noisy.tilt)
    filter_ = filter_of(gains, sample_time).require_stable()
    terminal.OUT.print(f"gains: {describe(gains)}")
    found = characterise(filter_)
    numbers.print_rows(rows(found), "filter")
    if crossover is not None and not math.isclose(found.crossover, crossover, rel_tol=_NEAR):
        where = "nowhere" if math.isnan(found.crossover) else f"at {found.crossover:.3g} rad/s"
        terminal.warn(
            f"{crossover:g} rad/s is fast for {rate:g} Hz: the sampled filter crosses over {where}; "
            f"raise --rate or design slower"
        )
    data: dict[str, object] = {
        "gains": asdict(gains),
        "sample_time": sample_time,
        "characteristics": as_json(found),
    }
    if noisy is None and save:
        picture = bode_figure(filter_, title=f"{describe(gains)}; {rate:g} Hz")
        _print_pictures(plots.save(picture, output / "design" / "bode"))
    if noisy is not None:
        data |= _print_prediction(gains, noisy, sample_time, shaken)
        if save:
            curve = error_against_crossover(
                noisy.tilt,
                found.crossover * np.geomspace(0.05, 20.0, _CURVE_POINTS),
                found.damping if gains.order > 1 else 1.0,
                gains.order,
                motion=shaken,
            )
            _print_pictures(
                plots.save(error_figure(curve, chosen=found.crossover), output / "design" / "error")
            )
    numbers.write_json(data, json_file)


def allan(
    recording: Annotated[Path, typer.Argument(metavar="RECORD", help="A recording at rest.")],
    save: _Save = False,
    output: _Output = Path("build"),
    json_file: _JsonFile = None,
) -> None:
    """Find the noise of sensors in a recording at rest.

    Fits the Allan deviation and gives the gains that are best for that noise.
    """
    found = noise_of_record(records.read(recording))
    terminal.OUT.print(f"{recording}: {found.duration:.0f} s at rest")
    _print_fits(found)
    if not found.walk_resolved:
        terminal.warn(
            "the rest is too short for the bias walk: taken is the largest that it does not exclude"
        )
    numbers.print_rows(rows(found.noise), "mean of the axes")
    tilt, heading = optimal_gains(found.noise.tilt), optimal_gains(found.noise.heading)
    terminal.OUT.print(f"best gains for roll and pitch at rest: {describe(tilt)}")
    terminal.OUT.print(f"best gains for the heading at rest: {describe(heading)}")
    if save:
        _print_pictures(plots.save(allan_figure(found.allan, found.fits), output / "allan" / recording.stem))
    numbers.write_json(_allan_json(found), json_file)


def explain(
    estimator: Annotated[str, typer.Argument(help="An estimator.")] = "gcf",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter of the estimator; may be repeated."),
    ] = None,
    sensor: Annotated[str, typer.Option(help="Sensor that the errors are predicted for.")] = "mpu9250",
    json_file: _JsonFile = None,
) -> None:
    """Say in plain words what an estimator does.

    By its gains, or those of the filter that it amounts to.
    """
    descriptor = descriptors.load(estimator)
    given = terminal.assignments(settings or [], "--set")
    core = CoreStepper(descriptor, given)
    noisy = _sensor(sensor, None, core.sample_time)
    if estimator in _ERRORS:
        told = _explain_gains(descriptor, core, noisy)
        source = ""
    else:
        near = _measured(descriptor, core)
        told = explain_law(near.law, core.sample_time, noisy, kind=None, lag=near.lag)
        source = f" on pitch amounts within {max(near.mismatch_db, 1e-3):.1g} dB to {near.form}"
    terminal.OUT.print(
        f"{descriptor.title}{source}: {describe(told.law)}; {1.0 / core.sample_time:.4g} Hz, {sensor}"
    )
    shown = terminal.table(["", "", "what it means"])
    for finding in told.findings:
        shown.add_row(finding.topic, finding.value, finding.meaning)
    terminal.OUT.print(shown, soft_wrap=False)
    data: dict[str, object] = {
        "estimator": estimator,
        "law": asdict(told.law),
        "characteristics": as_json(told.characteristics),
        "findings": [asdict(f) for f in told.findings],
    }
    if told.budget is not None:
        data["rms"] = as_json(told.budget)
    numbers.write_json(data, json_file)


def _explain_gains(descriptor: Descriptor, core: CoreStepper, noisy: SensorNoise | None) -> Explanation:
    """Explain a filter whose parameters are the gains of the theory."""
    known = {p.name for p in descriptor.parameters}

    def number(name: str) -> float:
        return float(core.get(name)) if name in known else 0.0

    gains, kind = Gains(number("kp"), number("ki"), number("kii")), _ERRORS[descriptor.name]
    if number("form") > 0.0:
        kind = "attitude"
    elif number("error") > 0.0:
        kind = "coupled"
        gains = gains.scaled(number("kg") + number("kh"))
        terminal.warn("the coupled error acts on pitch with kg + kh, as shown, on the other axes with less")
    compensates = number("motion_compensation") > 0.0
    time_constant = number("motion_time_constant") if compensates else None
    return explain_law(gains, core.sample_time, noisy, kind, time_constant)


def _measured(descriptor: Descriptor, core: CoreStepper) -> Equivalent:
    try:
        return small_signal(core, core.sample_time)
    except DesignError as error:
        raise DesignError(f"{descriptor.title}: {error}") from None


def _sensor(name: str | None, densities: str | None, sample_time: float) -> SensorNoise | None:
    if name is not None and densities is not None:
        raise typer.BadParameter("give --sensor or --noise, not both")
    if name is not None:
        return noise_of_imu(sensors.load(name), sample_time)
    if densities is None:
        return None
    known = {
        "gyro": (math.radians(1.0), "deg/s/rtHz"),
        "walk": (math.radians(1.0), "deg/s2/rtHz"),
        "accel": (1.0, "m/s2/rtHz"),
        "mag": (1e-6, "uT/rtHz"),
    }
    given = terminal.assignments(densities.split(","), "--noise")
    if unknown := sorted(set(given) - set(known)):
        raise typer.BadParameter(f"{unknown[0]!r} is none of {', '.join(known)}", param_hint="--noise")
    values = {
        name: factor * numbers.not_negative(name, numbers.number(name, given.get(name, 0.0)), unit)
        for name, (factor, unit) in known.items()
    }
    if not values["accel"]:
        raise typer.BadParameter("accel=... is needed: the tilt is measured with it", param_hint="--noise")
    return SensorNoise(values["gyro"], values["walk"], values["accel"], values["mag"], FIELD, DIP)


def _motion(text: str | None) -> Motion | None:
    if text is None:
        return None
    parts = text.split(",")
    if len(parts) != 3:
        raise typer.BadParameter(f"{text!r} is not of the form RMS,LOW,HIGH", param_hint="--motion")
    rms, low, high = (numbers.number("motion", p) for p in parts)
    return motion_band(rms, low, high)


def _print_prediction(
    gains: Gains, noisy: SensorNoise, sample_time: float, shaken: Motion | None
) -> dict[str, object]:
    numbers.print_rows(rows(noisy), "sensor")
    budget = predict_rms(gains, noisy.tilt, sample_time, shaken)
    attitude = predict_attitude_rms(gains, noisy, sample_time) if noisy.mag else None
    reaction = sensitivity(gains, noisy.tilt, sample_time)
    numbers.print_rows(rows(budget), "predicted RMS of tilt")
    if attitude is not None:
        numbers.print_rows(rows(attitude), "predicted RMS at rest")
    numbers.print_rows(rows(reaction), "sensitivity of tilt at rest")
    return {
        "sensor": as_json(noisy),
        "tilt": as_json(budget),
        "attitude": None if attitude is None else as_json(attitude),
        "sensitivity": as_json(reaction),
    }


def _print_fits(found: RecordedNoise) -> None:
    shown = terminal.table(["gyro axis"], ["N [deg/s/rtHz]", "B [deg/s]", "K [deg/s2/rtHz]"])
    for name, fit in found.fits.items():
        estimates = (fit.white, fit.instability, fit.walk)
        cells = (f"{math.degrees(e.value):.3g} ± {math.degrees(e.reach):.1g}" for e in estimates)
        shown.add_row(name, *cells)
    terminal.OUT.print(shown)
    terminal.OUT.print("±: 95 % confidence")


def _allan_json(found: RecordedNoise) -> dict[str, object]:
    return {
        "duration": found.duration,
        "walk_resolved": found.walk_resolved,
        "noise": as_json(found.noise),
        "gyro": {
            name: {
                "tau": found.allan[name].tau.tolist(),
                "deviation": found.allan[name].deviation.tolist(),
                "white": asdict(fit.white),
                "instability": asdict(fit.instability),
                "walk": asdict(fit.walk),
            }
            for name, fit in found.fits.items()
        },
        "tilt_gains": asdict(optimal_gains(found.noise.tilt)),
        "heading_gains": asdict(optimal_gains(found.noise.heading)),
    }


def _print_pictures(files: list[Path]) -> None:
    for file in files:
        terminal.OUT.print(f"plot: {file}")

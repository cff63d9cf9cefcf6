"""What the gains of a filter mean, in words a pilot would use."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ahrs_fmu.analysis.coupling import ErrorKind
from ahrs_fmu.analysis.design import (
    AttitudeBudget,
    SensorNoise,
    optimal_gains,
    predict_attitude_rms,
    predict_rms,
)
from ahrs_fmu.analysis.theory import (
    STANDARD_GRAVITY,
    Characteristics,
    Gains,
    characterise,
    filter_of,
    tilt_error,
)


@dataclass(frozen=True, slots=True)
class Finding:
    """One consequence of the gains."""

    topic: str
    """What it is about."""
    value: str
    """The number, with its unit, as people read it."""
    meaning: str
    """The consequence in plain words."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Everything `explain` finds out."""

    gains: Gains
    """The gains that act, loop gain included."""
    characteristics: Characteristics
    budget: AttitudeBudget | None
    """Predicted RMS errors, where the sensor is known."""
    findings: tuple[Finding, ...]


def explain(
    gains: Gains,
    sample_time: float,
    sensor: SensorNoise | None = None,
    kind: ErrorKind = "decoupled",
    motion_time_constant: float | None = None,
) -> Explanation:
    """Say what gains do.

    Parameters
    ----------
    gains : Gains
    sample_time : float
        Seconds.
    sensor : SensorNoise, optional
        The sensors whose noise the filter sees.
    kind : {"decoupled", "coupled", "attitude"}, optional
        How the filter forms its error, for the predicted error of all axes.
    motion_time_constant : float, optional
        That of the motion-acceleration compensation, s.

    Raises
    ------
    DesignError
        The filter is unstable.
    """
    filter_ = filter_of(gains, sample_time, motion_time_constant).require_stable()
    found = characterise(filter_)
    gravity = STANDARD_GRAVITY if sensor is None else sensor.gravity
    slow, fast = (math.degrees(float(tilt_error(filter_, w, gravity))) for w in (0.1, 2.0 * math.pi))
    findings = [
        Finding(
            "crossover",
            f"{found.crossover:.3g} rad/s",
            f"motion with a period below {2.0 * math.pi / found.crossover:.3g} s is taken from the gyro, "
            f"slower motion from accelerometer and magnetometer",
        ),
        _damping(found),
        Finding(
            "settling",
            f"{found.settling_time:.3g} s",
            f"until an attitude error of 10 deg has shrunk to 0.2 deg for good; it fades with "
            f"{found.slowest_time_constant:.3g} s in the end",
        ),
        *_bias(found),
        Finding(
            "tilt per 1 m/s2",
            f"{slow:.2g} deg",
            f"when the vehicle accelerates slowly (0.1 rad/s); {fast:.2g} deg at 1 Hz; "
            f"a steady acceleration tilts by {math.degrees(1.0 / gravity):.2g} deg",
        ),
        _stability(found),
    ]
    budget = None
    if sensor is not None:
        budget = predict_attitude_rms(gains, sensor, sample_time, kind, motion_time_constant)
        findings += _noise(gains, sensor, sample_time, budget)
    return Explanation(gains, found, budget, tuple(findings))


def _damping(found: Characteristics) -> Finding:
    if found.order == 1:
        return Finding(
            "damping", "first order", "errors fade without overshoot; the gyro bias is not learned"
        )
    if found.damping < 0.5:
        meaning = "low: errors overshoot and ring; raise kp or lower ki"
    elif found.damping <= 1.2:
        meaning = "good: 0.7 to 1 learns the bias quickly without ringing"
    else:
        meaning = "high: the bias is learned slowly; raise ki if it drifts"
    return Finding(
        "damping", f"{found.damping:.3g}", f"{meaning}; noise at the worst frequency is {found.peak:.3g} fold"
    )


def _bias(found: Characteristics) -> list[Finding]:
    if found.bias_error > 0.0:
        error = 0.1 * found.bias_error
        meaning = (
            f"a gyro bias of 0.1 deg/s turns the estimate by {error:.2g} deg for good; ki > 0 would learn it"
        )
        return [Finding("gyro bias", f"{found.bias_error:.3g} deg per deg/s", meaning)]
    if found.ramp_error > 0.0:
        error = found.ramp_error / 60.0
        meaning = (
            f"a constant bias leaves no error; one that drifts by 1 deg/s in a minute leaves {error:.2g} deg"
        )
        return [Finding("gyro bias", "learned", meaning)]
    return [
        Finding(
            "gyro bias",
            "learned, drift too",
            "neither a constant nor a steadily drifting bias leaves an error",
        )
    ]


def _stability(found: Characteristics) -> Finding:
    least = (
        f", and not below 1/{1.0 / found.gain_reduction_margin:.3g}"
        if found.gain_reduction_margin > 0.0
        else ""
    )
    return Finding(
        "stability",
        f"gain margin {found.gain_margin:.3g}",
        f"all gains may rise {found.gain_margin:.3g} fold{least} before the sampled filter is unstable; "
        f"phase margin {math.degrees(found.phase_margin):.0f} deg",
    )


def _noise(gains: Gains, sensor: SensorNoise, sample_time: float, budget: AttitudeBudget) -> list[Finding]:
    if not math.isfinite(budget.roll):
        meaning = "grows without limit: the gyro bias wanders and ki = 0 does not follow it"
        return [Finding("predicted error", "unbounded", meaning)]
    tilt, heading = (math.degrees(v) for v in (budget.roll, budget.heading))
    share = predict_rms(gains, sensor.tilt, sample_time)
    parts = {
        "gyro noise": share.gyro**2,
        "bias walk": share.bias_walk**2,
        "accelerometer noise": share.angle**2,
    }
    largest = max(parts, key=lambda name: parts[name])
    best = optimal_gains(sensor.tilt)
    least = math.degrees(predict_rms(best, sensor.tilt).total)
    return [
        Finding(
            "predicted error",
            f"{tilt:.2g} deg tilt",
            f"RMS at rest, {heading:.2g} deg heading; {100.0 * parts[largest] / share.total**2:.0f} % "
            f"of the tilt variance is {largest}",
        ),
        Finding(
            "best gains at rest",
            f"kp {best.kp:.3g}, ki {best.ki:.3g}",
            f"{least:.2g} deg of tilt; less if the vehicle accelerates, which noise alone does not show",
        ),
    ]

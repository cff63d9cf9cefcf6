"""What a filter does, in words a pilot would use."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ahrs_fmu.analysis.coupling import ErrorKind
from ahrs_fmu.analysis.design import (
    AttitudeBudget,
    SensorNoise,
    optimal_gains,
    predict_attitude_rms,
    predict_rms,
)
from ahrs_fmu.analysis.in_loop import InLoop, thrust_borne
from ahrs_fmu.analysis.theory import (
    STANDARD_GRAVITY,
    Characteristics,
    ComplementaryFilter,
    Gains,
    Law,
    LowPass,
    characterise,
    filter_of,
    tilt_error,
)

_DRAG = 0.26
"""Horizontal drag of the quadrotor in hover, 1/s (docs/vehicle.md)."""
_ATTITUDE_LOOP = 6.0
"""Crossover of its attitude loop, rad/s."""


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

    law: Law
    """The gains that act, loop gain included, or the low-pass."""
    characteristics: Characteristics
    budget: AttitudeBudget | None
    """Predicted RMS errors of all axes, where sensor and kind of error are known."""
    findings: tuple[Finding, ...]


def explain(
    law: Law,
    sample_time: float,
    sensor: SensorNoise | None = None,
    kind: ErrorKind | None = "decoupled",
    motion_time_constant: float | None = None,
    lag: float | None = None,
) -> Explanation:
    """Say what a law does.

    Parameters
    ----------
    law : Gains or LowPass
        That of a filter, or of the nearest one of another estimator.
    sample_time : float
        Seconds.
    sensor : SensorNoise, optional
        The sensors whose noise the filter sees.
    kind : {"decoupled", "coupled", "attitude"}, optional
        How the filter forms its error, for the predicted error of all axes; None predicts tilt alone.
    motion_time_constant : float, optional
        That of the motion-acceleration compensation, s.
    lag : float, optional
        Corner of a low-pass behind the filter, rad/s.

    Raises
    ------
    DesignError
        The filter is unstable.
    """
    filter_ = filter_of(law, sample_time, motion_time_constant).require_stable()
    found = characterise(filter_)
    gravity = STANDARD_GRAVITY if sensor is None else sensor.gravity
    slow, fast = (
        math.degrees(float(tilt_error(filter_, w, gravity))) / _lagging(w, lag) for w in (0.1, 2.0 * math.pi)
    )
    findings = [
        Finding(
            "crossover",
            f"{found.crossover:.3g} rad/s",
            f"motion with a period below {2.0 * math.pi / found.crossover:.3g} s is taken from the gyro, "
            f"slower motion from accelerometer and magnetometer",
        ),
        _damping(law, found),
        Finding(
            "settling",
            f"{found.settling_time:.3g} s",
            f"until an attitude error of 10 deg has shrunk to 0.2 deg for good; it fades with "
            f"{found.slowest_time_constant:.3g} s in the end",
        ),
        *_bias(law, found),
        Finding(
            "tilt per 1 m/s2",
            f"{slow:.2g} deg",
            f"when the vehicle accelerates slowly (0.1 rad/s); {fast:.2g} deg at 1 Hz; "
            f"a steady acceleration tilts by {math.degrees(1.0 / gravity):.2g} deg",
        ),
        _in_flight(filter_),
        _stability(found),
    ]
    if lag is not None:
        findings.append(
            Finding("low-pass behind", f"{lag:.3g} rad/s", "faster noise and acceleration fade once more")
        )
    budget = None
    if sensor is not None:
        if kind is not None and isinstance(law, Gains):
            budget = predict_attitude_rms(law, sensor, sample_time, kind, motion_time_constant)
        findings += _noise(law, sensor, sample_time, budget)
    return Explanation(law, found, budget, tuple(findings))


def _lagging(omega: float, lag: float | None) -> float:
    return 1.0 if lag is None else math.hypot(1.0, omega / lag)


def _damping(law: Law, found: Characteristics) -> Finding:
    if law.order == 1:
        return Finding(
            "damping", "first order", "errors fade without overshoot; the gyro bias is not learned"
        )
    if isinstance(law, LowPass):
        low, good, high = "errors ring", "errors fade without ringing", "errors fade slowly in the end"
    else:
        low = "errors overshoot and ring; more kp or less ki would calm it"
        good = "0.7 to 1 learns the bias quickly without ringing"
        high = "the bias is learned slowly; more ki if it drifts"
    if found.damping < 0.5:
        meaning = f"low: {low}"
    elif found.damping <= 1.2:
        meaning = f"good: {good}"
    else:
        meaning = f"high: {high}"
    return Finding(
        "damping", f"{found.damping:.3g}", f"{meaning}; noise at the worst frequency is {found.peak:.3g} fold"
    )


def _bias(law: Law, found: Characteristics) -> list[Finding]:
    if found.bias_error > 0.0:
        error = 0.1 * found.bias_error
        ending = (
            "as long as it is not learned, which this low-pass does not do"
            if isinstance(law, LowPass)
            else "for good; an integral gain would learn it"
        )
        meaning = f"a gyro bias of 0.1 deg/s turns the estimate by {error:.2g} deg {ending}"
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


def _in_flight(filter_: ComplementaryFilter) -> Finding:
    """Say what a multirotor sees of its own tilt (docs/frequency.md section 7)."""
    loop = InLoop(filter_, seen=thrust_borne(_DRAG), held=False)
    fastest = math.inf if filter_.sample_time is None else 0.9 * math.pi / filter_.sample_time
    omega = np.geomspace(0.01, min(100.0, fastest), 500)
    gain = np.abs(loop.respond(omega))
    worst = int(np.argmin(gain))
    at = min(_ATTITUDE_LOOP, fastest)
    phase = math.degrees(loop.cost(at).phase)
    return Finding(
        "on a multirotor",
        f"{100.0 * gain[worst]:.0f}% of a tilt",
        f"is seen where it swings with {omega[worst]:.2g} rad/s, as thrust hides tilt from the accelerometer "
        f"(drag {_DRAG:g} 1/s); at {at:.3g} rad/s the estimate leads by {phase:.2g} deg",
    )


def _stability(found: Characteristics) -> Finding:
    least = (
        f", and not below 1/{1.0 / found.gain_reduction_margin:.3g}"
        if found.gain_reduction_margin > 0.0
        else ""
    )
    phase = f"phase margin {math.degrees(found.phase_margin):.0f} deg"
    if math.isinf(found.gain_margin):
        return Finding(
            "stability", "any gain", f"more gain does not make the sampled filter unstable; {phase}"
        )
    return Finding(
        "stability",
        f"gain margin {found.gain_margin:.3g}",
        f"all gains may rise {found.gain_margin:.3g} fold{least} before the sampled filter is unstable; "
        f"{phase}",
    )


def _noise(law: Law, sensor: SensorNoise, sample_time: float, budget: AttitudeBudget | None) -> list[Finding]:
    known_bias = isinstance(law, LowPass)
    noise = replace(sensor.tilt, bias_walk=0.0) if known_bias else sensor.tilt
    share = predict_rms(law, noise, sample_time)
    tilt = share.total if budget is None else budget.roll
    if not math.isfinite(tilt):
        meaning = "grows without limit: the gyro bias wanders and no integral gain follows it"
        return [Finding("predicted error", "unbounded", meaning)]
    parts = {
        "gyro noise": share.gyro**2,
        "bias walk": share.bias_walk**2,
        "accelerometer noise": share.angle**2,
    }
    largest = max(parts, key=lambda name: parts[name])
    at_rest = "RMS at rest while the bias is known" if known_bias else "RMS at rest"
    heading = "" if budget is None else f", {math.degrees(budget.heading):.3g} deg heading"
    predicted = Finding(
        "predicted error",
        f"{math.degrees(tilt):.3g} deg tilt",
        f"{at_rest}{heading}; {100.0 * parts[largest] / share.total**2:.0f}% of the tilt variance is "
        f"{largest}",
    )
    if known_bias:
        return [predicted]
    best = optimal_gains(sensor.tilt)
    least = math.degrees(predict_rms(best, sensor.tilt).total)
    return [
        predicted,
        Finding(
            "best gains at rest",
            f"kp {best.kp:.3g}, ki {best.ki:.3g}",
            f"{least:.3g} deg of tilt; less if the vehicle accelerates, which noise alone does not show",
        ),
    ]

"""Gain of a closed loop at one signal, measured by disturbing it: stability margins of what really runs.

A sine d is added to the signal on its way, so that others see u + d where the source gives y. The same run
without the sine is subtracted, so that what moves the system anyway, noise included, cancels: noise is a
function of seed and sample number. What is left obeys y = -L u with u = y + d, hence L(jw) = -Y(jw)/U(jw),
the gain once around the loop broken at that signal. For a signal of several elements the disturbance goes
along a direction, such as the rotor speeds that roll a quadrotor, and y and u are seen along it.

The phase margin is how far the phase of L is from -180 deg where the gain is one; the gain margin is one over
the gain where the phase is -180 deg and the gain below one. Both are the smallest over the frequencies looked
at. They are margins of a loop that is stable: one that answers to a sine with something else has none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.cosim.system import System
from ahrs_fmu.cosim.taps import Memoryless
from ahrs_fmu.errors import ScenarioError

_LOWEST, _POINTS = 2.0, 16
_OF_NYQUIST = 0.3
"""Highest frequency of the default grid, of half the sampling rate."""
_SETTLING = 3.0
"""Time before the disturbance begins, s."""
_TRANSIENT = 2.0
"""Time after it began until measuring begins, s: an attitude loop has forgotten its beginning by then."""
_SHORTEST, _PERIODS = 2.0, 3
"""What is measured: s and whole periods, at least."""
_AMPLITUDE = 0.01
"""Of the disturbance, relative to the size of the signal at rest, or to its unit where that is zero."""
_UNEXPLAINED = 0.2
"""What may be left of the answer beside the sine, relative to the disturbance."""

LONGEST = _SETTLING + _TRANSIENT + _PERIODS * 2.0 * np.pi / _LOWEST
"""How long the longest run of a measurement is, from the start of the system on, s."""

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class LoopGain:
    """Gain of a loop over frequency.

    Attributes
    ----------
    frequency : ndarray, shape (N,)
        rad/s.
    response : ndarray of complex, shape (N,)
        L(jw).
    phase_margin : float
        rad; NaN when the gain does not cross one, -infinite when unstable.
    crossover : float
        Where the gain is one, rad/s; NaN when nowhere.
    gain_margin : float
        Factor; infinite when the phase does not cross -180 deg below a gain of one, 0 when unstable.
    phase_crossover : float
        Where it does, rad/s; NaN when nowhere.
    """

    frequency: Array
    response: ComplexArray
    phase_margin: float
    crossover: float
    gain_margin: float
    phase_crossover: float


def margins(
    system: System,
    signal: str,
    direction: Sequence[float],
    frequencies: Array | None = None,
    amplitude: float | None = None,
) -> LoopGain:
    """Measure the gain of a loop and its margins; the system is at its start before and after.

    Parameters
    ----------
    system : System
    signal : str
        Where the loop is broken, ``component.output``.
    direction : sequence of float
        Of the disturbance among the elements of the signal.
    frequencies : ndarray, shape (N,), optional
        rad/s, ascending; by default 16 from 2 rad/s to 0.3 of half the sampling rate.
    amplitude : float, optional
        Of the disturbance along the direction, in the unit of the signal; by default 1 % of the signal's size
        at rest, or 0.01 where that is zero.

    Raises
    ------
    ScenarioError
        If the direction does not fit the signal, or a frequency the step.
    SimulationError
        If a component fails.
    """
    along = _unit(direction, system, signal)
    nyquist = np.pi / system.step_size
    if frequencies is None:
        frequencies = np.geomspace(_LOWEST, _OF_NYQUIST * nyquist, _POINTS)
    if not (frequencies[0] > 0.0 and np.all(np.diff(frequencies) > 0.0) and frequencies[-1] < nyquist):
        raise ScenarioError(
            f"frequencies must ascend between 0 and {nyquist:g} rad/s, half the sampling rate"
        )
    system.reset()
    rest = system.run(_SETTLING, [signal])[signal]
    if amplitude is None:
        amplitude = _AMPLITUDE * (float(np.linalg.norm(rest[-1])) or 1.0)
    start, saved = system.time, system.save()
    quiet = _along(system, signal, along, max(_length(float(w)) for w in frequencies))[1]
    found = []
    for w in frequencies.tolist():

        def sine(time: Array, w: float = w) -> Array:
            wave: Array = np.sin(w * (time - start))
            return wave

        def disturb(time: Array, rows: Array, sine: Callable[[Array], Array] = sine) -> Array:
            disturbed: Array = rows + amplitude * sine(time)[:, None] * along
            return disturbed

        system.restore(saved)
        with system.tapped(signal, Memoryless(disturb)):
            time, disturbed = _along(system, signal, along, _length(w))
        found.append(_gain((disturbed - quiet[: len(time)]) / amplitude, sine(time), time - start, w))
    system.reset()
    response = np.array(found)
    if not np.isfinite(response).all():
        return LoopGain(frequencies, response, -np.inf, np.nan, 0.0, np.nan)
    return with_margins(frequencies, response)


def with_margins(frequency: Array, response: ComplexArray) -> LoopGain:
    """Find crossings and margins of a loop gain given at some frequencies.

    Parameters
    ----------
    frequency : ndarray, shape (N,)
        rad/s, ascending; close enough for splines of logarithmic gain and phase.
    response : ndarray of complex, shape (N,)
    """
    at = np.log(frequency)
    gain = CubicSpline(at, np.log(np.abs(response)))
    phase = CubicSpline(at, np.unwrap(np.angle(response)))
    turns = 2.0 * np.pi * np.arange(-8, 9) - np.pi
    opposite = np.concatenate([phase.solve(turn, extrapolate=False) for turn in turns])
    by_phase = [
        (float(abs(np.angle(-np.exp(1j * phase(where))))), float(np.exp(where)))
        for where in gain.roots(extrapolate=False)
    ]
    by_gain = [(float(np.exp(-gain(where))), float(np.exp(where))) for where in opposite if gain(where) < 0.0]
    phase_margin, crossover = min(by_phase, default=(np.nan, np.nan))
    gain_margin, phase_crossover = min(by_gain, default=(np.inf, np.nan))
    return LoopGain(frequency, response, phase_margin, crossover, gain_margin, phase_crossover)


def _unit(direction: Sequence[float], system: System, signal: str) -> Array:
    shape = system.port(signal).shape or (1,)
    along = np.asarray(direction, dtype=np.float64)
    if along.shape != shape or not along.any():
        raise ScenarioError(f"direction {list(direction)} does not fit {signal}, which has shape {shape}")
    unit: Array = along / np.linalg.norm(along)
    return unit


def _length(frequency: float) -> float:
    """Time to run, s."""
    period = 2.0 * np.pi / frequency
    return float(_TRANSIENT + period * max(_PERIODS, np.ceil(_SHORTEST / period)))


def _along(system: System, signal: str, along: Array, duration: float) -> tuple[Array, Array]:
    """Times (N,) and the signal (N,) along the direction, with what is added to it."""
    recording = system.run(duration, [signal])
    return recording.time, recording[signal].reshape(len(recording), -1) @ along


def _gain(seen: Array, wave: Array, time: Array, frequency: float) -> complex:
    """L from the difference (N,) that a disturbance (N,) makes, in units of its amplitude.

    NaN when the difference is no sine of that frequency, as that of an unstable loop.
    """
    used = time > _TRANSIENT
    seen, wave, time = seen[used], wave[used], time[used]
    turn = np.exp(1j * frequency * time)
    basis = np.column_stack((turn, turn.conj(), np.ones_like(time), time))
    answers = np.column_stack((seen, seen - wave))
    weights = np.linalg.lstsq(basis, answers, rcond=None)[0]
    u, y = weights[0]
    left = np.sqrt(2.0 * np.mean(np.abs(answers - basis @ weights) ** 2))
    # A loop that has run away drowns the sine altogether.
    return complex(-y / u) if left < _UNEXPLAINED and abs(u) > 0.0 else complex(np.nan)

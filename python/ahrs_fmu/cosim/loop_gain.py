"""Gain of a closed loop at one signal, measured by disturbing it: stability margins of what really runs.

A sine d is added to the signal on its way, so that others see u = y + d while the source gives y. With
everything else at rest y = -L u, hence L(jw) = -Y(jw)/U(jw), the gain once around the loop broken at that
signal. For a signal of several elements the disturbance goes along a direction, such as the rotor speeds
that roll a quadrotor, and y and u are seen along it.

The phase margin is 180 deg plus the phase of L where |L| = 1; the gain margin is 1/|L| where the phase of L
is -180 deg. Both are the smallest over the frequencies looked at. A loop that moves by itself more than by
the disturbance is unstable and has no margin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ahrs_fmu.cosim.stepper import Array
from ahrs_fmu.cosim.system import System
from ahrs_fmu.cosim.taps import Memoryless
from ahrs_fmu.errors import ScenarioError

_LOWEST, _HIGHEST, _POINTS = 2.0, 80.0, 24
_SETTLING = 2.0
_SHORTEST = 4.0
_PERIODS = 4
LONGEST = _SETTLING + max(_SHORTEST, _PERIODS * 2.0 * np.pi / _LOWEST)
"""How long the longest run of a measurement is, s."""
_FINE = 4000
_AMPLITUDE = 0.01
"""Of the disturbance, relative to the size of the signal when undisturbed."""
_MOST_BESIDES = 1.0
"""What the signal may do besides, of that amplitude: with the default sensors it is 0.07, near the limit of
stability 0.4, beyond it 30."""


@dataclass(frozen=True, slots=True, eq=False)
class LoopGain:
    """Measured gain of a loop.

    Attributes
    ----------
    frequency : ndarray, shape (N,)
        rad/s.
    response : ndarray of complex, shape (N,)
        L(jw).
    phase_margin : float
        rad; infinite when |L| does not cross one, -infinite when the loop is unstable.
    crossover : float
        Where |L| = 1, rad/s; NaN when nowhere.
    gain_margin : float
        Factor; infinite when the phase does not cross -180 deg, 0 when the loop is unstable.
    phase_crossover : float
        Where it does, rad/s; NaN when nowhere.
    """

    frequency: Array
    response: np.ndarray[tuple[int], np.dtype[np.complex128]]
    phase_margin: float
    crossover: float
    gain_margin: float
    phase_crossover: float


def margins(
    system: System, signal: str, direction: Sequence[float], frequencies: Array | None = None
) -> LoopGain:
    """Measure the gain of the loop and its margins; the system is at its start before and after.

    Parameters
    ----------
    system : System
        At rest but for noise: what moves it disturbs the measurement.
    signal : str
        Where the loop is broken, ``component.output``.
    direction : sequence of float
        Of the disturbance among the elements of the signal.
    frequencies : ndarray, shape (N,), optional
        rad/s, ascending; by default 24 between 2 and 80 rad/s, below half of the sampling rate.

    Raises
    ------
    ScenarioError
        If the direction does not fit the signal.
    SimulationError
        If a component fails.
    """
    port = system.port(signal)
    along = np.asarray(direction, dtype=np.float64)
    if along.shape != (port.shape or (1,)) or not along.any():
        raise ScenarioError(
            f"direction {list(direction)} does not fit {signal}, which has shape {port.shape}"
        )
    along = along / np.linalg.norm(along)
    nyquist = np.pi / system.step_size
    if frequencies is None:
        frequencies = np.geomspace(_LOWEST, min(_HIGHEST, 0.8 * nyquist), _POINTS)
    system.reset()
    rest = system.run(_SETTLING, [signal])[signal]
    amplitude = _AMPLITUDE * max(float(np.linalg.norm(rest[-1])), _AMPLITUDE)
    found = [_response(system, signal, along * amplitude, float(w)) for w in frequencies]
    system.reset()
    response = np.array([gain for gain, _ in found])
    if np.median([besides for _, besides in found]) > _MOST_BESIDES:
        return LoopGain(frequencies, response, -np.inf, np.nan, 0.0, np.nan)
    return _with_margins(frequencies, response)


def _response(system: System, signal: str, disturbance: Array, frequency: float) -> tuple[complex, float]:
    """Gain of the loop, and what the signal does besides, of the amplitude of the disturbance."""

    def wave(time: Array) -> Array:
        sine: Array = np.sin(frequency * time)
        return sine

    disturbed = Memoryless(lambda time, values: values + wave(time)[:, None] * disturbance)
    system.reset()
    with system.tapped(signal, disturbed):
        period = 2.0 * np.pi / frequency
        measured = period * max(_PERIODS, np.ceil(_SHORTEST / period))
        recording = system.run(_SETTLING + measured, [signal])
    used = recording.time > _SETTLING
    time = recording.time[used]
    seen = recording[signal][used].reshape(len(time), -1) @ disturbance / float(disturbance @ disturbance)
    source = seen - wave(time)
    basis = np.column_stack(
        (np.exp(1j * frequency * time), np.exp(-1j * frequency * time), np.ones_like(time), time)
    )
    coefficients = np.linalg.lstsq(basis, np.column_stack((seen, source)), rcond=None)[0]
    u, y = coefficients[0]
    return complex(-y / u), float(np.sqrt(np.mean(np.abs(seen - basis @ coefficients[:, 0]) ** 2)))


def _with_margins(frequency: Array, response: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> LoopGain:
    fine = np.geomspace(frequency[0], frequency[-1], _FINE)
    at = np.log(frequency)
    gain = CubicSpline(at, np.log(np.abs(response)))(np.log(fine))
    phase = CubicSpline(at, np.unwrap(np.angle(response)))(np.log(fine))
    # The phase of a stable loop begins between 0 and -360 deg.
    phase = phase - 2.0 * np.pi * np.ceil(phase[0] / (2.0 * np.pi))
    unity = np.flatnonzero(np.diff(np.sign(gain)))
    opposite = np.flatnonzero(np.diff(np.sign(phase + np.pi)))
    by_phase = [(float(abs(phase[i] + np.pi)), float(fine[i])) for i in unity]
    by_gain = [(float(np.exp(-gain[i])), float(fine[i])) for i in opposite if gain[i] < 0.0]
    phase_margin, crossover = min(by_phase, default=(np.inf, np.nan))
    gain_margin, phase_crossover = min(by_gain, default=(np.inf, np.nan))
    return LoopGain(frequency, response, phase_margin, crossover, gain_margin, phase_crossover)

"""Linear model of an estimator about an attitude, from finite differences through saved states."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from control import StateSpace

from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.measure import SETTLE, OperatingPoint, require_estimator
from ahrs_fmu.analysis.quantity import require_positive
from ahrs_fmu.analysis.systems import Array
from ahrs_fmu.cosim.stepper import Stepper, replay

_HANKEL_BLOCKS = 40
_NEGLIGIBLE = 1e-7
"""Singular values below this part of the largest are rounding errors."""


def linearise(
    stepper: Stepper,
    sample_time: float,
    axes: Sequence[int] = (0, 1, 2),
    point: OperatingPoint | None = None,
    settle: float = SETTLE,
    horizon: float = 60.0,
    order: int | None = None,
    angle: float = 1e-3,
    separate: bool = False,
) -> StateSpace:
    """Return the linear model of an estimator about an attitude, from finite differences.

    The estimator settles at rest; from its saved state, every input gets one small pulse in either
    direction. The differences of the answers are the pulse responses, of which the eigensystem realisation
    algorithm makes the smallest state space.

    Parameters
    ----------
    stepper : Stepper
        Has the inputs gyro, accel and mag and the outputs q and gyro_bias; it is reset.
    sample_time : float
        Step in seconds; the sample time of the estimator.
    axes : sequence of {0, 1, 2}, optional
        Body axes to excite and to look at. Alike axes that leak into each other have multiple poles, which no
        difference resolves well: their poles are better asked for one axis at a time.
    point : OperatingPoint, optional
        Where to linearise; level and heading north by default.
    settle : float, optional
        Time at rest before, s.
    horizon : float, optional
        Time over which the answers are followed, s; a few of the slowest time constants.
    order : int, optional
        Number of states; by default those that stand out of the rounding errors.
    angle : float, optional
        Size of the pulses, rad; that of the rate pulses is the same over one sample.
    separate : bool, optional
        Turn what the accelerometer sees and what the magnetometer sees one at a time.

    Returns
    -------
    control.StateSpace
        Discrete. Inputs: measured angle about the axes (rad), gyro rate (rad/s); when separate, the angle
        that the accelerometer shows, that of the magnetometer, gyro rate. Outputs: estimated angle (rad),
        gyro bias (rad/s).
    """
    T = require_positive("sample_time", sample_time, "s")
    require_positive("pulse", angle, "rad")
    point = point or OperatingPoint()
    require_estimator(stepper)
    stepper.reset()
    rest = np.zeros((math.ceil(settle / T), 3))
    replay(stepper, point.sensors(rest, rest), ["q"], T)
    saved = stepper.save()
    steps = math.ceil(horizon / T)
    seen = [*axes, *(3 + axis for axis in axes)]
    directions, sizes = _pulses(axes, angle, T, separate)

    def pulse(direction: Array) -> Array:
        drive = np.zeros((steps, 9))
        drive[0] = direction
        stepper.restore(saved)
        sensors = point.sensors(drive[:, :3], drive[:, 6:])
        sensors["mag"] = point.sensors(drive[:, 3:6], drive[:, 6:])["mag"]
        found = replay(stepper, sensors, ["q", "gyro_bias"], T)
        return np.hstack((point.turned(found["q"]), found["gyro_bias"]))[:, seen]

    markov = np.stack(
        [(pulse(d) - pulse(-d)) / (2.0 * size) for d, size in zip(directions, sizes, strict=True)], axis=-1
    )
    return _realised(markov, T, order)


def _pulses(axes: Sequence[int], angle: float, sample_time: float, separate: bool) -> tuple[Array, Array]:
    """Turns of accelerometer and magnetometer and the gyro's reading (inputs, 9), and their sizes."""
    accel, mag, gyro = np.eye(9).reshape(3, 3, 9)[:, list(axes)]
    angles = np.vstack((accel, mag)) if separate else accel + mag
    directions = np.vstack((angle * angles, angle / sample_time * gyro))
    return directions, np.max(directions, axis=1)


def _realised(markov: Array, sample_time: float, order: int | None) -> StateSpace:
    """Return the state space with the pulse responses (steps, outputs, inputs), after Ho and Kalman."""
    steps, outputs, inputs = markov.shape
    # A Hankel matrix need not have every sample: rows and columns over all the horizon see slow poles best.
    starts = np.unique(np.geomspace(1, max(2, (steps - 2) // 2), _HANKEL_BLOCKS).astype(int)) - 1
    times = starts[:, None] + starts + 1

    def hankel(shift: int) -> Array:
        blocks: Array = markov[times + shift].transpose(0, 2, 1, 3)
        return blocks.reshape(starts.size * outputs, starts.size * inputs)

    # Outputs and inputs of different units get comparable weight.
    out_scale = _size(markov, (0, 2))
    in_scale = _size(markov / out_scale[:, None], (0, 1))
    left, right = np.tile(out_scale, starts.size), np.tile(in_scale, starts.size)
    u, s, vt = np.linalg.svd(hankel(0) / np.outer(left, right), full_matrices=False)
    states = int(np.count_nonzero(s > _NEGLIGIBLE * s[0])) if order is None else order
    root = np.sqrt(s[:states])
    u, vt = u[:, :states], vt[:states]
    a = (u.T @ (hankel(1) / np.outer(left, right)) @ vt.T) / np.outer(root, root)
    b = (root[:, None] * vt)[:, :inputs] * in_scale
    c = (u * root)[:outputs] * out_scale[:, None]
    return systems.state_space(a, b, c, markov[0], sample_time)


def _size(values: Array, axis: tuple[int, int]) -> Array:
    """Root mean square; one where there is nothing, as of the bias of a filter that learns none."""
    rms = np.sqrt(np.mean(values**2, axis=axis))
    return np.where(rms > 0.0, rms, 1.0)

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

    Returns
    -------
    control.StateSpace
        Discrete. Inputs: measured angle about the axes (rad), gyro rate (rad/s). Outputs: estimated angle
        (rad), gyro bias (rad/s).
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
    chosen = [*axes, *(3 + axis for axis in axes)]
    sizes = np.repeat([angle, angle / T], 3)

    def pulse(channel: int, size: float) -> Array:
        drive = np.zeros((steps, 6))
        drive[0, channel] = size
        stepper.restore(saved)
        found = replay(stepper, point.sensors(drive[:, :3], drive[:, 3:]), ["q", "gyro_bias"], T)
        return np.hstack((point.turned(found["q"]), found["gyro_bias"]))[:, chosen]

    markov = np.stack(
        [(pulse(i, sizes[i]) - pulse(i, -sizes[i])) / (2.0 * sizes[i]) for i in chosen], axis=-1
    )
    return _realised(markov, T, order)


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
    out_scale = np.maximum(np.sqrt(np.mean(markov**2, axis=(0, 2))), 1e-300)
    in_scale = np.maximum(np.sqrt(np.mean((markov / out_scale[:, None]) ** 2, axis=(0, 1))), 1e-300)
    left, right = np.tile(out_scale, starts.size), np.tile(in_scale, starts.size)
    u, s, vt = np.linalg.svd(hankel(0) / np.outer(left, right), full_matrices=False)
    states = int(np.count_nonzero(s > _NEGLIGIBLE * s[0])) if order is None else order
    root = np.sqrt(s[:states])
    u, vt = u[:, :states], vt[:states]
    a = (u.T @ (hankel(1) / np.outer(left, right)) @ vt.T) / np.outer(root, root)
    b = (root[:, None] * vt)[:, :inputs] * in_scale
    c = (u * root)[:outputs] * out_scale[:, None]
    return systems.state_space(a, b, c, markov[0], sample_time)

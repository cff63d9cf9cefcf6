"""Complementary filters on three axes, whose error does not measure every axis with unit gain.

Linearised about an attitude, the error of one step is

    e = M_a (A - theta) + M_m (A - theta) + E_a n_a + E_m n_m,

with A the attitude that the sensors have, theta the predicted one (small body rotation vectors, rad),
M_a the part of the loop gain that the accelerometer carries, M_m that of the magnetometer, and n_a, n_m
the sensors' noise (docs/algorithms.md sections 2.1, 5 and 6). M = M_a + M_m is the identity only for the
error between two attitudes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from control import StateSpace, TransferFunction
from numpy.typing import ArrayLike

from ahrs_fmu import quaternion
from ahrs_fmu.analysis import systems
from ahrs_fmu.analysis.systems import Array, ComplexArray
from ahrs_fmu.analysis.theory import STANDARD_GRAVITY, Gains, compensation_factor, correction, discretise
from ahrs_fmu.errors import DesignError

ErrorKind = Literal["decoupled", "coupled", "attitude"]
"""How the filter forms its error: tilt from the accelerometer and heading from the levelled
magnetometer (decoupled), cross products of both vectors (coupled), or the difference to the attitude
made of both sensors (attitude)."""


@dataclass(frozen=True, slots=True)
class ErrorModel:
    """The linearised error of a filter with n axes."""

    accel_gain: Array
    """M_a, (n, n)."""
    mag_gain: Array
    """M_m, (n, n)."""
    accel_noise: Array
    """E_a, (n, m), rad per m/s^2."""
    mag_noise: Array
    """E_m, (n, m), rad per unit of noise relative to the field's magnitude."""

    @property
    def gain(self) -> Array:
        """The loop gain matrix M."""
        return self.accel_gain + self.mag_gain


def scalar_error() -> ErrorModel:
    """Return the error of one axis measured with unit gain; its noise is an angle in rad."""
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    return ErrorModel(accel_gain=one, mag_gain=none, accel_noise=one, mag_noise=none)


def error_model(
    kind: ErrorKind,
    dip: float,
    attitude: ArrayLike = quaternion.IDENTITY,
    accel_weight: float = 1.0,
    mag_weight: float = 1.0,
    gravity: float = STANDARD_GRAVITY,
) -> ErrorModel:
    """Linearise an error about an attitude.

    Parameters
    ----------
    kind : {"decoupled", "coupled", "attitude"}
        How the filter forms its error.
    dip : float
        Inclination of the field below the horizon, rad.
    attitude : array (4,), optional
        q_nb, body to NED with x to magnetic north.
    accel_weight, mag_weight : float, optional
        Weights kg and kh of the two cross products; coupled only.
    gravity : float, optional
        m/s^2.

    Raises
    ------
    DesignError
        The kind is unknown, or the field is vertical where the error needs a horizontal part.
    """
    north, east, down = quaternion.to_matrix(attitude)
    up = -down
    tilt_noise = -_cross(up) / gravity
    if kind == "coupled":
        field = math.cos(dip) * north + math.sin(dip) * down
        return ErrorModel(
            accel_gain=accel_weight * _normal(up),
            mag_gain=mag_weight * _normal(field),
            accel_noise=accel_weight * tilt_noise,
            mag_noise=-mag_weight * _cross(field),
        )
    if kind not in ("decoupled", "attitude"):
        raise DesignError(f"error {kind!r} is unknown: use decoupled, coupled or attitude")
    if math.cos(dip) < 1e-6:
        raise DesignError(f"dip = {math.degrees(dip):g} deg: a vertical field tells no heading")
    # A tilt error about north turns the levelled field about down by tan(dip) of itself.
    leak = math.tan(dip) * np.outer(down, north)
    heading = np.outer(down, down) - leak
    mag_noise = -np.outer(down, east) / math.cos(dip)
    if kind == "decoupled":
        return ErrorModel(_normal(up), heading, tilt_noise, mag_noise)
    return ErrorModel(_normal(up) + leak, heading, (np.eye(3) + leak) @ tilt_noise, mag_noise)


@dataclass(frozen=True, slots=True)
class CoupledFilter:
    """A filter on n axes, made by `coupled_filter`."""

    system: StateSpace
    """From the attitude of the sensors, the gyro rate (rad/s), and the noise of both, each of n axes,
    to the estimated attitude (n axes)."""
    axes: int
    sample_time: float | None
    """Seconds, or None in continuous time."""
    learnt_bias: Array | None
    """The state (states, n) in which the filter has learnt a gyro bias of 1 rad/s about each axis;
    None if its law has no integrator to learn with."""

    def respond(self, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return G_A and G_B at `omega` rad/s, each (n, n, ...): axis of the estimate, axis of the input.

        G_B is from the gyro angle.
        """
        s = 1j * np.asarray(omega, dtype=np.float64)
        values = systems.response(self.system, omega)
        n, T = self.axes, self.sample_time
        angle_per_rate = 1.0 / s if T is None else T * np.exp(s * T) / np.expm1(s * T)
        return values[:, :n], values[:, n : 2 * n] / angle_per_rate

    @property
    def poles(self) -> ComplexArray:
        """Poles in the s or z plane."""
        return systems.poles(self.system)

    def covariance(self, gyro: float, bias_walk: float, accel: float, mag: float) -> Array:
        """Return the steady covariance (n, n) of the estimate in rad^2 for white noise of every sensor.

        Parameters
        ----------
        gyro : float
            Density of the gyro noise, rad/s/rtHz.
        bias_walk : float
            Density of the gyro bias's random walk, rad/s^2/rtHz.
        accel : float
            Density of the accelerometer noise, m/s^2/rtHz; rad/rtHz for a scalar error.
        mag : float
            Density of the magnetometer noise relative to the field's magnitude, 1/rtHz.

        Returns
        -------
        array (n, n)
            Infinite throughout when a random walk accumulates in any axis.
        """
        a, b, c, d = systems.matrices(self.system)
        n, T = self.axes, self.sample_time
        reach = np.max(self.poles.real) if T is None else np.max(np.abs(self.poles)) - 1.0
        if reach > -1e-9 or (bias_walk and self.learnt_bias is None):
            return np.full((n, n), math.inf)
        sensors = (b.shape[1] - 2 * n) // 2
        density = np.concatenate((np.zeros(n), np.full(n, gyro), np.repeat([accel, mag], sensors)))
        # Counted from the bias as it is now, an increment leaves the filter with the old one.
        old_bias = bias_walk * (np.zeros((a.shape[0], n)) if self.learnt_bias is None else self.learnt_bias)
        if T is None:
            inputs = np.hstack((b * density, old_bias))
            state = systems.stationary_covariance(a, inputs @ inputs.T, 0.0)
            return np.asarray(c @ state @ c.T, dtype=np.float64)
        # White samples have the density over the root of T as standard deviation, increments times it.
        inputs = np.hstack((b * density, T * a @ old_bias)) / T
        feed = np.hstack((d * density, T * c @ old_bias))
        state = systems.stationary_covariance((a - np.eye(a.shape[0])) / T, inputs @ inputs.T, T)
        return np.asarray(c @ state @ c.T + feed @ feed.T / T, dtype=np.float64)


def coupled_filter(
    h: TransferFunction, error: ErrorModel, motion_time_constant: float | None = None
) -> CoupledFilter:
    """Close the loop of a correction law on all axes of an error model.

    Parameters
    ----------
    h : control.TransferFunction
        H(s), or H(z) of `ahrs_fmu.analysis.theory.discretise`; the same for all axes.
    error : ErrorModel
    motion_time_constant : float, optional
        Time constant in seconds of the motion-acceleration compensation, which acts on the
        accelerometer's part of the error alone, from sample to sample.

    Raises
    ------
    DesignError
        Motion compensation is asked for of a continuous H.
    """
    T = systems.sample_time_of(h)
    if T is None and motion_time_constant is not None:
        raise DesignError("motion compensation acts from sample to sample: discretise(h, sample_time) first")
    law = systems.realise(h)
    order, n = law.a.shape[0], error.gain.shape[0]
    if T is None:
        system = _continuous(law, error)
    else:
        c = 0.0 if motion_time_constant is None else compensation_factor(motion_time_constant, T)
        system = _sampled(law, error, T, c)
    at_rest = law.a if T is None else law.a - np.eye(order)
    return CoupledFilter(system, n, T, _learnt_bias(at_rest, law.c, n, system.nstates))


def _continuous(law: systems.Realisation, error: ErrorModel) -> StateSpace:
    n, sensors, order = error.gain.shape[0], error.accel_noise.shape[1], law.a.shape[0]
    # Columns of every row block: attitude, law | A, gyro rate, n_a, n_m.
    widths = (n, n * order, n, n, sensors, sensors)
    attitude, memory, angle, rate, accel, mag = np.split(np.eye(sum(widths)), np.cumsum(widths)[:-1])
    each = np.eye(n)
    total = error.gain @ (angle - attitude) + error.accel_noise @ accel + error.mag_noise @ mag
    turned = rate + law.d * total + np.kron(law.c, each) @ memory
    learnt = np.kron(law.a, each) @ memory + np.kron(law.b, each) @ total
    states = n + n * order
    rows = np.vstack((turned, learnt))
    return systems.state_space(
        rows[:, :states], rows[:, states:], attitude[:, :states], attitude[:, states:], None
    )


def _sampled(law: systems.Realisation, error: ErrorModel, T: float, c: float) -> StateSpace:
    n, sensors, order = error.gain.shape[0], error.accel_noise.shape[1], law.a.shape[0]
    # Columns of every row block: attitude, law, accelerometer residual | A, gyro rate, n_a, n_m.
    widths = (n, n * order, n, n, n, sensors, sensors)
    attitude, memory, residual, angle, rate, accel, mag = np.split(
        np.eye(sum(widths)), np.cumsum(widths)[:-1]
    )
    each = np.eye(n)
    predicted = attitude + T * rate + T * np.kron(law.c, each) @ memory
    accel_error = error.accel_gain @ (angle - predicted) + error.accel_noise @ accel
    mag_error = error.mag_gain @ (angle - predicted) + error.mag_noise @ mag
    total = accel_error - c * residual + mag_error
    corrected = predicted + T * law.d * total
    learnt = np.kron(law.a, each) @ memory + np.kron(law.b, each) @ total
    left = error.accel_gain @ (angle - corrected) + error.accel_noise @ accel
    states = n + n * order + n
    kept = states if c else states - n
    rows = np.vstack((corrected, learnt, left))[:kept]
    return systems.state_space(
        rows[:, :kept], rows[:, states:], corrected[:, :kept], corrected[:, states:], T
    )


def gains_on_axes(
    gains: Gains, sample_time: float | None, error: ErrorModel, motion_time_constant: float | None = None
) -> CoupledFilter:
    """Return the filter of the given gains on all axes of an error model; continuous without sample time."""
    h = correction(gains)
    return coupled_filter(
        h if sample_time is None else discretise(h, sample_time), error, motion_time_constant
    )


def _learnt_bias(at_rest: Array, c: Array, axes: int, states: int) -> Array | None:
    """Return the state that cancels a bias, if the law can hold one without an error."""
    order = at_rest.shape[0]
    conditions = np.vstack((at_rest, c))
    wanted = np.append(np.zeros(order), -1.0)
    memory = np.linalg.lstsq(conditions, wanted, rcond=None)[0]
    if order == 0 or not np.allclose(conditions @ memory, wanted, atol=1e-6):
        return None
    result = np.zeros((states, axes))
    result[axes : axes + axes * order] = np.kron(memory[:, None], np.eye(axes))
    return result


def _cross(v: Array) -> Array:
    """Return the matrix [v]x with [v]x u = v x u."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _normal(v: Array) -> Array:
    """Return the projection on the plane normal to the unit vector v."""
    return np.asarray(np.eye(3) - np.outer(v, v), dtype=np.float64)

"""Generalized complementary filter (docs/algorithms.md section 5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahrs_fmu import quaternion
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.geometry import attitude_from_axes, dot, down_of, north_of, unit
from ahrs_fmu.estimators.state import Array, Parameters, Sample
from ahrs_fmu.estimators.vectors import attitude_error, coupled_error, decoupled_error
from ahrs_fmu.quaternion import cross


class State(NamedTuple):
    """State of the filter.

    Attributes
    ----------
    bias : ndarray (..., 3)
        Gyroscope bias, rad/s: the integrator of H(s).
    drift : ndarray (..., 3)
        Its rate of change, rad/s2: the double integrator of H(s).
    axes : ndarray (..., 3, 3)
        North, east and down seen from the body, for the realisations that store them.
    euler : ndarray (..., 3)
        Roll, pitch, yaw in rad, for the realisation that stores them.
    """

    bias: Array
    drift: Array
    axes: Array
    euler: Array


class GCF(Filter[State]):
    """Predict with the rate, correct by H(s) times the error of the predicted attitude."""

    def initial(self, q: Array) -> State:
        """Start without bias."""
        zero = np.zeros((*self.shape, 3))
        return State(zero, zero, quaternion.to_matrix(q), quaternion.to_euler(q))

    def turned(self, state: State, q: Array) -> State:
        """Take over the attitude."""
        return state._replace(axes=quaternion.to_matrix(q), euler=quaternion.to_euler(q))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:
        """Predict, take the error as a body rotation vector, learn the bias, correct."""
        p, T = self.p, z.gain_dt
        predict, correct = (z.rate - state.bias) * z.dt, p.kp * T
        if p.realisation == "quaternion":
            q = quaternion.multiply(q, quaternion.exp(predict))
            e = error(p, down_of(q), north_of(q), z)
            q = quaternion.multiply(q, quaternion.exp(correct * e))
        elif p.realisation == "euler":
            q = quaternion.multiply(quaternion.from_euler(state.euler), quaternion.exp(predict))
            e = error(p, down_of(q), north_of(q), z)
            q = quaternion.multiply(q, quaternion.exp(correct * e))
            state = state._replace(euler=quaternion.to_euler(q))
        else:
            turn = turn_matrix if p.realisation == "dcm" else turn_vectors
            axes = turn(state.axes, predict)
            e = error(p, axes[..., 2, :], axes[..., 0, :], z)
            axes = turn(axes, correct * e)
            state, q = state._replace(axes=axes), attitude_from_axes(axes)
        drift = state.drift + T * p.kii * e
        bias = np.clip(state.bias - T * (p.ki * e + drift), -p.bias_limit, p.bias_limit)
        return state._replace(bias=bias, drift=drift), q

    def gyro_bias(self, state: State) -> Array:
        """Give the integrator of H(s)."""
        return state.bias


def error(p: Parameters, down: Array, north: Array, z: Sample) -> Array:
    """Rotation vector (..., 3) in body axes that corrects an attitude given by its down and north."""
    if p.form == "attitude":
        q = attitude_from_axes(np.stack((north, cross(down, north), down), axis=-2))
        return attitude_error(q, z)
    if p.error == "coupled":
        return coupled_error(p.kg, p.kh, down, north, z)
    return decoupled_error(down, north, z)


def turn_matrix(axes: Array, v: Array) -> Array:
    """Rotation matrix after the body turned by v, with a step towards the nearest rotation matrix."""
    c = axes @ quaternion.to_matrix(quaternion.exp(v))
    return 1.5 * c - 0.5 * c @ np.swapaxes(c, -1, -2) @ c


def turn_vectors(axes: Array, v: Array) -> Array:
    """North and down after the body turned by v, kept of unit length and at right angles; down leads."""
    back = quaternion.conjugate(quaternion.exp(v))
    down = unit(quaternion.rotate(back, axes[..., 2, :]))
    north = quaternion.rotate(back, axes[..., 0, :])
    north = unit(north - dot(north, down)[..., None] * down)
    return np.stack((north, cross(down, north), down), axis=-2)

"""Linear systems: the seam to python-control, which has no types of its own.

Polynomials are arrays of coefficients, highest power first, as in numpy and python-control.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from control import StateSpace, TransferFunction
from numpy.typing import ArrayLike, NDArray
from scipy.signal import tf2ss

from ahrs_fmu.errors import DesignError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Fraction(NamedTuple):
    """A rational function as two polynomials."""

    numerator: Array
    denominator: Array


class Realisation(NamedTuple):
    """A state space with one input and one output: x' = A x + B u, y = C x + D u."""

    a: Array
    b: Array
    c: Array
    d: float


def transfer_function(
    numerator: ArrayLike, denominator: ArrayLike, sample_time: float | None
) -> TransferFunction:
    """Build a transfer function in s (`sample_time` None) or z, without common factors at the origin."""
    num, den = (
        np.trim_zeros(np.atleast_1d(np.asarray(p, dtype=np.float64)), "f") for p in (numerator, denominator)
    )
    if not num.size:
        return TransferFunction([0.0], [1.0], sample_time or 0)
    common = min(_zeros_at_origin(num), _zeros_at_origin(den))
    num, den = num[: num.size - common], den[: den.size - common]
    return TransferFunction(num / den[0], den / den[0], sample_time or 0)


def state_space(
    a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike, sample_time: float | None
) -> StateSpace:
    """Build a state space, continuous when `sample_time` is None; no state is removed."""
    return StateSpace(a, b, c, d, sample_time or 0, remove_useless_states=False)


def fraction(system: TransferFunction | StateSpace) -> Fraction:
    """Return numerator and denominator of a system with one input and one output.

    Raises
    ------
    DesignError
        The system has several inputs or outputs.
    """
    if system.ninputs != 1 or system.noutputs != 1:
        raise DesignError(
            f"H has {system.ninputs} inputs and {system.noutputs} outputs: give a system with one of each"
        )
    if isinstance(system, StateSpace):
        num, den = _state_space_fraction(system)
    else:
        num, den = (np.asarray(p[0][0], dtype=np.float64) for p in (system.num, system.den))
    return Fraction(np.trim_zeros(num, "f"), np.trim_zeros(den, "f"))


def sample_time_of(system: TransferFunction | StateSpace) -> float | None:
    """Return the sample time in seconds, or None for a continuous system.

    Raises
    ------
    DesignError
        The system is discrete without a sample time.
    """
    if not system.isdtime(strict=True):
        return None
    if isinstance(system.dt, bool):
        raise DesignError("the system is discrete without a sample time: give it one in seconds, dt=0.01")
    return float(system.dt)


def matrices(system: StateSpace) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C, D as plain arrays."""
    a, b, c, d = (np.asarray(m, dtype=np.float64) for m in (system.A, system.B, system.C, system.D))
    return a, b, c, d


def realise(system: TransferFunction | StateSpace) -> Realisation:
    """Return a state space of a system with one input and one output.

    That of a discrete transfer function is x <- x + T (A x + B u) with A, B of its polynomials in delta.
    """
    if isinstance(system, StateSpace):
        a, b, c, d = matrices(system)
        return Realisation(a, b, c, float(d[0, 0]))
    T = sample_time_of(system)
    num, den = fraction(system)
    if T is None:
        a, b, c, d = tf2ss(num, den)
    else:
        a, b, c, d = tf2ss(in_delta(num, T), in_delta(den, T))
        a, b = np.eye(a.shape[0]) + T * a, T * b
    return Realisation(a, b, c, float(d[0, 0]))


def stationary_covariance(a: Array, intensity: Array, sample_time: float) -> Array:
    """Solve A P + P A' + T A P A' + Q = 0 for P.

    With T = 0 this is the Lyapunov equation of continuous time, with A = (F - I)/T that of the recursion
    x <- F x + noise of covariance Q T: one equation, which stays well conditioned when F is close to one.
    """
    one = np.eye(a.shape[0])
    operator = np.kron(one, a) + np.kron(a, one) + sample_time * np.kron(a, a)
    covariance: Array = np.linalg.solve(operator, -intensity.ravel()).reshape(a.shape)
    return covariance


def poles(system: TransferFunction | StateSpace) -> ComplexArray:
    """Poles in the s or z plane."""
    if isinstance(system, TransferFunction):
        return np.roots(fraction(system).denominator).astype(np.complex128)
    return np.asarray(system.poles(), dtype=np.complex128)


def zeros(system: TransferFunction | StateSpace) -> ComplexArray:
    """Zeros in the s or z plane of a system with one input and one output."""
    return np.roots(fraction(system).numerator).astype(np.complex128)


def response(system: TransferFunction | StateSpace, omega: ArrayLike) -> ComplexArray:
    """Frequency response at `omega` rad/s.

    Returns
    -------
    array (...,) of complex, in the shape of `omega`, or (outputs, inputs, ...) for several of each
    """
    omega = np.asarray(omega, dtype=np.float64)
    dt = sample_time_of(system)
    if isinstance(system, TransferFunction) and system.ninputs == system.noutputs == 1:
        num, den = fraction(system)
        if dt is None:
            point = 1j * omega
        else:
            # In powers of z - 1, which expm1 gives to all digits, nothing cancels at low frequency.
            num, den, point = about_one(num), about_one(den), np.expm1(1j * omega * dt)
        return np.asarray(np.polyval(num, point) / np.polyval(den, point), dtype=np.complex128)
    point = 1j * omega if dt is None else np.exp(1j * omega * dt)
    values = np.asarray(system(np.atleast_1d(point), squeeze=False), dtype=np.complex128)
    values = values.reshape(values.shape[:2] + omega.shape)
    return values[0, 0] if system.ninputs == system.noutputs == 1 else values


def about_one(polynomial: Array) -> Array:
    """Rewrite a polynomial in z as one in z - 1, by repeated synthetic division."""
    shifted = polynomial.copy()
    for end in range(shifted.size, 1, -1):
        shifted[:end] = np.cumsum(shifted[:end])
    return shifted


def in_delta(polynomial: Array, sample_time: float) -> Array:
    """Rewrite a polynomial in z as one in delta = (z - 1)/T, whose coefficients do not crowd about zero."""
    powers = np.arange(polynomial.size - 1, -1, -1)
    return np.asarray(about_one(polynomial) * sample_time**powers, dtype=np.float64)


def _zeros_at_origin(polynomial: Array) -> int:
    return polynomial.size - np.trim_zeros(polynomial, "b").size


def _state_space_fraction(system: StateSpace) -> tuple[Array, Array]:
    a, b, c, d = matrices(system)
    den = np.poly(a) if a.size else np.ones(1)
    # det(zI - A + B C) = det(zI - A) (1 + C (zI - A)^-1 B) for one input and one output.
    closed = np.poly(a - b @ c) if a.size else np.ones(1)
    return np.real(closed + (d[0, 0] - 1.0) * den), np.real(den)

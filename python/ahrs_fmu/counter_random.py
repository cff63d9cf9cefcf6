"""Random numbers that are a pure function of (seed, stream, index).

There is no state to carry: sample k of a stream is computed from k alone, so that a simulation can be
restarted anywhere, runs of a batch are independent by construction, and a sensor inside an FMU draws
what the Python model draws. The generator is Philox4x32-10 (Salmon, Moraes, Dror and Shaw, "Parallel
random numbers: as easy as 1, 2, 3", SC 2011): the seed is its key, stream and index are its counter.

Normal numbers come from the inverse distribution function AS 241 (Wichura, Applied Statistics 37,
1988), whose logarithm is computed here from + - * / alone; with sqrt, which IEEE 754 rounds correctly,
the bits are the same on every machine and in the C twin fmu_src/core/random.h.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ahrs_fmu.errors import ParameterError

Array = NDArray[np.float64]
Words = NDArray[np.uint64]

_ROUNDS = 10
_MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_KEY_STEPS = (np.uint64(0x9E3779B9), np.uint64(0xBB67AE85))
_LOW = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)

_LN2 = 0.6931471805599453
_SQRT_HALF = 0.7071067811865476
_LOG_TERMS = tuple(1.0 / n for n in range(21, 0, -2))

# Numerator and denominator of AS 241, highest power first, for the centre (|p - 1/2| <= 0.425), the
# shoulder (sqrt(-ln p) <= 5) and the tail.
_CENTRE = (
    (
        2509.0809287301226727,
        33430.575583588128105,
        67265.770927008700853,
        45921.953931549871457,
        13731.693765509461125,
        1971.5909503065514427,
        133.14166789178437745,
        3.387132872796366608,
    ),
    (
        5226.495278852545925,
        28729.085735721942674,
        39307.89580009271061,
        21213.794301586595867,
        5394.1960214247511077,
        687.1870074920579083,
        42.313330701600911252,
        1.0,
    ),
)
_SHOULDER = (
    (
        7.7454501427834140764e-4,
        0.0227238449892691845833,
        0.24178072517745061177,
        1.27045825245236838258,
        3.64784832476320460504,
        5.7694972214606914055,
        4.6303378461565452959,
        1.42343711074968357734,
    ),
    (
        1.05075007164441684324e-9,
        5.475938084995344946e-4,
        0.0151986665636164571966,
        0.14810397642748007459,
        0.68976733498510000455,
        1.6763848301838038494,
        2.05319162663775882187,
        1.0,
    ),
)
_TAIL = (
    (
        2.01033439929228813265e-7,
        2.71155556874348757815e-5,
        0.0012426609473880784386,
        0.026532189526576123093,
        0.29656057182850489123,
        1.7848265399172913358,
        5.4637849111641143699,
        6.6579046435011037772,
    ),
    (
        2.04426310338993978564e-15,
        1.4215117583164458887e-7,
        1.8463183175100546818e-5,
        7.868691311456132591e-4,
        0.0148753612908506148525,
        0.13692988092273580531,
        0.59983220655588793769,
        1.0,
    ),
)


def words(seed: ArrayLike, stream: ArrayLike, index: ArrayLike) -> Words:
    """Four independent 32-bit words per counter.

    Parameters
    ----------
    seed, stream, index
        Integers in 0 .. 2**64 - 1; they broadcast against each other.

    Returns
    -------
    array (..., 4) of uint64, each below 2**32

    Raises
    ------
    ParameterError
        If one of them is not an integer of that range.
    """
    seed, stream, index = np.broadcast_arrays(
        _unsigned("seed", seed), _unsigned("stream", stream), _unsigned("index", index)
    )
    c0, c1, c2, c3 = index & _LOW, index >> _SHIFT, stream & _LOW, stream >> _SHIFT
    k0, k1 = seed & _LOW, seed >> _SHIFT
    for _ in range(_ROUNDS):
        first, second = _MULTIPLIERS[0] * c0, _MULTIPLIERS[1] * c2
        c0, c1 = (second >> _SHIFT) ^ c1 ^ k0, second & _LOW
        c2, c3 = (first >> _SHIFT) ^ c3 ^ k1, first & _LOW
        k0, k1 = (k0 + _KEY_STEPS[0]) & _LOW, (k1 + _KEY_STEPS[1]) & _LOW
    return np.stack((c0, c1, c2, c3), axis=-1)


def uniform_pair(seed: ArrayLike, stream: ArrayLike, index: ArrayLike) -> Array:
    """Two independent numbers (..., 2), uniform in the open interval (0, 1), steps of 2**-52.

    Neither 0 nor 1 occurs, and u is as likely as 1 - u, which is exact. Parameters as in `words`.
    """
    w = words(seed, stream, index)
    bits = (w[..., 1::2] << _SHIFT | w[..., 0::2]) >> np.uint64(12)
    uniform: Array = (bits.astype(np.float64) + 0.5) * 2.0**-52
    return uniform


def normal_pair(seed: ArrayLike, stream: ArrayLike, index: ArrayLike) -> Array:
    """Two independent standard normal numbers (..., 2), within +-8.21. Parameters as in `words`."""
    return normal_quantile(uniform_pair(seed, stream, index))


def normal_quantile(p: ArrayLike) -> Array:
    """Give the standard normal number of probability p in (0, 1), any shape; relative error 1e-15."""
    p = np.asarray(p, dtype=np.float64)
    q = p - 0.5
    r = 0.180625 - q * q
    result = np.asarray(q * (_polynomial(_CENTRE[0], r) / _polynomial(_CENTRE[1], r)))
    outer = np.abs(q) > 0.425
    if np.any(outer):
        result[outer] = _outer_quantile(p[outer])
    return result


def _outer_quantile(p: Array) -> Array:
    below = p < 0.5
    r = np.sqrt(-_log(np.where(below, p, 1.0 - p)))
    shoulder, tail = r - 1.6, r - 5.0
    magnitude = np.where(
        r <= 5.0,
        _polynomial(_SHOULDER[0], shoulder) / _polynomial(_SHOULDER[1], shoulder),
        _polynomial(_TAIL[0], tail) / _polynomial(_TAIL[1], tail),
    )
    return np.where(below, -magnitude, magnitude)


def _log(x: Array) -> Array:
    """Natural logarithm of positive normal numbers: 2 artanh((m - 1) / (m + 1)) + e ln 2."""
    m, exponent = np.frexp(x)
    low = m < _SQRT_HALF
    m = np.where(low, m + m, m)
    e = np.where(low, exponent - 1, exponent).astype(np.float64)
    s = (m - 1.0) / (m + 1.0)
    return 2.0 * s * _polynomial(_LOG_TERMS, s * s) + e * _LN2


def _polynomial(coefficients: tuple[float, ...], x: Array) -> Array:
    value = np.full_like(x, coefficients[0])
    for c in coefficients[1:]:
        value = value * x + c
    return value


def _unsigned(name: str, value: ArrayLike) -> Words:
    given = np.asarray(value)
    if given.dtype.kind not in "ui" or (given.dtype.kind == "i" and np.any(given < 0)):
        raise ParameterError(f"{name} = {value!r}: give integers from 0 to 2**64 - 1")
    return given.astype(np.uint64)

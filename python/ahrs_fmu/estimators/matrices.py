"""Small matrices over leading batch dimensions, for the filters with a covariance."""

from __future__ import annotations

import numpy as np

from ahrs_fmu.estimators.state import Array, Mask, select

LEAST_VARIANCE = 1e-12


def transposed(m: Array) -> Array:
    """Transpose of matrices (..., n, m)."""
    return np.swapaxes(m, -1, -2)


def symmetric(m: Array) -> Array:
    """Symmetric part of matrices (..., n, n)."""
    half: Array = 0.5 * (m + transposed(m))
    return half


def apply(m: Array, v: Array) -> Array:
    """Matrices (..., n, m) times vectors (..., m)."""
    product: Array = (m @ v[..., None])[..., 0]
    return product


def outer(a: Array, b: Array) -> Array:
    """Outer product (..., n, m) of vectors."""
    product: Array = a[..., :, None] * b[..., None, :]
    return product


def diagonal(values: Array) -> Array:
    """Diagonal matrices (..., n, n) of vectors (..., n)."""
    matrix: Array = values[..., None] * np.eye(values.shape[-1])
    return matrix


def skew(v: Array) -> Array:
    """Matrices (..., 3, 3) of the vector product with v from the left."""
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    o = np.zeros_like(x)
    rows = (np.stack((o, -z, y), -1), np.stack((z, o, -x), -1), np.stack((-y, x, o), -1))
    return np.stack(rows, axis=-2)


def turn_matrix(q: Array) -> Array:
    """XI(q) (..., 4, 3) with q (x) (0, d) = XI(q) d."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    rows = (
        np.stack((-x, -y, -z), -1),
        np.stack((w, -z, y), -1),
        np.stack((z, w, -x), -1),
        np.stack((-y, x, w), -1),
    )
    return np.stack(rows, axis=-2)


def cholesky(m: Array) -> Array:
    """Lower Cholesky factors of symmetric matrices (..., n, n); NaN where there is none."""
    n = m.shape[-1]
    factor = np.zeros_like(m)
    for j in range(n):
        rest = m[..., j:, j] - (factor[..., j:, :j] @ factor[..., j, :j, None])[..., 0]
        factor[..., j:, j] = rest / np.sqrt(rest[..., :1])
    return factor


def solve_right(a: Array, s: Array) -> Array:
    """A S^-1 of matrices (..., n, m) and symmetric positive definite (..., m, m)."""
    return transposed(np.asarray(np.linalg.solve(s, transposed(a)), dtype=a.dtype))


def corrected(p: Array, gain: Array, h: Array, r: Array) -> Array:
    """Covariance after a correction, in Joseph's form, which keeps it positive."""
    rest = np.eye(p.shape[-1]) - gain @ h
    return symmetric(rest @ p @ transposed(rest) + gain @ r @ transposed(gain))


def all_finite(m: Array) -> Mask:
    """Where matrices (..., n, m) are finite."""
    return np.asarray(np.isfinite(m).all(axis=(-1, -2)))


def bounded(m: Array, low: float, high: float) -> Array:
    """Symmetric matrices with their eigenvalues brought between two limits; NaN where they are not finite."""
    finite = all_finite(m)
    values, vectors = np.linalg.eigh(select(finite, m, np.broadcast_to(np.eye(m.shape[-1]), m.shape)))
    clipped = np.clip(values, low, high)[..., None, :]
    inside: Array = symmetric((vectors * clipped) @ transposed(vectors))
    return select(finite, inside, np.full_like(m, np.nan))


def floored(m: Array, initial: Array) -> tuple[Array, Mask]:
    """Covariances with all eigenvalues above a floor; the initial one where not finite, and where."""
    lost = ~all_finite(m)
    m = select(lost, initial, m)
    low = ~all_finite(cholesky(m - LEAST_VARIANCE * np.eye(m.shape[-1])))
    if low.any():
        m = select(low, bounded(m, LEAST_VARIANCE, np.inf), m)
    return m, lost


def quaternion_std(p: Array, q: Array) -> Array:
    """Standard deviation about the body axes (..., 3), rad, of a covariance of the quaternion (..., 4, 4)."""
    xi = turn_matrix(q)
    variance = np.einsum("...ik,...ij,...jk->...k", xi, p, xi)
    std: Array = 2.0 * np.sqrt(np.maximum(variance, 0.0))
    return std

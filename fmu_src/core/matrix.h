/* Small symmetric and triangular matrices. Both are kept as their lower triangle, row by row without gaps; rectangular
 * ones row by row. The sizes are arguments, so that they are constants wherever a function is inlined. */
#ifndef AHRS_MATRIX_H
#define AHRS_MATRIX_H

#include "ahrs_real.h"

enum { AHRS_MATRIX_MAX = 12 };

/* Number of elements of a triangle with n rows, and so the place of row n in a larger one. */
#define AHRS_TRIANGLE(n) ((n) * ((n) + 1) / 2)

/* Element (i, j) of a symmetric matrix. */
static inline ahrs_real *ahrs_at(ahrs_real *a, int32_t i, int32_t j) {
    return i >= j ? &a[AHRS_TRIANGLE(i) + j] : &a[AHRS_TRIANGLE(j) + i];
}

static inline ahrs_real ahrs_of(const ahrs_real *a, int32_t i, int32_t j) {
    return i >= j ? a[AHRS_TRIANGLE(i) + j] : a[AHRS_TRIANGLE(j) + i];
}

static inline void ahrs_add_diagonal(int32_t n, ahrs_real *a, ahrs_real k) {
    for (int32_t i = 0; i < n; i++) {
        a[AHRS_TRIANGLE(i) + i] += k;
    }
}

/* a = L L'; false where a is not positive definite. l may be a. */
static inline bool ahrs_cholesky(int32_t n, const ahrs_real *a, ahrs_real *l) {
    for (int32_t i = 0; i < n; i++) {
        ahrs_real *const row = &l[AHRS_TRIANGLE(i)];
        for (int32_t j = 0; j <= i; j++) {
            const ahrs_real *const other = &l[AHRS_TRIANGLE(j)];
            ahrs_real sum = a[AHRS_TRIANGLE(i) + j];
            for (int32_t k = 0; k < j; k++) {
                sum -= row[k] * other[k];
            }
            if (j < i) {
                row[j] = sum / other[j];
            } else if (sum > 0 && ahrs_is_finite(sum)) {
                row[j] = ahrs_sqrt(sum);
            } else {
                return false;
            }
        }
    }
    return true;
}

/* Whether every eigenvalue of a is above the floor. */
static inline bool ahrs_is_above(int32_t n, const ahrs_real *a, ahrs_real floor) {
    ahrs_real l[AHRS_TRIANGLE(AHRS_MATRIX_MAX)];
    for (int32_t i = 0; i < AHRS_TRIANGLE(n); i++) {
        l[i] = a[i];
    }
    ahrs_add_diagonal(n, l, -floor);
    return ahrs_cholesky(n, l, l);
}

/* x := L^-1 x */
static inline void ahrs_solve_lower(int32_t n, const ahrs_real *l, ahrs_real *x) {
    for (int32_t i = 0; i < n; i++) {
        const ahrs_real *const row = &l[AHRS_TRIANGLE(i)];
        for (int32_t k = 0; k < i; k++) {
            x[i] -= row[k] * x[k];
        }
        x[i] /= row[i];
    }
}

/* x := L'^-1 x */
static inline void ahrs_solve_upper(int32_t n, const ahrs_real *l, ahrs_real *x) {
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t k = i + 1; k < n; k++) {
            x[i] -= l[AHRS_TRIANGLE(k) + i] * x[k];
        }
        x[i] /= l[AHRS_TRIANGLE(i) + i];
    }
}

/* The triangle l with l l' = a a' for a of n rows and m >= n columns, by reflections; a is destroyed. False where a row
 * depends on those above it. */
static inline bool ahrs_triangle_of(int32_t n, int32_t m, ahrs_real *a, ahrs_real *l) {
    for (int32_t i = 0; i < n; i++) {
        ahrs_real *const pivot = &a[i * m];
        ahrs_real norm2 = 0;
        for (int32_t k = i; k < m; k++) {
            norm2 += pivot[k] * pivot[k];
        }
        if (!(norm2 > 0 && ahrs_is_finite(norm2))) {
            return false;
        }
        /* The reflection brings the rest of the row onto the axis that leaves the larger mirror vector. */
        const ahrs_real norm = ahrs_sqrt(norm2);
        const ahrs_real side = pivot[i] < 0 ? -1 : 1;
        pivot[i] += side * norm;
        const ahrs_real scale = 1 / (norm * ahrs_abs(pivot[i]));
        for (int32_t r = i + 1; r < n; r++) {
            ahrs_real *const row = &a[r * m];
            ahrs_real dot = 0;
            for (int32_t k = i; k < m; k++) {
                dot += pivot[k] * row[k];
            }
            for (int32_t k = i; k < m; k++) {
                row[k] -= scale * dot * pivot[k];
            }
            l[AHRS_TRIANGLE(r) + i] = -side * row[i]; /* the diagonal is positive */
        }
        l[AHRS_TRIANGLE(i) + i] = norm;
    }
    return true;
}

/* l l' + sign x x' as a triangle again; x is destroyed. False, and l destroyed, where that is not positive definite. */
static inline bool ahrs_add_square(int32_t n, ahrs_real *l, ahrs_real *x, ahrs_real sign) {
    for (int32_t i = 0; i < n; i++) {
        ahrs_real *const diagonal = &l[AHRS_TRIANGLE(i) + i];
        const ahrs_real norm2 = *diagonal * *diagonal + sign * x[i] * x[i];
        if (!(norm2 > 0 && ahrs_is_finite(norm2))) {
            return false;
        }
        const ahrs_real norm = ahrs_sqrt(norm2);
        const ahrs_real c = *diagonal / norm, s = x[i] / norm;
        *diagonal = norm;
        for (int32_t k = i + 1; k < n; k++) {
            ahrs_real *const below = &l[AHRS_TRIANGLE(k) + i];
            const ahrs_real old = *below;
            *below = c * old + sign * s * x[k];
            x[k] = c * x[k] - s * old;
        }
    }
    return true;
}

/* One rotation of Jacobi's method: brings element (i, j) of a to zero, unless it is negligible already, and turns the
 * rows of v along. */
static inline void ahrs_jacobi_rotation(int32_t n, ahrs_real *a, ahrs_real *v, int32_t i, int32_t j) {
    const ahrs_real off = ahrs_of(a, i, j), both = ahrs_of(a, i, i) * ahrs_of(a, j, j);
    if (!(off * off > AHRS_REAL_EPSILON * AHRS_REAL_EPSILON * ahrs_abs(both))) {
        return;
    }
    const ahrs_real theta = (ahrs_of(a, j, j) - ahrs_of(a, i, i)) / (2 * off);
    const ahrs_real size = 1 / (ahrs_abs(theta) + ahrs_sqrt(theta * theta + 1));
    const ahrs_real tangent = theta < 0 ? -size : size;
    const ahrs_real c = 1 / ahrs_sqrt(tangent * tangent + 1), s = tangent * c;
    *ahrs_at(a, i, i) -= tangent * off;
    *ahrs_at(a, j, j) += tangent * off;
    *ahrs_at(a, i, j) = 0;
    for (int32_t k = 0; k < n; k++) {
        if (k != i && k != j) {
            const ahrs_real aik = ahrs_of(a, i, k), ajk = ahrs_of(a, j, k);
            *ahrs_at(a, i, k) = c * aik - s * ajk;
            *ahrs_at(a, j, k) = s * aik + c * ajk;
        }
        const ahrs_real vik = v[i * n + k], vjk = v[j * n + k];
        v[i * n + k] = c * vik - s * vjk;
        v[j * n + k] = s * vik + c * vjk;
    }
}

/* Brings the eigenvalues of a (at most 4 rows, finite) into [low, high]. */
static inline void ahrs_clamp_eigenvalues(int32_t n, ahrs_real *a, ahrs_real low, ahrs_real high) {
    enum { MOST = 4, SWEEPS = 10 };
    ahrs_real v[MOST * MOST] = {0}, d[MOST];
    for (int32_t i = 0; i < n; i++) {
        v[i * n + i] = 1;
    }
    for (int32_t sweep = 0; sweep < SWEEPS; sweep++) {
        for (int32_t i = 1; i < n; i++) {
            for (int32_t j = 0; j < i; j++) {
                ahrs_jacobi_rotation(n, a, v, i, j);
            }
        }
    }
    for (int32_t i = 0; i < n; i++) {
        d[i] = ahrs_clamp(ahrs_of(a, i, i), low, high);
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j <= i; j++) {
            ahrs_real sum = 0;
            for (int32_t k = 0; k < n; k++) {
                sum += d[k] * v[k * n + i] * v[k * n + j];
            }
            *ahrs_at(a, i, j) = sum;
        }
    }
}

#endif

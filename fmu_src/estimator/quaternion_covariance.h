/* Covariance of the four elements of a quaternion, as a triangle of matrix.h. */
#ifndef AHRS_QUATERNION_COVARIANCE_H
#define AHRS_QUATERNION_COVARIANCE_H

#include "estimator.h"
#include "matrix.h"

/* No eigenvalue is let below this. */
#define AHRS_COVARIANCE_LEAST AHRS_C(1e-12)


static inline void ahrs_quat_rows(const ahrs_real *p, ahrs_quat row[4]) {
    for (int32_t i = 0; i < 4; i++) {
        row[i] = (ahrs_quat){ahrs_of(p, i, 0), ahrs_of(p, i, 1), ahrs_of(p, i, 2), ahrs_of(p, i, 3)};
    }
}

/* variance times the unit matrix */
static inline void ahrs_quat_covariance_set(ahrs_real *p, ahrs_real variance) {
    for (int32_t i = 0; i < AHRS_TRIANGLE(4); i++) {
        p[i] = 0;
    }
    ahrs_add_diagonal(4, p, variance);
}

/* After every quaternion has been multiplied with r from the right: F P F' with F x = x (x) r. */
static inline void ahrs_quat_covariance_turn(ahrs_real *p, ahrs_quat r) {
    ahrs_quat row[4];
    ahrs_real half[4][4];
    ahrs_quat_rows(p, row);
    for (int32_t i = 0; i < 4; i++) {
        ahrs_quat_to(half[i], ahrs_quat_mul(row[i], r));
    }
    for (int32_t j = 0; j < 4; j++) {
        ahrs_real column[4];
        ahrs_quat_to(column, ahrs_quat_mul((ahrs_quat){half[0][j], half[1][j], half[2][j], half[3][j]}, r));
        for (int32_t i = j; i < 4; i++) {
            *ahrs_at(p, i, j) = column[i];
        }
    }
}

/* Adds k (I - q q'): noise across a unit quaternion, none along it. A rotation of variance v gives k = v/4. */
static inline void ahrs_quat_covariance_spread(ahrs_real *p, ahrs_quat q, ahrs_real k) {
    ahrs_real e[4];
    ahrs_quat_to(e, q);
    for (int32_t i = 0; i < 4; i++) {
        for (int32_t j = 0; j <= i; j++) {
            *ahrs_at(p, i, j) += k * ((i == j ? 1 : 0) - e[i] * e[j]);
        }
    }
}

/* Keeps the matrix positive definite; false where it has no meaning left. */
static inline bool ahrs_quat_covariance_keep(ahrs_real *p) {
    for (int32_t i = 0; i < AHRS_TRIANGLE(4); i++) {
        if (!ahrs_is_finite(p[i])) {
            return false;
        }
    }
    if (AHRS_UNLIKELY(!ahrs_is_above(4, p, AHRS_COVARIANCE_LEAST))) {
        ahrs_clamp_eigenvalues(4, p, AHRS_COVARIANCE_LEAST, AHRS_REAL_MAX);
    }
    return true;
}

/* Standard deviation of the rotation about each body axis: turning by v moves q by q (x) v/2. */
static inline ahrs_vec3 ahrs_quat_covariance_std(const ahrs_real *p, ahrs_quat q) {
    const ahrs_quat axis[3] = {
        ahrs_quat_mul(q, (ahrs_quat){0, 1, 0, 0}),
        ahrs_quat_mul(q, (ahrs_quat){0, 0, 1, 0}),
        ahrs_quat_mul(q, (ahrs_quat){0, 0, 0, 1}),
    };
    ahrs_quat row[4];
    ahrs_real variance[3];
    ahrs_quat_rows(p, row);
    for (int32_t i = 0; i < 3; i++) {
        const ahrs_quat image = {ahrs_quat_dot(row[0], axis[i]), ahrs_quat_dot(row[1], axis[i]),
                                 ahrs_quat_dot(row[2], axis[i]), ahrs_quat_dot(row[3], axis[i])};
        variance[i] = ahrs_max(ahrs_quat_dot(axis[i], image), 0);
    }
    return (ahrs_vec3){2 * ahrs_sqrt(variance[0]), 2 * ahrs_sqrt(variance[1]), 2 * ahrs_sqrt(variance[2])};
}

#endif

/* What accelerometer and magnetometer say about an attitude (docs/algorithms.md section 5). */
#ifndef AHRS_ATTITUDE_ERROR_H
#define AHRS_ATTITUDE_ERROR_H

#include "estimator.h"

/* Tilt from gravity, heading from the horizontal field, as a rotation vector in body axes for small errors: loop gain one
 * on all axes. The rows of c are the navigation axes seen from the body. */
AHRS_INLINE ahrs_vec3 ahrs_decoupled_error(ahrs_mat3 c, const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_cross(c.row[AHRS_DOWN], ahrs_vec3_unit(z->accel)); /* a x s with s = -down */
    }
    if (z->mag_usable) {
        const ahrs_real x = ahrs_vec3_dot(c.row[AHRS_NORTH], z->mag);
        const ahrs_real y = ahrs_vec3_dot(c.row[AHRS_EAST], z->mag);
        const ahrs_real norm2 = x * x + y * y;
        if (norm2 > 0) { /* y/norm, where quotient and root do not wait for each other */
            e = ahrs_vec3_sub(e, ahrs_vec3_scale(c.row[AHRS_DOWN], y / norm2 * ahrs_sqrt(norm2)));
        }
    }
    return e;
}

/* The shortest rotation vector that brings down to where the accelerometer shows it. */
static inline ahrs_vec3 ahrs_tilt_error(ahrs_vec3 down, ahrs_vec3 force) {
    const ahrs_vec3 measured = ahrs_vec3_unit(ahrs_vec3_negate(force));
    const ahrs_vec3 cross = ahrs_vec3_cross(measured, down);
    const ahrs_real sine = ahrs_vec3_norm(cross);
    return sine > 0 ? ahrs_vec3_scale(cross, ahrs_atan2(sine, ahrs_vec3_dot(measured, down)) / sine) : cross;
}

/* Whether both vectors together show an attitude. The front end has looked at the accelerometer as read; here it is the
 * one that motion compensation leaves. */
static inline bool ahrs_shows_attitude(const ahrs_sample *z) {
    return z->accel_usable && z->mag_usable && ahrs_has_horizontal_part(z->mag, z->accel);
}

/* The rotation from a predicted attitude to the one that accelerometer and magnetometer show; of what cannot be used,
 * the prediction is kept. */
static inline ahrs_vec3 ahrs_attitude_error(ahrs_quat q, const ahrs_sample *z) {
    if (ahrs_shows_attitude(z)) {
        return ahrs_quat_log(ahrs_quat_mul(ahrs_quat_conj(q), ahrs_attitude_of(z->accel, z->mag)));
    }
    return z->accel_usable ? ahrs_tilt_error(ahrs_quat_down(q), z->accel)
                           : ahrs_decoupled_error(ahrs_quat_to_mat3(q), z);
}

/* The attitude that accelerometer and magnetometer show, with the sign of the predicted one. */
static inline ahrs_quat ahrs_measured_attitude(ahrs_quat q, const ahrs_sample *z) {
    if (ahrs_shows_attitude(z)) {
        return ahrs_quat_near(ahrs_attitude_of(z->accel, z->mag), q);
    }
    return ahrs_quat_turn(q, ahrs_attitude_error(q, z));
}

#endif

/* Unit quaternions, Hamilton product, scalar first, passed by value.
 * As an attitude q turns body vectors into navigation vectors: v_n = q v_b q* (docs/algorithms.md section 0). */
#ifndef AHRS_QUAT_H
#define AHRS_QUAT_H

#include "mat3.h"
#include "trig.h"

typedef struct {
    ahrs_real w, x, y, z;
} ahrs_quat;

#define AHRS_QUAT_IDENTITY ((ahrs_quat){1, 0, 0, 0})

static inline ahrs_quat ahrs_quat_of(const ahrs_real q[4]) { return (ahrs_quat){q[0], q[1], q[2], q[3]}; }

static inline void ahrs_quat_to(ahrs_real out[4], ahrs_quat q) {
    out[0] = q.w;
    out[1] = q.x;
    out[2] = q.y;
    out[3] = q.z;
}

static inline ahrs_quat ahrs_quat_mul(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                       p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}

static inline ahrs_quat ahrs_quat_conj(ahrs_quat q) { return (ahrs_quat){q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_quat ahrs_quat_negate(ahrs_quat q) { return (ahrs_quat){-q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_real ahrs_quat_dot(ahrs_quat p, ahrs_quat q) { return p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z; }

static inline ahrs_quat ahrs_quat_add(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){p.w + q.w, p.x + q.x, p.y + q.y, p.z + q.z};
}

static inline ahrs_quat ahrs_quat_sub(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){p.w - q.w, p.x - q.x, p.y - q.y, p.z - q.z};
}

static inline ahrs_quat ahrs_quat_scale(ahrs_quat q, ahrs_real k) {
    return (ahrs_quat){q.w * k, q.x * k, q.y * k, q.z * k};
}

/* q, or -q where that is nearer to the reference: the same attitude without a jump of sign. */
static inline ahrs_quat ahrs_quat_near(ahrs_quat q, ahrs_quat reference) {
    return ahrs_quat_dot(q, reference) < 0 ? ahrs_quat_negate(q) : q;
}

/* The caller makes sure that q is not zero. */
static inline ahrs_quat ahrs_quat_unit(ahrs_quat q) { return ahrs_quat_scale(q, 1 / ahrs_sqrt(ahrs_quat_dot(q, q))); }

/* Takes out the rounding of a product of unit quaternions: one Newton step of 1/sqrt at 1. */
static inline ahrs_quat ahrs_quat_refine(ahrs_quat q) {
    return ahrs_quat_scale(q, AHRS_C(1.5) - AHRS_C(0.5) * ahrs_quat_dot(q, q));
}

/* Rotation vector to quaternion: [cos(|v|/2), sin(|v|/2) v/|v|]. */
static inline ahrs_quat ahrs_quat_exp_large(ahrs_vec3 v) {
    const ahrs_real half = AHRS_C(0.5) * ahrs_vec3_norm(v);
    ahrs_real sine, cosine;
    ahrs_sincos(half, &sine, &cosine);
    const ahrs_real k = AHRS_C(0.5) * sine / half;
    return (ahrs_quat){cosine, k * v.x, k * v.y, k * v.z};
}

static inline ahrs_quat ahrs_quat_exp(ahrs_vec3 v) {
    const ahrs_real x2 = AHRS_C(0.25) * ahrs_vec3_norm2(v);
    if (x2 > AHRS_C(0.01)) {
        return ahrs_quat_exp_large(v);
    }
    /* The rotation of one sample seldom exceeds 0.2 rad: the series are short. */
    const ahrs_real x4 = x2 * x2;
    const ahrs_real cosine = (1 - AHRS_C(0.5) * x2) + x4 * (AHRS_C(0.041666666666666664) - AHRS_C(0.001388888888888889) * x2 +
                                                            AHRS_C(2.48015873015873e-05) * x4);
    const ahrs_real k = (AHRS_C(0.5) - AHRS_C(0.08333333333333333) * x2) +
                        x4 * (AHRS_C(0.004166666666666667) - AHRS_C(9.92063492063492e-05) * x2 +
                              AHRS_C(1.3778659611992945e-06) * x4);
    return (ahrs_quat){cosine, k * v.x, k * v.y, k * v.z};
}

/* Quaternion to the shortest rotation vector. */
static inline ahrs_vec3 ahrs_quat_log(ahrs_quat q) {
    const ahrs_quat p = q.w < 0 ? ahrs_quat_negate(q) : q;
    const ahrs_vec3 v = {p.x, p.y, p.z};
    const ahrs_real sine = ahrs_vec3_norm(v);
    /* Below this the angle and its sine agree to the last bit. */
    const ahrs_real k = sine < AHRS_C(1e-4) * ahrs_sqrt(AHRS_REAL_EPSILON) ? 2 / p.w : 2 * ahrs_atan2(sine, p.w) / sine;
    return ahrs_vec3_scale(v, k);
}

/* The rows of C_nb: the navigation axes seen in body axes. */
static inline ahrs_vec3 ahrs_quat_north(ahrs_quat q) {
    return (ahrs_vec3){q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z, 2 * (q.x * q.y - q.w * q.z),
                       2 * (q.x * q.z + q.w * q.y)};
}

static inline ahrs_vec3 ahrs_quat_east(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.y + q.w * q.z), q.w * q.w - q.x * q.x + q.y * q.y - q.z * q.z,
                       2 * (q.y * q.z - q.w * q.x)};
}

static inline ahrs_vec3 ahrs_quat_down(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x),
                       q.w * q.w - q.x * q.x - q.y * q.y + q.z * q.z};
}

static inline ahrs_mat3 ahrs_quat_to_mat3(ahrs_quat q) {
    return (ahrs_mat3){{ahrs_quat_north(q), ahrs_quat_east(q), ahrs_quat_down(q)}};
}

/* Body to navigation, and back. */
static inline ahrs_vec3 ahrs_quat_rotate(ahrs_quat q, ahrs_vec3 v) { return ahrs_mat3_apply(ahrs_quat_to_mat3(q), v); }

static inline ahrs_vec3 ahrs_quat_rotate_back(ahrs_quat q, ahrs_vec3 v) {
    return ahrs_mat3_apply_transposed(ahrs_quat_to_mat3(q), v);
}

/* From a rotation matrix; the largest component is the pivot, so that no division is by a small number. */
static inline ahrs_quat ahrs_quat_from_mat3(ahrs_mat3 c) {
    const ahrs_vec3 *r = c.row;
    ahrs_quat q;
    if (r[0].x + r[1].y + r[2].z > 0) {
        q = (ahrs_quat){1 + r[0].x + r[1].y + r[2].z, r[2].y - r[1].z, r[0].z - r[2].x, r[1].x - r[0].y};
    } else if (r[0].x >= r[1].y && r[0].x >= r[2].z) {
        q = (ahrs_quat){r[2].y - r[1].z, 1 + r[0].x - r[1].y - r[2].z, r[1].x + r[0].y, r[0].z + r[2].x};
    } else if (r[1].y >= r[2].z) {
        q = (ahrs_quat){r[0].z - r[2].x, r[1].x + r[0].y, 1 - r[0].x + r[1].y - r[2].z, r[2].y + r[1].z};
    } else {
        q = (ahrs_quat){r[1].x - r[0].y, r[0].z + r[2].x, r[2].y + r[1].z, 1 - r[0].x - r[1].y + r[2].z};
    }
    return ahrs_quat_unit(q);
}

/* Roll, pitch and yaw, z-y-x order (docs/algorithms.md section 0). */
static inline ahrs_vec3 ahrs_quat_to_euler(ahrs_quat q) {
    const ahrs_vec3 down = ahrs_quat_down(q);
    const ahrs_real north_x = q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z;
    /* The arc tangent keeps its accuracy at 90 deg of pitch, where the arc sine loses half of the digits. */
    const ahrs_real level = ahrs_sqrt(down.y * down.y + down.z * down.z);
    return (ahrs_vec3){ahrs_atan2(down.y, down.z), ahrs_atan2(-down.x, level),
                       ahrs_atan2(2 * (q.x * q.y + q.w * q.z), north_x)};
}

static inline ahrs_quat ahrs_quat_from_euler(ahrs_vec3 euler) {
    ahrs_real sr, cr, sp, cp, sy, cy;
    ahrs_sincos(AHRS_C(0.5) * euler.x, &sr, &cr);
    ahrs_sincos(AHRS_C(0.5) * euler.y, &sp, &cp);
    ahrs_sincos(AHRS_C(0.5) * euler.z, &sy, &cy);
    return (ahrs_quat){cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                       cr * cp * sy - sr * sp * cy};
}

#endif
